"""Numbers as a person reads them: decimals that mean something, a minus sign that is one."""

import math
from collections.abc import Iterable, Sequence
from statistics import median

MINUS = "\N{MINUS SIGN}"
_EMPTY_DIGIT, _EMPTY_POINT = "\N{FIGURE SPACE}", "\N{PUNCTUATION SPACE}"
_MOST_DECIMALS = 6


def fixed(value: float, decimals: int) -> str:
    """Write a number with so many decimals.

    >>> fixed(-0.00004, 3), fixed(-1.25, 1)
    ('0.000', '−1.2')
    """
    text = f"{value:.{decimals}f}"
    if text.startswith("-"):
        text = text[1:] if float(text) == 0.0 else MINUS + text[1:]
    return text


def signed(value: float, decimals: int) -> str:
    """Write a difference, always with its sign.

    >>> signed(0.25, 2), signed(-0.25, 2), signed(0.0, 2)
    ('+0.25', '−0.25', '0.00')
    """
    text = fixed(value, decimals)
    return text if text[0] == MINUS or float(text) == 0.0 else f"+{text}"


def nominal(value: float) -> str:
    """Write a number as a maker states it, without the zeros behind.

    >>> nominal(-612.7), nominal(90.0)
    ('−612.7', '90')
    """
    return f"{value:.10g}".replace("-", MINUS)


def decimals_for(uncertainties: Iterable[float]) -> int:
    """Choose decimals that show two digits of the middle uncertainty (GUM, 7.2.6).

    One number for a whole column, so that its points stand below each other.

    >>> decimals_for([0.012, 0.0004, 0.02]), decimals_for([])
    (3, 3)
    """
    known = [value for value in uncertainties if value > 0.0]
    if not known:
        return 3
    return min(max(1 - math.floor(math.log10(median(known))), 1), _MOST_DECIMALS)


def aligned(column: Sequence[str]) -> list[str]:
    """Fill numbers with spaces behind, so that flush right their points stand below each other.

    >>> [len(text) for text in aligned(["90", "-0.25", ""])]
    [5, 5, 0]
    """
    most = max((len(_fraction(text)) for text in column), default=0)
    return [_filled(text, most) if text else "" for text in column]


def _fraction(text: str) -> str:
    return text.partition(".")[2]


def _filled(text: str, most: int) -> str:
    point = "" if "." in text or not most else _EMPTY_POINT
    return text + point + _EMPTY_DIGIT * (most - len(_fraction(text)))
