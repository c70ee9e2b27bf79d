"""Numbers as text."""

from __future__ import annotations


def number_text(value: float) -> str:
    """Shortest text that reads back as the same number, without a trailing ``.0``."""
    return repr(float(value)).removesuffix(".0")


def short(value: float | None, digits: int = 3) -> str:
    """A number to so many significant digits, a dash where there is none.

    Powers of ten only under 1e-4 and from 1e7 on.

    Examples
    --------
    >>> short(1234.5), short(0.25), short(2e-5)
    ('1230', '0.25', '2e-05')
    """
    if value is None:
        return "–"
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text and 1.0 <= abs(value) < 1e7 else text
