"""How surely slips are named, and how often sound data are blamed.

``python -m tests.robocal.data_faults.slip_study --slips 400 --clean 200 --seed 1``
"""

import argparse
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from robocal.data_faults.search import find_slips
from robocal.data_faults.slip import Slip, mend
from robocal.errors import NoAnswer
from robocal.formats.bundle import Bundle, read_bundle
from tests.robocal.data_faults.spoiled import NAMES, Campaign, Spoiled, slips_of

_STROKE = "column j3_mm has its sign turned: multiply it by -1"
UPSIDE_DOWN = (
    {_STROKE, "the measuring frame is left-handed: multiply z_mm by -1"},
    {_STROKE, "the measuring frame is left-handed: multiply z_mm, qx and qy by -1"},
)


@dataclass(frozen=True)
class Trial:
    """One seeded slip and what was said of it."""

    campaign: Campaign
    kind: str
    right: bool
    said: str


def spoil_and_find(folder: Path, seed: int, *, robot: str | None = None) -> Trial:
    """One seeded slip on a seeded campaign."""
    rng = np.random.default_rng([seed, 7])
    campaign = Campaign(
        robot=robot or NAMES[seed % len(NAMES)],
        seed=seed,
        rows=int(rng.integers(40, 101)),
        full_pose=bool(rng.random() < 0.5),
        outliers=float(rng.choice([0.0, 0.02])),
        sag_mm=float(rng.choice([0.0, 1.0])),
    )
    table = campaign.measure()
    kinds = slips_of(table)
    kind = kinds[rng.integers(len(kinds))]
    spoiled = kind(table, rng)
    table.write(folder / "sound", campaign.robot)
    spoiled.table.write(folder / "spoiled", campaign.robot)
    sound, bundle = read_bundle(folder / "sound"), read_bundle(folder / "spoiled")
    try:
        slips = find_slips(bundle)
    except NoAnswer as answer:
        return Trial(campaign, kind.__name__, right=False, said=str(answer))
    said = " | ".join(slip.report() for slip in slips) or "nothing"
    return Trial(campaign, kind.__name__, is_right(spoiled, slips, bundle, sound), said)


def is_right(spoiled: Spoiled, slips: tuple[Slip, ...], bundle: Bundle, sound: Bundle) -> bool:
    """Named once, with columns and lines, and the mend gives back the sound rows."""
    if len(slips) != 1:
        return False
    slip = slips[0]
    if slip.rivals:
        # A SCARA whose axes are all parallel looks the same upside down: both are said.
        said = {slip.sentence, *slip.rivals}
        return spoiled.fault == "mirrored_frame" and said in UPSIDE_DOWN
    named = (slip.fault, slip.columns, slip.lines)
    if (
        named != (spoiled.fault, spoiled.columns, spoiled.lines)
        or spoiled.mend not in slip.sentence
    ):
        return False
    return gives_back(mend(bundle, slips), sound, exact=spoiled.exact)


def gives_back(mended: Bundle, sound: Bundle, *, exact: bool) -> bool:
    """Every mended row is a row of the sound file, or all are turned alike and the tool is too."""
    ours, theirs = mended.measurements, sound.measurements
    away = np.abs(ours.joints[:, None] - theirs.joints[None]).max(axis=2)
    twin = np.argmin(away, axis=1)
    position = theirs.position[twin]
    turn = np.eye(3)
    if not exact:
        centre, other = ours.position.mean(axis=0), position.mean(axis=0)
        turn, _ = Rotation.align_vectors(ours.position - centre, position - other)
        turn = turn.as_matrix()
        position = (position - other) @ turn.T + centre
    if away.min(axis=1).max() > 1e-7 or np.abs(ours.position - position).max() > 1e-6:
        return False
    if not ours.has_orientation.any():
        return True
    tool = (
        np.swapaxes(_matrices(theirs.orientation[twin]), 1, 2)
        @ turn.T
        @ _matrices(ours.orientation)
    )
    common = np.eye(3) if exact else tool[0]
    return bool(np.abs(tool - common).max() < 1e-6)


def _matrices(quaternion: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(quaternion[:, [1, 2, 3, 0]]).as_matrix()


def alarm_on_sound_data(folder: Path, seed: int) -> str:
    """What is said of a sound campaign; nothing is right."""
    rng = np.random.default_rng([seed, 8])
    campaign = Campaign(
        robot=NAMES[seed % len(NAMES)],
        seed=1000 + seed,
        rows=int(rng.integers(15, 101)),
        full_pose=bool(rng.random() < 0.5),
        outliers=float(rng.choice([0.0, 0.02])),
        sag_mm=float(rng.choice([0.0, 1.0, 2.0])),
        widest=float(rng.choice([0.6, 1.2, 2.5])),
    )
    campaign.measure().write(folder, campaign.robot)
    try:
        slips = find_slips(read_bundle(folder))
    except NoAnswer as answer:
        return f"{campaign}: {answer}"
    return f"{campaign}: {[slip.report() for slip in slips]}" if slips else ""


def main() -> None:
    """Print every miss and the shares."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--slips", type=int, default=400)
    parser.add_argument("--clean", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    right = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for seed in range(chosen.seed, chosen.seed + chosen.slips):
            trial = spoil_and_find(folder, seed)
            right += trial.right
            if not trial.right:
                sys.stdout.write(f"missed {trial.kind}, {trial.campaign}: {trial.said}\n")
        alarms = 0
        for seed in range(chosen.seed, chosen.seed + chosen.clean):
            said = alarm_on_sound_data(folder / "clean", seed)
            alarms += bool(said)
            if said:
                sys.stdout.write(f"false alarm: {said}\n")
    sys.stdout.write(f"named with the exact mend: {right} of {chosen.slips}\n")
    sys.stdout.write(f"false alarms: {alarms} of {chosen.clean}\n")


if __name__ == "__main__":
    main()
