"""What document 002 prints: tables 1 to 3, pose numbers, tool uncertainties.

References
----------
.. [1] X. Wen et al., Chinese Journal of Scientific Instrument, 2022 (Staubli TX60, Leica AT960).
"""

from dataclasses import dataclass

POSE_NUMBER = {"O1": 61, "O2": 29}
"""Where the curves of figures 3 and 4 settle; those of O3, O4 and O5 do not"""
DISTANCE_BEFORE = 0.459
"""Mean distance at the test points before calibration, table 2 [mm]"""
RATIO = 0.11
"""Mean of u_best over u_rand in table 3"""


@dataclass(frozen=True)
class PaperErrors:
    """Mean absolute position error of one kind of set [mm]: tables 1 and 2."""

    fit_before: float
    fit_after: float
    test_before: float
    test_after: float


ERRORS = {
    ("best", 61): PaperErrors(0.545, 0.086, 0.459, 0.097),
    ("random", 61): PaperErrors(0.593, 0.069, 0.459, 0.127),
    ("best", 29): PaperErrors(0.377, 0.057, 0.459, 0.098),
    ("random", 29): PaperErrors(0.587, 0.064, 0.459, 0.132),
}

U_ZERO = (0.0034, 0.031)
"""Of the end's distance from the base at joints zero, best and random sets [mm]"""
U_TEST = (0.0069, 0.0649)
"""Mean of the same over 50 test points [mm]"""

TABLE_3: dict[str, tuple[float, float, float, float, float, float]] = {
    "theta_1": (0.0004, 0.0014, 0.0010, 0.0032, 0.0004, 0.0036),
    "theta_2": (0.0001, 0.0001, 0.0005, 0.0007, 0.0001, 0.0009),
    "theta_3": (0.0015, 0.0069, 0.0058, 0.0098, 0.0015, 0.0133),
    "theta_4": (0.0009, 0.0009, 0.0021, 0.0043, 0.0009, 0.0049),
    "theta_5": (0.0002, 0.0019, 0.0026, 0.0059, 0.0002, 0.0067),
    "theta_6": (0.0005, 0.0031, 0.0049, 0.0050, 0.0005, 0.0077),
    "d_1": (0.0027, 0.0117, 0.0140, 0.0123, 0.0027, 0.0220),
    "d_3": (0.0050, 0.0223, 0.0425, 0.0304, 0.0050, 0.0568),
    "d_4": (0.0009, 0.0055, 0.0091, 0.0111, 0.0009, 0.0154),
    "d_5": (0.0004, 0.0022, 0.0042, 0.0073, 0.0004, 0.0087),
    "d_6": (0.0005, 0.0019, 0.0066, 0.0039, 0.0005, 0.0079),
    "a_1": (0.0007, 0.0027, 0.0033, 0.0079, 0.0007, 0.0090),
    "a_2": (0.0006, 0.0030, 0.0099, 0.0095, 0.0006, 0.0140),
    "a_3": (0.0078, 0.0350, 0.0315, 0.0543, 0.0078, 0.0719),
    "a_4": (0.0003, 0.0011, 0.0024, 0.0045, 0.0003, 0.0052),
    "a_5": (0.0006, 0.0029, 0.0032, 0.0060, 0.0006, 0.0074),
    "a_6": (0.0018, 0.0062, 0.0119, 0.0065, 0.0018, 0.0149),
    "alpha_1": (0.0006, 0.0009, 0.0009, 0.0013, 0.0006, 0.0018),
    "alpha_2": (0.0004, 0.0004, 0.0006, 0.0008, 0.0004, 0.0011),
    "alpha_3": (0.0010, 0.0024, 0.0096, 0.0053, 0.0010, 0.0112),
    "alpha_4": (0.0015, 0.0050, 0.0057, 0.0079, 0.0015, 0.0109),
    "alpha_5": (0.0007, 0.0014, 0.0039, 0.0057, 0.0007, 0.0070),
    "alpha_6": (0.0009, 0.0026, 0.0078, 0.0033, 0.0009, 0.0089),
    "beta_2": (0.0003, 0.0008, 0.0010, 0.0021, 0.0003, 0.0036),
}
"""u_r best, u_r, u_p, u_w random, u best, u random of every parameter, table 3 [deg, mm]"""
