"""The diagnosis: where the gap lies, which causes make it, how far it closes."""

from __future__ import annotations

from fogml.gap.families.answer import diagnose

__all__ = ["diagnose"]
