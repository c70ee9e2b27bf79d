"""The contract tests that anyone's addition runs, to features, to models or to effects.

The names load on first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fogml.testing.effects import check_effect as check_effect
    from fogml.testing.features import check_feature as check_feature
    from fogml.testing.models import check_model as check_model

_HOMES = {
    "check_effect": "fogml.testing.effects",
    "check_feature": "fogml.testing.features",
    "check_model": "fogml.testing.models",
}

__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'fogml.testing' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
