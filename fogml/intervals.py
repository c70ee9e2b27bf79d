"""What intervals hold, and how many standard deviations off its middle a normal value lies how often."""

from __future__ import annotations

from fogml.errors import InputError

LEVEL = 0.9
"""Share that an interval holds where nothing else is said."""
TAILS = (0.05, 0.95)
"""Shares below the two ends of such an interval."""

Z50 = 0.6744897501960817
"""Half-width of the central interval that holds 50 %: the median of sizes."""
Z90 = 1.6448536269514722
"""Half-width that holds 90 %."""
Z95 = 1.959963984540054
"""Half-width that holds 95 %."""
MEDIAN_SIZE, SIGMA_PER_MEDIAN = 0.6745, 1.4826
"""`Z50` and its inverse as robust statistics round them, where four digits tell all that is asked."""


def check_level(level: float, what: str) -> None:
    """Refuse a level of an interval or a test that is no share between 0 and 1."""
    if not 0.0 < level < 1.0:
        raise InputError(f"{what}: a level of {level}; it must lie between 0 and 1")
