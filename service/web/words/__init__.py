"""Every text of the pages, in each language that they speak.

A word in braces is filled in where the text is shown. The pages' scripts are given the same texts.
English is written first; a test holds every other language to its keys and its braces.
"""

from service.web.words.chinese import CHINESE
from service.web.words.chinese_diagnosis import CHINESE_DIAGNOSIS
from service.web.words.chinese_stage import CHINESE_STAGE
from service.web.words.chinese_views import CHINESE_VIEWS
from service.web.words.english import WORDS as ENGLISH
from service.web.words.english_diagnosis import ENGLISH_DIAGNOSIS
from service.web.words.english_stage import ENGLISH_STAGE
from service.web.words.english_views import ENGLISH_VIEWS

DEFAULT_LANGUAGE = "en"
WORDS: dict[str, str] = ENGLISH | ENGLISH_VIEWS | ENGLISH_DIAGNOSIS | ENGLISH_STAGE
LANGUAGES: dict[str, dict[str, str]] = {
    DEFAULT_LANGUAGE: WORDS,
    "zh": CHINESE | CHINESE_VIEWS | CHINESE_DIAGNOSIS | CHINESE_STAGE,
}
