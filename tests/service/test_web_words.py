"""Every text of the pages stands in one place, and every text there is used."""

import re
from pathlib import Path

import service.web
from service.access.caller import CallerKind
from service.access.scopes import Scope
from service.base_calibrations.models import Cup, Role, Sensors, State, Step, TransformState
from service.campaigns import follow_ups
from service.campaigns.models import CampaignKind, CampaignState
from service.campaigns.store import PURPOSE_CALIBRATE
from service.cells.models import TrackerSettings
from service.parameters.models import LifeEvent, ParametersState
from service.procedures.plan import PURPOSE_COMPENSATED, PURPOSE_HEALTH, PURPOSE_NOMINAL
from service.web import forms
from service.web.preferences import Theme
from service.web.words import DEFAULT_LANGUAGE, LANGUAGES, WORDS

PURPOSES = (
    PURPOSE_CALIBRATE,
    PURPOSE_NOMINAL,
    PURPOSE_COMPENSATED,
    PURPOSE_HEALTH,
    follow_ups.PURPOSE,
)
DOWNLOADS = ("identification", "uncertainty", "verification", "health")
MAPS = ("residual", "uncertainty")
BRACES = re.compile(r"\{\w+\}")
RESIDUALS = ("before", "fit", "held_out", "random_folds", "blocked_folds")
WEB = Path(service.web.__file__).parent
SOURCES = [*WEB.glob("templates/*.html"), *WEB.glob("static/*.js"), *WEB.glob("*.py")]


def named_in_full() -> set[str]:
    text = "\n".join(path.read_text(encoding="utf-8") for path in SOURCES)
    return set(re.findall(r"\bw\.(\w+)", text)) | set(re.findall(r"""["'`](\w+)["'`]""", text))


def made_of_parts() -> set[str]:
    fields = (*forms.cell_fields(), *forms.cell_detail_fields(), *forms.campaign_fields([]))
    return {
        *(f"field_{field.key}" for field in fields),
        *(f"hint_{field.key}" for field in fields),
        *(f"choice_{kind}" for kind in forms.KINDS_OFFERED),
        *(f"kind_{kind}" for kind in CampaignKind),
        *(f"state_{state}" for state in CampaignState),
        f"instrument_{TrackerSettings.model_fields['kind'].default}",
        *(f"purpose_{purpose}" for purpose in PURPOSES),
        *(f"status_{status}" for status in ("identified", "fixed", "redundant")),
        *(f"residuals_{rows}" for rows in RESIDUALS),
        *(f"verification_{rows}" for rows in ("before", "after")),
        *(f"theme_{theme}" for theme in Theme),
        *(f"version_{state}" for state in ParametersState),
        *(f"step_{event}" for event in LifeEvent),
        *(f"{step}_{part}" for step in ("release", "rollback") for part in ("question", "warning")),
        *(f"{name}_map_{part}" for name in MAPS for part in ("picture", "legend")),
        *(f"compare_{side}" for side in ("first", "second")),
        *(f"stage_{role}" for role in Role),
        *(f"stage_robot_{role}" for role in Role),
        *(f"stage_cup_{cup}" for cup in Cup),
        *(f"stage_step_{step}" for step in Step),
        *(f"stage_state_{state}" for state in State),
        *(f"stage_{state}" for state in TransformState),
        *(f"stage_part_{sensor}" for sensor in Sensors.model_fields),
        *(f"caller_{kind}" for kind in CallerKind if kind is not CallerKind.nobody),
        *(f"scope_{scope}" for scope in Scope if scope is not Scope.public),
        *(f"download_{kind}" for kind in DOWNLOADS),
    }


def test_every_text_that_a_page_asks_for_is_there():
    asked = set()
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        asked |= set(re.findall(r"\bw\.(?!get\b)(\w+)", text)) | set(
            re.findall(r'say\("(\w+)"', text)
        )
    optional = {name for name in made_of_parts() if name.startswith("hint_")}
    assert (asked | made_of_parts()) - optional - WORDS.keys() == set()


def test_every_language_has_the_same_texts_with_the_same_braces():
    for language, words in LANGUAGES.items():
        assert words.keys() == WORDS.keys(), language
        for key, text in words.items():
            assert sorted(BRACES.findall(text)) == sorted(BRACES.findall(WORDS[key])), key


def test_no_text_was_left_untranslated():
    for language, words in LANGUAGES.items():
        if language == DEFAULT_LANGUAGE:
            continue
        same = {key for key, text in words.items() if text == WORDS[key]}
        of_people = {key for key in same if re.search(r"[a-z]{3} ", WORDS[key])}
        assert of_people == set(), language


def test_no_text_is_left_over():
    assert WORDS.keys() - named_in_full() - made_of_parts() == set()


def test_templates_and_scripts_hold_no_text_of_their_own():
    for path in WEB.glob("templates/*.html"):
        text = re.sub(r"\{[{%#].*?[}%#]\}", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        between = re.findall(r">([^<>]+)<", text)
        left = [part.strip() for part in between if re.search(r"[A-Za-z]{3}", part)]
        assert left == [], path.name
