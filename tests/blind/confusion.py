"""Which hidden effects are taken for which."""

from collections import Counter, defaultdict

from tests.blind.trials import Trial
from tests.blind.verdict import BROKEN, BROKEN_DOWN


def confusion(trials: list[Trial]) -> list[str]:
    """One line a hidden cause: drawn, missed, named right, named wrong and as what."""
    rows: dict[str, Counter[str]] = defaultdict(Counter)
    for trial in trials:
        cause = trial.truth.fault or trial.truth.main[0].effect
        rows[cause][_called(trial)] += 1
    lines = [f"  {'hidden':<24}{'drawn':>6}{'missed':>8}{'right':>7}  taken for"]
    for cause in sorted(rows):
        calls = rows[cause]
        missed, right = calls.pop("", 0), calls.pop("right", 0)
        wrong = ", ".join(f"{name} {count}" for name, count in calls.most_common())
        lines.append(
            f"  {cause:<24}{missed + right + calls.total():>6}{missed:>8}{right:>7}  {wrong}"
        )
    return lines


def _called(trial: Trial) -> str:
    """`right`, empty where nothing was seen, else what it was called."""
    verdict = trial.verdict
    if trial.truth.fault is not None:
        names = [name for name, _ in verdict.faults]
        return "right" if trial.truth.fault in names else ", ".join(names) or verdict.word
    if not verdict.alarmed:
        return ""
    if not verdict.named:
        return verdict.word
    hidden = trial.truth.main[0]
    if verdict.named[0].cause.is_(hidden):
        return "right"
    top = verdict.named[0].cause
    return "another joint or order" if top.effect == hidden.effect else top.effect


def broken(trials: list[Trial]) -> list[str]:
    """Every case on which the diagnosis broke down, with the last line of its traceback."""
    lines = []
    for trial in trials:
        if trial.verdict is BROKEN:
            said = (trial.place.result / BROKEN_DOWN).read_text().strip().splitlines()[-1]
            lines.append(f"  {trial.place.bundle.name}  BROKEN DOWN: {said}")
    return lines


def worst(trials: list[Trial]) -> list[str]:
    """Every case that was called something else, with where it lies."""
    lines = []
    for trial in trials:
        if trial.truth.main and _called(trial) not in {"", "right"}:
            hidden = trial.truth.main[0]
            said = ", ".join(
                f"{n.cause.title} {n.cause.probability:.2f}" for n in trial.verdict.named
            )
            lines.append(
                f"  {trial.place.bundle.name}  {hidden.title} Lambda {hidden.strength:.1f}: "
                f"{trial.verdict.word}, {said}"
            )
    return lines
