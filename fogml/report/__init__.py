"""Figures, self-contained HTML pages, certificates and spreadsheets.

Each name below loads its module on first use, so that one part of a page doesn't load all pages.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fogml.report.blind_page import blind_page as blind_page
    from fogml.report.certificate import certificate as certificate
    from fogml.report.compare_page import compare_page as compare_page
    from fogml.report.gap_page import gap_page as gap_page
    from fogml.report.index_page import index_page as index_page
    from fogml.report.inspect_page import inspect_page as inspect_page
    from fogml.report.misalignment_page import misalignment_page as misalignment_page
    from fogml.report.noise_page import noise_page as noise_page
    from fogml.report.north_page import north_page as north_page
    from fogml.report.spreadsheet import spreadsheet as spreadsheet
    from fogml.report.train_page import train_page as train_page

__all__ = [
    "blind_page",
    "certificate",
    "compare_page",
    "gap_page",
    "index_page",
    "inspect_page",
    "misalignment_page",
    "noise_page",
    "north_page",
    "spreadsheet",
    "train_page",
]


class _Pages(ModuleType):
    """This package: a name of `__all__` is the function of the module of that name, loaded or not."""

    def __setattr__(self, name: str, value: Any) -> None:
        # An import puts the module it loaded into the package, where the function's name is.
        if not (name in __all__ and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


def __getattr__(name: str) -> Any:
    if name in __all__:
        return getattr(import_module(f"{__name__}.{name}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


sys.modules[__name__].__class__ = _Pages
