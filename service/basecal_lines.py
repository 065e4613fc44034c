"""What a base-to-base calibration says to a person at a terminal."""

from pathlib import Path

import numpy as np

from robocal.base_calibration.projection import Projection
from robocal.base_calibration.registration import Registration
from robocal.frames import xyz_ypr_from_frame

_NAMES = ("x", "y", "z", "yaw", "pitch", "roll")


def base_calibration_lines(result: Registration, projection: Projection, out: Path) -> list[str]:
    """A few lines: the transform, what is open, what is faulty, what to touch next."""
    unit = np.array([1e-3] * 3 + [np.pi / 180.0] * 3)
    values, std = xyz_ypr_from_frame(result.transform) / unit, result.std / unit
    lines = [f"{len(result.touches)} touches, slave's base in the master's base:"]
    for name, value, u, in_what in zip(_NAMES, values, std, ["mm"] * 3 + ["deg"] * 3, strict=True):
        sure = f"u = {u:.4f}" if np.isfinite(u) else "undetermined"
        lines.append(f"  {name:6}{value:14.4f} {in_what:4}{sure}")
    lines.append(
        f"residual RMS {result.residual_rms * 1e3:.4f} mm, "
        f"chance of a worse fit {result.p_value:.3f}"
    )
    lines += [f"open: {entry.words}; fixed by {entry.fixed_by}" for entry in result.undetermined]
    for fault in result.faults:
        where = f", lines {', '.join(map(str, fault.lines))}" if fault.lines else ""
        lines.append(f"fault: {fault.fault}{where} (probability {fault.probability:.2f})")
    hidden = [entry.name for entry in result.corrections if entry.hidden]
    if hidden:
        lines.append(f"these touches cannot show a fault of: {', '.join(hidden)}")
    lines.append(projection.refusal or "the projection method answers too: see the file")
    if result.next_touch is not None:
        touch = result.next_touch
        lines.append(
            f"best next touch: {'slave' if touch.by_slave else 'master'} on the "
            f"{'rod' if touch.on_rod else 'slide'} cup, slide {touch.slide * 1e3:.0f} mm, "
            f"rod angle {np.rad2deg(touch.angle):.0f} deg, rod length {touch.length * 1e3:.0f} mm: "
            f"{touch.before * 1e3:.3f} -> {touch.after * 1e3:.3f} mm"
        )
    return [*lines, f"-> {out / 'basecal.json'}"]
