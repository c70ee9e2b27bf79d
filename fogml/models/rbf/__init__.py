"""RBF networks of drift: tuned centres and widths, exact output weights, a linear part beside them.

The names below load on first use: counting rates needs neither scikit-learn nor torch.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOMES = {
    "RBFRegressor": "fogml.models.rbf.regressor",
    "PatentRBFRegressor": "fogml.models.rbf.patent",
    "distinct_rates": "fogml.models.rbf.rates",
    "restrained_inputs": "fogml.models.rbf.rates",
}

__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'fogml.models.rbf' has no attribute {name!r}")
