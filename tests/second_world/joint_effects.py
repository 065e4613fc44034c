"""Errors of one joint's angle.

In their other form springs harden, harmonics have a neighbour, lost motion scatters or changes
sides smoothly.
"""

from collections.abc import Callable

import numpy as np

from tests.second_world.arm import N
from tests.second_world.campaign import Campaign, Change
from tests.second_world.draw import Act, Draw, Hidden

LOADED = {2: 1.0, 3: 2.0, 4: 5.0, 5: 5.0}
"""Joints that carry something, and how much more than joint 2 they yield a newton metre."""
COUPLED = ((3, 2), (5, 4), (6, 5), (6, 4))
"""Joints with the one that drives them too."""
STRAIN_WAVE_RATIO = 100


def turning(joint: int, angle: Callable[[Campaign], np.ndarray]) -> Act:
    """An error of one joint's angle."""

    def act(at: Campaign, change: Change) -> None:
        change.joints[:, joint - 1] += angle(at)

    return act


def yielding(draw: Draw, name: str, low: float, high: float) -> Hidden:
    """A joint gives way to a torque; in the other form its spring hardens."""
    joint = draw.joint(tuple(LOADED))
    size = LOADED[joint] * draw.size(low, high)

    def angle(at: Campaign) -> np.ndarray:
        load = at.torque if name == "joint_compliance" else at.payload_torque
        tau = load[:, joint - 1]
        if not draw.other:
            return size * tau
        much = np.quantile(np.abs(tau), 0.9)
        return size * much * np.tanh(tau / much)

    return Hidden(name, turning(joint, angle), joint)


def joint_compliance(draw: Draw) -> Hidden:
    """To links and payload."""
    return yielding(draw, "joint_compliance", 3e-6, 30e-6)


def payload_compliance(draw: Draw) -> Hidden:
    """To the payload alone."""
    return yielding(draw, "payload_compliance", 6e-6, 60e-6)


def harmonic(
    draw: Draw, order: int, low: float, high: float, neighbours: tuple[int, ...]
) -> Hidden:
    """A periodic error of a gear; in the other form with a quarter of a neighbouring order."""
    joint, size = draw.joint(), draw.size(low, high)
    phase = draw.rng.uniform(0, 2 * np.pi)
    neighbour = neighbours[0] if len(neighbours) == 1 else int(draw.rng.choice(neighbours))
    other_phase = draw.rng.uniform(0, 2 * np.pi)

    def angle(at: Campaign) -> np.ndarray:
        q = at.q[:, joint - 1]
        beside = 0.25 * draw.other * np.cos(neighbour * q - other_phase)
        return size * (np.cos(order * q - phase) + beside)

    return Hidden("gear_harmonic", turning(joint, angle), joint, float(order))


def gear_once(draw: Draw) -> Hidden:
    """Once a turn of the joint."""
    return harmonic(draw, 1, 0.1e-3, 1e-3, (2,))


def gear_twice(draw: Draw) -> Hidden:
    """Twice."""
    return harmonic(draw, 2, 0.05e-3, 0.5e-3, (1, 3))


def strain_wave(draw: Draw) -> Hidden:
    """Twice a turn of a strain wave gear's input."""
    ratio = STRAIN_WAVE_RATIO
    return harmonic(draw, 2 * ratio, 0.05e-3, 0.3e-3, (ratio, 4 * ratio))


def encoder_gain(draw: Draw) -> Hidden:
    """An angle reads too large by a share."""
    joint = draw.joint()
    size = draw.size(0.5e-4, 5e-4) * draw.sign()
    return Hidden("encoder_gain", turning(joint, lambda at: size * at.q[:, joint - 1]), joint)


def joint_coupling(draw: Draw) -> Hidden:
    """Another joint drives this one too."""
    joint, driver = COUPLED[draw.rng.integers(len(COUPLED))]
    size = draw.size(0.2e-3, 2e-3) * draw.sign()
    act = turning(joint, lambda at: size * at.q[:, driver - 1])
    return Hidden("joint_coupling", act, joint, driven_by=driver)


def backlash(draw: Draw) -> Hidden:
    """Lost motion by the side of approach; in the other form it scatters, more from above."""
    joint, size = draw.joint(), draw.size(0.05e-3, 0.5e-3)
    scatter = draw.rng.normal(size=draw.campaign.n)

    def angle(at: Campaign) -> np.ndarray:
        side = at.approach[:, joint - 1].astype(float)
        return -0.5 * size * side * (1 + draw.other * np.where(side < 0, 0.4, 0.15) * scatter)

    return Hidden("backlash", turning(joint, angle), joint)


def load_backlash(draw: Draw) -> Hidden:
    """Lost motion by the side of the load; in the other form it changes sides smoothly."""
    joint, size = draw.joint((2, 3)), draw.size(0.1e-3, 0.6e-3)

    def angle(at: Campaign) -> np.ndarray:
        tau = at.torque[:, joint - 1]
        width = 0.25 * np.sqrt(np.mean(tau**2))
        return 0.5 * size * (np.tanh(tau / width) if draw.other else np.sign(tau))

    return Hidden("load_backlash", turning(joint, angle), joint)


def settling(draw: Draw) -> Hidden:
    """A joint has not quite arrived: it lacks a share of its last move."""
    joint, size = draw.joint(tuple(range(1, N))), draw.size(0.2e-4, 3e-4)
    # Before its first row the arm stood still.
    began = np.arange(draw.campaign.n) > 0
    return Hidden(
        "settling", turning(joint, lambda at: -size * began * at.move[:, joint - 1]), joint
    )
