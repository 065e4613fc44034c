"""How surely slips are named, and how often sound data are blamed.

``python -m tests.robocal.data_faults.slip_study --slips 400 --clean 200 --seed 1 [--nests]``
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
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


Drawn = Callable[[int, np.random.Generator, str], Campaign]


def one_target(seed: int, rng: np.random.Generator, robot: str) -> Campaign:
    """40 to 100 poses, half of them full ones."""
    return Campaign(
        robot=robot,
        seed=seed,
        rows=int(rng.integers(40, 101)),
        full_pose=bool(rng.random() < 0.5),
        outliers=float(rng.choice([0.0, 0.02])),
        sag_mm=float(rng.choice([0.0, 1.0])),
    )


def several_nests(seed: int, rng: np.random.Generator, robot: str) -> Campaign:
    """2 to 4 nests, all seen at each of 12 to 40 poses."""
    nests = int(rng.integers(2, 5))
    return Campaign(
        robot=robot,
        seed=seed,
        rows=nests * int(rng.integers(12, 41)),
        full_pose=False,
        outliers=float(rng.choice([0.0, 0.02])),
        sag_mm=float(rng.choice([0.0, 1.0])),
        nests=nests,
    )


def spoil_and_find(
    folder: Path, seed: int, *, robot: str | None = None, drawn: Drawn = one_target
) -> Trial:
    """One seeded slip on a seeded campaign."""
    rng = np.random.default_rng([seed, 7])
    campaign = drawn(seed, rng, robot or NAMES[seed % len(NAMES)])
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
    if (slip.fault, slip.columns) != (spoiled.fault, spoiled.columns):
        return False
    if spoiled.mend not in slip.sentence or ";" in slip.sentence:
        return False
    mended = mend(bundle, slips)
    unnamed = {*spoiled.lines} - {*slip.lines}
    if {*slip.lines} - {*spoiled.lines} or not _own_joints(unnamed, bundle, sound):
        return False
    return gives_back(mended, sound, exact=spoiled.exact)


def _own_joints(lines: set[int], bundle: Bundle, sound: Bundle) -> bool:
    """Whether these lines were not spoilt: nests of one pose share its joints."""
    ours = bundle.measurements.rows(np.isin(bundle.measurements.lines, list(lines)))
    return all(
        np.array_equal(joints, sound.measurements.joints[_twin(position, sound)])
        for joints, position in zip(ours.joints, ours.position, strict=True)
    )


def _twin(position: np.ndarray, sound: Bundle) -> int:
    return int(np.argmin(np.linalg.norm(sound.measurements.position - position, axis=1)))


def gives_back(mended: Bundle, sound: Bundle, *, exact: bool) -> bool:
    """Every mended row is a row of the sound file, or all are turned alike and the tool is too."""
    ours, theirs = mended.measurements, sound.measurements
    away = np.abs(ours.joints[:, None] - theirs.joints[None]).max(axis=2)
    away[np.array(ours.target)[:, None] != np.array(theirs.target)] = np.inf
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


def sound_target(seed: int, rng: np.random.Generator, robot: str) -> Campaign:
    """15 to 100 poses, some in small volumes."""
    return Campaign(
        robot=robot,
        seed=1000 + seed,
        rows=int(rng.integers(15, 101)),
        full_pose=bool(rng.random() < 0.5),
        outliers=float(rng.choice([0.0, 0.02])),
        sag_mm=float(rng.choice([0.0, 1.0, 2.0])),
        widest=float(rng.choice([0.6, 1.2, 2.5])),
    )


def sound_nests(seed: int, rng: np.random.Generator, robot: str) -> Campaign:
    """2 to 4 nests, all seen at each of 3 to 40 poses."""
    nests, poses = int(rng.integers(2, 5)), int(rng.integers(3, 41))
    campaign = sound_target(seed, rng, robot)
    return replace(campaign, rows=nests * poses, full_pose=False, nests=nests)


def alarm_on_sound_data(folder: Path, seed: int, *, drawn: Drawn = sound_target) -> str:
    """What is said of a sound campaign; nothing is right."""
    rng = np.random.default_rng([seed, 8])
    campaign = drawn(seed, rng, NAMES[seed % len(NAMES)])
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
    parser.add_argument("--nests", action="store_true", help="several nests at every pose")
    chosen = parser.parse_args()
    spoilt, sound = (several_nests, sound_nests) if chosen.nests else (one_target, sound_target)
    right = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for seed in range(chosen.seed, chosen.seed + chosen.slips):
            trial = spoil_and_find(folder, seed, drawn=spoilt)
            right += trial.right
            if not trial.right:
                sys.stdout.write(f"missed {trial.kind}, {trial.campaign}: {trial.said}\n")
        alarms = 0
        for seed in range(chosen.seed, chosen.seed + chosen.clean):
            said = alarm_on_sound_data(folder / "clean", seed, drawn=sound)
            alarms += bool(said)
            if said:
                sys.stdout.write(f"false alarm: {said}\n")
    sys.stdout.write(f"named with the exact mend: {right} of {chosen.slips}\n")
    sys.stdout.write(f"false alarms: {alarms} of {chosen.clean}\n")


if __name__ == "__main__":
    main()
