"""The page of a result against documents written by hand, their figures worked out on paper."""

from collections.abc import Callable
from html.parser import HTMLParser

import httpx
import pytest

from service.db.engine import Database
from service.db.models import CampaignRow, ResultRow
from service.web.numbers import aligned

FIGURE_SPACE, POINT_SPACE = "\u2007", "\u2008"


def parameter(name: str, unit: str, nominal: float, identified: float, std: float, **more) -> dict:
    row = {"name": name, "unit": unit, "nominal": nominal, "identified": identified, "std": std}
    return row | {"status": "identified"} | more


def summary(rows: int, rms: float) -> dict:
    return {
        "rows": rows,
        "position_rms_mm": rms,
        "position_mean_mm": rms * 0.9,
        "position_max_mm": rms * 2,
        "orientation_rms_deg": None,
    }


FRAME = {"xyz_mm": [1.0, -2.5, 3.0], "ypr_deg": [10.0, 0.0, -0.5], "std": [0.02] * 3 + [0.004] * 3}
IDENTIFICATION = {
    "parameters": [
        parameter("theta_1", "deg", 0.0, 0.0, 0.0, status="redundant", reason="parallel to yaw"),
        parameter("a_2", "mm", -612.7, -612.95, 0.012),
        parameter("alpha_2", "deg", 90.0, 90.0125, 0.0011),
        parameter("d_3", "mm", 5.0, 5.0, 0.0, status="fixed"),
    ],
    "base": FRAME,
    "tool": FRAME | {"redundant": {"tool_roll": "no orientation was measured"}},
    "rank": 30,
    "condition": 41.2,
    "strategy": "cross",
    "iterations": 7,
    "converged": True,
    "residuals": {
        "before": summary(10, 0.8),
        "fit": summary(30, 0.05),
        "held_out": summary(10, 0.1),
        "random_folds": summary(30, 0.11),
        "blocked_folds": summary(30, 0.14),
    },
    "adequacy": {
        "verdict": "inadequate",
        "reduced_chi_square": 6.25,
        "sentence": "reduced chi-square 6.25, above its band",
    },
    "rejected_rows": [{"line": 17, "reason": "outlier, 9.1 sigma"}],
    "suspect_held_out_rows": [{"line": 23, "reason": "5.2 sigma"}],
    "station_drift": None,
    "bundle_sha256": "ab" * 32,
}
UNCERTAINTY = {
    "draws": 10000,
    "tool_position": {
        "u_propagated_rms_mm": 0.011,
        "u_monte_carlo_rms_mm": 0.0112,
        "U95_mean_mm": 0.024,
        "U95_max_mm": 0.03,
    },
    "reduced_chi_square": 6.25,
    "degrees_of_freedom": 150.00002,
    "workspace": None,
    "intervals": {"hold": False, "sentence": "the intervals do not hold: too wide a scatter"},
}


class Cells(HTMLParser):
    """Rows of tables as lists of their cells' texts, and all other text."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.page = page
        self.text = ""
        self._inside = False
        self.feed(page)
        self.text = " ".join(self.text.split())

    def handle_starttag(self, tag, attrs):
        if tag == "tr":
            self.rows.append([])
        if tag in {"td", "th"}:
            self.rows[-1].append("")
            self._inside = True

    def handle_endtag(self, tag):
        self._inside = self._inside and tag not in {"td", "th"}

    def handle_data(self, text):
        self.text += text
        if self._inside:
            self.rows[-1][-1] += text

    def row(self, first: str) -> list[str]:
        spaces = FIGURE_SPACE + POINT_SPACE
        for row in self.rows:
            if row[0].strip() == first:
                return [cell.strip().rstrip(spaces) for cell in row[1:]]
        raise AssertionError(f"no row {first}")


@pytest.fixture
def show(client: httpx.Client, database: Database) -> Callable[..., Cells]:
    """Store a finished campaign with its results and read the page's part about them."""

    def shown(kind: str = "calibrate", **documents: dict) -> Cells:
        with database.write() as session:
            row = CampaignRow(
                kind=kind,
                state="finished",
                pose_count=40,
                repeats=1,
                settle_s=0.5,
                seed=1,
                robot_yaml="",
                joint_units=["deg"],
                created="2026-11-22T03:46:12.000+00:00",
            )
            session.add(row)
            session.flush()
            for name, document in documents.items():
                session.add(
                    ResultRow(
                        campaign=row.id,
                        kind=name,
                        document=document,
                        bundle_sha256="ab" * 32,
                        software_version="0.1.0",
                        settings={},
                        created=row.created,
                    )
                )
            number = row.id
        answer = client.get(client.base_url.join(f"/parts/campaigns/{number}/result"))
        assert answer.status_code == 200, answer.text
        return Cells(answer.text)

    return shown


def test_parameters_are_shown_with_two_digits_of_their_uncertainty(show):
    part = show(identification=IDENTIFICATION, uncertainty=UNCERTAINTY)
    assert part.row("a2") == ["−612.7", "−612.950", "−0.250", "0.012", "mm", ""]
    assert part.row("α2") == ["90", "90.0125", "+0.0125", "0.0011", "°", ""]


def test_parameters_that_the_readings_leave_open_say_why(show):
    part = show(identification=IDENTIFICATION, uncertainty=UNCERTAINTY)
    assert part.row("θ1") == ["0", "0", "", "", "°", "not determined: parallel to yaw"]
    assert part.row("d3") == ["5", "5", "", "", "mm", "fixed"]
    assert part.row("roll")[:3] == ["−0.5000", "0.0040", "°"]
    assert "not determined: no orientation was measured" in part.text


def test_residuals_stand_before_and_after_with_the_held_out_ones_counting(show):
    part = show(identification=IDENTIFICATION, uncertainty=UNCERTAINTY)
    assert part.row("Nominal, frames fitted") == ["10", "0.8000", "0.7200", "1.6000"]
    assert part.row("Identified, held-out poses") == ["10", "0.1000", "0.0900", "0.2000"]
    assert "0.800 mm" in part.text
    assert "0.100 mm" in part.text
    assert "88 % smaller" in part.text


def test_rows_left_out_are_named(show):
    part = show(identification=IDENTIFICATION, uncertainty=UNCERTAINTY)
    assert "Line 17: outlier, 9.1 sigma" in part.text


def test_suspect_rows_and_the_left_out_folds_are_shown(show):
    part = show(identification=IDENTIFICATION, uncertainty=UNCERTAINTY)
    assert "Line 23: 5.2 sigma" in part.text
    assert part.row("Left out in turn, at random")[:2] == ["30", "0.1100"]
    assert part.row("Left out in turn, in blocks")[:2] == ["30", "0.1400"]


def test_too_few_rows_for_folds_leave_them_out(show):
    residuals = IDENTIFICATION["residuals"] | {"random_folds": {}, "blocked_folds": {}}
    part = show(identification=IDENTIFICATION | {"residuals": residuals}, uncertainty=UNCERTAINTY)
    assert "Left out in turn" not in part.text


@pytest.mark.parametrize(
    ("verdict", "reduced", "tone"),
    [("inadequate", 6.25, "caution"), ("adequate", 1.0, "good"), ("adequate", None, "")],
)
def test_whether_the_model_explains_the_readings_is_said_in_one_sentence(
    show, verdict, reduced, tone
):
    adequacy = {"verdict": verdict, "reduced_chi_square": reduced, "sentence": "it is so"}
    identification = IDENTIFICATION | {"adequacy": adequacy}
    part = show(identification=identification, uncertainty=UNCERTAINTY)
    assert f'<p class="notice {tone}" id="adequacy">It is so.</p>' in part.page


@pytest.mark.parametrize(("hold", "tone"), [(False, "caution"), (True, "good"), (None, "")])
def test_whether_the_uncertainty_may_be_believed_is_said(show, hold, tone):
    uncertainty = UNCERTAINTY | {"intervals": {"hold": hold, "sentence": "it is so"}}
    part = show(identification=IDENTIFICATION, uncertainty=uncertainty)
    assert f'<p class="notice {tone}" id="intervals">It is so.</p>' in part.page
    assert part.row("Reduced chi-square, 150 degrees of freedom")[0] == "6.25"


@pytest.mark.parametrize(
    ("removed", "words"), [(True, "were corrected for it"), (False, "Nothing was corrected")]
)
def test_drift_of_the_station_is_shown_with_what_was_done_about_it(show, removed, words):
    drift = {"removed": removed, "largest_mm": 0.0342, "visits": [{}, {}, {}]}
    part = show(identification=IDENTIFICATION | {"station_drift": drift}, uncertainty=UNCERTAINTY)
    assert "0.034 mm" in part.text
    assert words in part.text


def test_a_fit_that_did_not_converge_is_warned_of(show):
    part = show(identification=IDENTIFICATION | {"converged": False}, uncertainty=UNCERTAINTY)
    assert "Do not use these parameters" in part.text


def test_a_campaign_without_held_out_poses_is_judged_by_its_fit_and_says_so(show):
    residuals = IDENTIFICATION["residuals"] | {"held_out": {}}
    part = show(identification=IDENTIFICATION | {"residuals": residuals}, uncertainty=UNCERTAINTY)
    assert "none were held out" in part.text
    assert "0.050 mm" in part.text
    assert "94 % smaller" in part.text


def test_a_verification_that_made_it_worse_does_not_look_like_a_success(show):
    errors = {"targets": 2, "errors_mm": [0.1, 0.2]}
    before, after = summary(2, 0.2) | errors, summary(2, 0.3) | errors
    part = show("verify", verification={"before": before, "after": after})
    assert part.row("Compensated joints")[:2] == ["2", "0.3000"]
    assert "50 % larger" in part.text
    assert "tile good" not in part.page


def test_points_of_a_column_stand_below_each_other():
    column = aligned(["90", "−612.7", "0.0125", ""])
    assert column == [
        "90" + POINT_SPACE + 4 * FIGURE_SPACE,
        "−612.7" + 3 * FIGURE_SPACE,
        "0.0125",
        "",
    ]


def test_angles_of_the_tool_that_nothing_shows_have_no_uncertainty(show):
    unturned = FRAME | {"std": [0.02, 0.02, 0.02, None, None, None], "rotation_known": False}
    part = show(identification=IDENTIFICATION | {"tool": unturned}, uncertainty=UNCERTAINTY)
    spreads = [row[2].strip() for row in part.rows if row[0] in {"x", "roll"}]
    # Base, then tool.
    assert [bool(spread) for spread in spreads] == [True, True, True, False]
