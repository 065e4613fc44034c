"""From the controller's status bits to a safety state and what a person should do about it.

Bits of ``safety_status_bits`` and ``robot_status_bits`` and the numbers of ``robot_mode``:
Universal Robots, RTDE Guide, tables of output fields.
"""

from drivers.interfaces import MAY_MOVE, Safety

ROBOT_MODE_RUNNING = 7
POWER_ON = 1 << 0

SAFETY_BITS = (
    (1 << 5 | 1 << 6 | 1 << 7, Safety.emergency_stop),
    (1 << 8 | 1 << 9, Safety.fault),
    (1 << 2, Safety.protective_stop),
    (1 << 4, Safety.safeguard_stop),
    (1 << 3, Safety.not_ready),
    (1 << 1, Safety.reduced),
    (1 << 0, Safety.normal),
)
"""Most serious first: several bits are set at once."""

ADVICE = {
    Safety.protective_stop: "find what it touched or why it was overloaded, clear the way, then "
    "unlock the protective stop on the pendant",
    Safety.emergency_stop: "make the cell safe, release the emergency stop, then switch the arm "
    "on again on the pendant",
    Safety.safeguard_stop: "leave the safeguarded area and reset the safeguard",
    Safety.fault: "read the fault on the pendant and restart the safety system",
    Safety.not_ready: "switch the arm on and release its brakes on the pendant",
}


def safety_state(safety_bits: int, robot_bits: int, robot_mode: int) -> Safety:
    """Return the state that decides whether a motion may start.

    An arm without power or with closed brakes is `not_ready`, whatever its safety system says.
    """
    state = next((state for bits, state in SAFETY_BITS if safety_bits & bits), Safety.not_ready)
    standing_by = not robot_bits & POWER_ON or robot_mode != ROBOT_MODE_RUNNING
    if state in MAY_MOVE and standing_by:
        return Safety.not_ready
    return state


def advice(state: Safety) -> str:
    """Return what a person should do before a motion, empty where nothing hinders it."""
    return ADVICE.get(state, "")
