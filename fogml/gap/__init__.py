"""The diagnosis of the gap between the twin and a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fogml.gap.diagnosis import diagnose

__all__ = ["diagnose"]


def __getattr__(name: str) -> Any:
    # What only reads how sure a diagnosis is need not load the twin.
    if name == "diagnose":
        from fogml.gap.diagnosis import diagnose

        return diagnose
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
