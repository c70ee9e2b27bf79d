"""fogml: temperature drift models for fibre-optic gyros.

The names below load on first use, so that ``import fogml`` stays quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_HOMES = {
    "Run": "fogml.runs.run",
    "Facts": "fogml.runs.facts",
    "read_run": "fogml.runs.reading",
    "write_run": "fogml.runs.writing",
    "import_recording": "fogml.runs.profiles",
    "shipped_run": "fogml.runs.shipped",
    "parse_features": "fogml.features.parse",
    "make_model": "fogml.models.names",
    "load_model": "fogml.models.saved",
    "save_model": "fogml.models.saved",
    "judge": "fogml.validation.judge",
    "FogmlError": "fogml.errors",
    "InputError": "fogml.errors",
}

__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'fogml' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
