"""Language and colours of the pages: chosen once, kept by the browser."""

import pytest

from service.web.words import LANGUAGES


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_chosen_language_is_that_of_the_whole_page(site, language):
    page = site.get("/", headers={"Cookie": f"robocal_language={language}"}).text
    assert f'<html lang="{language}"' in page
    for key in ("new_campaign", "no_cells", "import_note", "arm_confirm"):
        assert LANGUAGES[language][key] in page
    others = [words for code, words in LANGUAGES.items() if code != language]
    assert all(words["new_campaign"] not in page for words in others)


def test_parts_that_are_renewed_speak_the_language_of_the_page(site):
    part = site.get("/parts/cells", headers={"Cookie": "robocal_language=zh"}).text
    assert LANGUAGES["zh"]["no_cells"] in part


@pytest.mark.parametrize(
    ("accepted", "language"),
    [("zh-CN,zh;q=0.9,en;q=0.8", "zh"), ("de-DE,de,en", "en"), ("en-GB,zh", "en"), ("tlh", "en")],
)
def test_without_a_choice_the_browser_s_language_is_taken(site, accepted, language):
    page = site.get("/", headers={"Accept-Language": accepted}).text
    assert f'<html lang="{language}"' in page


@pytest.mark.parametrize("theme", ["system", "light", "dark"])
def test_the_chosen_colours_are_in_the_page_before_it_is_drawn(site, theme):
    page = site.get("/", headers={"Cookie": f"robocal_theme={theme}"}).text
    assert f'data-theme="{theme}"' in page


def test_a_cookie_that_nobody_set_here_changes_nothing(site):
    page = site.get("/", headers={"Cookie": 'robocal_language="><b>; robocal_theme=<i>'}).text
    assert '<html lang="en" data-theme="system">' in page
