"""fogml: temperature drift models for fibre-optic gyros.

The names below, and the packages, load on first use, so that ``import fogml`` stays quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fogml import benchmark as benchmark
    from fogml import blind as blind
    from fogml import export as export
    from fogml import features as features
    from fogml import fleet as fleet
    from fogml import gap as gap
    from fogml import lab as lab
    from fogml import models as models
    from fogml import monitor as monitor
    from fogml import readers as readers
    from fogml import report as report
    from fogml import runs as runs
    from fogml import signals as signals
    from fogml import testing as testing
    from fogml import tuning as tuning
    from fogml import twin as twin
    from fogml import validation as validation
    from fogml.errors import FogmlError as FogmlError
    from fogml.errors import InputError as InputError
    from fogml.features.parse import parse_features as parse_features
    from fogml.models.names import make_model as make_model
    from fogml.models.saved import load_model as load_model
    from fogml.models.saved import save_model as save_model
    from fogml.runs.facts import Facts as Facts
    from fogml.runs.profiles import import_recording as import_recording
    from fogml.runs.reading import read_run as read_run
    from fogml.runs.run import Run as Run
    from fogml.runs.shipped import shipped_run as shipped_run
    from fogml.runs.writing import write_run as write_run
    from fogml.validation.judge import judge as judge

__version__ = "0.2.0"

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
    "benchmark", "blind", "export", "features", "fleet", "gap", "lab", "models", "monitor", "readers",
    "report", "runs", "signals", "testing", "tuning", "twin", "validation",
)  # fmt: skip

__all__ = ["__version__", *_HOMES]


if not TYPE_CHECKING:  # so that a checker finds names that are none

    def __getattr__(name: str) -> Any:
        if name in _HOMES:
            return getattr(import_module(_HOMES[name]), name)
        if name in _PACKAGES:
            return import_module(f"fogml.{name}")
        raise AttributeError(f"module 'fogml' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *_PACKAGES])
