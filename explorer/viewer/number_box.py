"""Number boxes that take decimals.

viser lets a box hold as many decimals as the numbers with which it is created. A box created with whole numbers drops
the decimal point as it is typed: 25.5 would be read as 255.
"""

from __future__ import annotations

from typing import Any

DECIMALS = 4
"""Number of decimals that can be typed, at least."""


def with_decimals(box: Any) -> Any:
    """``box``, viser's handle of one or several numbers, which from now on takes ``DECIMALS``."""
    box.precision = max(box.precision, DECIMALS)
    return box
