"""The rates that a diagnosis is judged by, each beside the bar it has to reach."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from tests.blind.intervals import Estimate, Rate, mean, rate, strength_at
from tests.blind.trials import Trial
from tests.blind.truth import HiddenEffect
from tests.blind.verdict import Verdict

VISIBLE = 5.5
"""Below this Lambda an effect need not be seen even alone; [1]"""
PLAIN = 8.0
"""Above this Lambda an effect ought to be named; [1]"""
MATTERS = 0.25
"""Effects with this signal-to-noise ratio matter; [1]"""
CONFIDENT = 0.95


@dataclass(frozen=True)
class Line:
    """One line of the table."""

    title: str
    value: Rate | Estimate
    bar: float = math.nan
    at_least: bool = True

    @property
    def standing(self) -> str:
        """How the value compares with its bar."""
        low, high = self.value.interval
        if math.isnan(self.bar) or math.isnan(self.value.value):
            return ""
        better = self.value.value >= self.bar if self.at_least else self.value.value <= self.bar
        surely_worse = high < self.bar if self.at_least else low > self.bar
        return "reached" if better else "missed" if surely_worse else "short, not surely"

    def text(self) -> str:
        """The line for people."""
        low, high = self.value.interval
        if isinstance(self.value, Rate):
            shown = f"{self.value.hits}/{self.value.of}"
            numbers = f"{100 * self.value.value:5.1f} %  [{100 * low:5.1f}, {100 * high:5.1f}]"
            bar = f"{100 * self.bar:g} %"
        else:
            shown, bar = "", f"{self.bar:g}"
            numbers = f"{self.value.value:7.3f}  [{low:6.3f}, {high:6.3f}]"
        wanted = "" if math.isnan(self.bar) else f"{'>=' if self.at_least else '<='} {bar}"
        return f"{self.title:<66}{shown:>9} {numbers:<26}{wanted:>10}  {self.standing}"


def top_is(trial: Trial, hidden: HiddenEffect) -> bool:
    """Whether the most important named effect is the hidden one."""
    return bool(trial.verdict.named) and trial.verdict.named[0].cause.is_(hidden)


def top_states(trial: Trial, hidden: HiddenEffect) -> bool:
    """Whether the hidden effect is in the stated set of the most important one."""
    named = trial.verdict.named
    return bool(named) and any(cause.is_(hidden) for cause in named[0].stated)


def matters(hidden: HiddenEffect) -> bool:
    """Whether a hidden effect ought to be named."""
    return hidden.snr >= MATTERS


def clean(trials: list[Trial]) -> list[Line]:
    """Nothing is hidden."""
    return [
        Line(
            "clean data: anything named", rate([bool(t.verdict.named) for t in trials]), 0.03, False
        ),
        Line("clean data: not called adequate", rate([t.verdict.alarmed for t in trials])),
    ]


def one(trials: list[Trial]) -> list[Line]:
    """One effect, or in another form than the catalogue's."""
    hidden = [t.truth.main[0] for t in trials]
    found = [(t, h) for t, h in zip(trials, hidden, strict=True) if t.verdict.alarmed]
    clear = rate([top_is(t, h) for t, h in found if h.strength >= PLAIN])
    right, stated = rate([top_is(*p) for p in found]), rate([top_states(*p) for p in found])
    after = [t.verdict.after_mm / t.truth.noise_floor_mm for t, _ in found if t.verdict.named]
    extra = [len(t.verdict.named) > 1 for t, _ in found]
    mattering = rate([top_is(t, h) for t, h in zip(trials, hidden, strict=True) if matters(h)])
    detected = [t.verdict.alarmed for t in trials]
    law = strength_at([h.strength for h in hidden], detected)
    return [
        Line("one effect: detected", rate(detected)),
        Line("one effect: Lambda at which 95 % are detected", law, 5.5, at_least=False),
        Line("... detected, Lambda >= 8: named right with joint", clear, 0.99),
        Line("... all detected: named right", right, 0.985),
        Line("... all detected: in the stated 95 % set", stated, 0.995),
        Line("... all detected: something else named beside it", rate(extra)),
        Line("... snr >= 0.25: detected and named right", mattering),
        Line("held-out error after, over the noise floor", mean(after), 1.05, at_least=False),
    ]


def other_forms(trials: list[Trial]) -> list[Line]:
    """One effect whose form is not the catalogue's."""
    found = [t for t in trials if t.verdict.alarmed]
    right = rate([top_is(t, t.truth.main[0]) for t in found])
    stated = rate([top_states(t, t.truth.main[0]) for t in found])
    left = rate([t.verdict.word == "partly_explained" for t in found])
    return [
        Line("wrong functional form, detected: named right", right, 0.985),
        Line("... in the stated 95 % set", stated),
        Line("... said to be explained only in part", left),
    ]


def two(trials: list[Trial]) -> list[Line]:
    """Two effects."""
    both = [t for t in trials if all(matters(e) for e in t.truth.main)]
    named = rate([all(t.verdict.names(e) for e in t.truth.main) for t in both])
    exact = rate([t.verdict.is_exactly(t.truth.main) for t in both])
    return [
        Line("two effects that matter (snr >= 0.25): both named", named, 0.98),
        Line("... exactly these named", exact, 0.93),
    ]


def background(trials: list[Trial]) -> list[Line]:
    """One effect over all others at a quarter of their size."""
    visible = [t for t in trials if t.truth.main[0].strength >= VISIBLE]
    everywhere = rate([t.verdict.states(t.truth.main[0]) for t in trials])
    holds = rate([t.verdict.states(t.truth.main[0]) for t in visible])
    first = rate([top_is(t, t.truth.main[0]) for t in visible])
    after = [t.verdict.after_mm / t.truth.noise_floor_mm for t in trials if t.verdict.named]
    return [
        Line("all others at 25 %: a stated 95 % set holds the main cause", everywhere),
        Line("... main cause with Lambda >= 5.5, which alone would be seen", holds, 0.95),
        Line("... of these ranked first", first),
        Line("... held-out error after, over the noise floor", mean(after)),
    ]


def _wrong(trial: Trial) -> bool:
    """Sure, wrong, and called adequate."""
    confident = [
        named.cause
        for named in trial.verdict.named
        if named.cause.probability > CONFIDENT
        and (named.cause.effect, named.cause.joint) not in trial.truth.kindred
    ]
    return bool(confident) and trial.verdict.calls_adequate


def absent(trials: list[Trial]) -> list[Line]:
    """A cause that the catalogue does not hold."""
    visible = [t for t in trials if t.truth.main[0].strength >= PLAIN]
    honest = rate([t.verdict.alarmed and not t.verdict.calls_adequate for t in visible])
    wrong = rate([_wrong(t) for t in trials])
    unknown = [t for t in trials if t.truth.covariates and t.verdict.covariates]
    right = rate([t.verdict.covariates[0] in t.truth.covariates for t in unknown])
    return [
        Line(
            "cause not in the catalogue: sure, wrong, called adequate", wrong, 0.04, at_least=False
        ),
        Line("... Lambda >= 8: said to be unknown or explained in part", honest),
        Line("unknown cause: right covariate", right, 0.95),
    ]


def is_unsure(verdict: Verdict) -> bool:
    """Whether the leading name is not sure."""
    return bool(verdict.named) and verdict.named[0].cause.probability <= CONFIDENT


def is_ambiguous(trial: Trial) -> bool:
    """Whether the leading name of a trial is not sure."""
    return is_unsure(trial.verdict)


def is_settled(trial: Trial) -> bool:
    """Whether the leading name is sure and right."""
    return top_is(trial, trial.truth.main[0]) and not is_ambiguous(trial)


def ambiguous(before: list[Trial], after: list[Trial]) -> list[Line]:
    """Few poses, half the size; then the poses that the diagnosis asked for."""
    unsure = [t for t in before if is_ambiguous(t)]
    settled = Rate(sum(is_settled(t) for t in after), len(unsure))
    right = [top_is(t, t.truth.main[0]) for t in after]
    return [
        Line("ambiguous cases (60 poses, half size)", Rate(len(unsure), len(before))),
        Line("ambiguous cases settled by 20 chosen poses", settled, 0.40),
        Line("... after these poses: named right", rate(right)),
    ]


def data_fault(trials: list[Trial]) -> list[Line]:
    """A fault of the data."""

    def found(trial: Trial) -> bool:
        return any(name == trial.truth.fault for name, _ in trial.verdict.faults)

    return [
        Line("data fault: found with its name", rate([found(t) for t in trials])),
        Line("... refused, without diagnosis", rate([t.verdict.word == "refused" for t in trials])),
        Line("... explained by physics", rate([bool(t.verdict.named) for t in trials])),
    ]


RATES: dict[str, Callable[[list[Trial]], list[Line]]] = {
    "clean": clean,
    "one": one,
    "other_forms": other_forms,
    "two": two,
    "background": background,
    "absent": absent,
    "data_fault": data_fault,
}
