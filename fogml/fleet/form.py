"""In which features the constants of units are compared."""

from __future__ import annotations

FORM = "T^1..3, dT, T*dT"
"""The form that units are compared in, unless another is stated."""
