"""How a UR controller words the safety and power state of its arm.

Bit numbers of ``safety_status_bits`` and ``robot_status_bits`` and the enumerations of
``safety_mode`` and ``robot_mode``: Universal Robots, RTDE Guide, tables of output fields.
"""

from dataclasses import dataclass

STOPPED_DUE_TO_SAFETY = 1 << 10

POWER_ON = 1 << 0
PROGRAM_RUNNING = 1 << 1

MODE_POWER_OFF, MODE_IDLE, MODE_RUNNING = 3, 5, 7
MODE_WORDS = {MODE_POWER_OFF: "POWER_OFF", MODE_IDLE: "IDLE", MODE_RUNNING: "RUNNING"}


@dataclass(frozen=True)
class SafetyWords:
    """One safety state in the three ways in which the controller says it."""

    bits: int
    """``safety_status_bits``"""
    mode: int
    """``safety_mode``"""
    dashboard: str
    """Answer to ``safetystatus``"""


SAFETY = {
    "normal": SafetyWords(1 << 0, 1, "NORMAL"),
    "reduced": SafetyWords(1 << 1, 2, "REDUCED"),
    "protective_stop": SafetyWords(1 << 2 | STOPPED_DUE_TO_SAFETY, 3, "PROTECTIVE_STOP"),
    "safeguard_stop": SafetyWords(1 << 4 | STOPPED_DUE_TO_SAFETY, 5, "SAFEGUARD_STOP"),
    "emergency_stop": SafetyWords(
        1 << 6 | 1 << 7 | STOPPED_DUE_TO_SAFETY, 7, "ROBOT_EMERGENCY_STOP"
    ),
    "fault": SafetyWords(1 << 9 | STOPPED_DUE_TO_SAFETY, 9, "FAULT"),
    "not_ready": SafetyWords(1 << 0, 1, "NORMAL"),
}
"""Keys: the safety words of the world."""
