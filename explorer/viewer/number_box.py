"""Number boxes that take decimals.

viser lets a box hold as many decimals as the numbers that it is made with. One that is made with whole numbers drops
the decimal point as it is typed: 25.5 would be read as 255.
"""

from __future__ import annotations

from typing import Any

DECIMALS = 4
"""At least so many can be typed."""


def with_decimals(box: Any) -> Any:
    """``box``, viser's handle of a number or of several, which from now on takes ``DECIMALS``."""
    box.precision = max(box.precision, DECIMALS)
    return box
