"""fogml: temperature drift models for fibre-optic gyros.

The names below, and the packages, load on first use, so that ``import fogml`` stays quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fogml.errors import FogmlError, InputError
    from fogml.features.parse import parse_features
    from fogml.models.names import make_model
    from fogml.models.saved import load_model, save_model
    from fogml.runs.facts import Facts
    from fogml.runs.profiles import import_recording
    from fogml.runs.reading import read_run
    from fogml.runs.run import Run
    from fogml.runs.shipped import shipped_run
    from fogml.runs.writing import write_run
    from fogml.validation.judge import judge

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

_PACKAGES = (
    "blind", "export", "features", "fleet", "gap", "lab", "models", "report", "runs", "signals", "testing",
    "tuning", "twin", "validation",
)  # fmt: skip

__all__ = [
    "Facts",
    "FogmlError",
    "InputError",
    "Run",
    "__version__",
    "import_recording",
    "judge",
    "load_model",
    "make_model",
    "parse_features",
    "read_run",
    "save_model",
    "shipped_run",
    "write_run",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if name in _PACKAGES:
        return import_module(f"fogml.{name}")
    raise AttributeError(f"module 'fogml' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *_PACKAGES])
