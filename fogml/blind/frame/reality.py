"""A reality: the forms that effects take in it, and units that show them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fogml.blind.frame.form import Form
from fogml.blind.frame.unit import Unit


class DrawUnit(Protocol):
    """Draws a unit with its runs."""

    def __call__(
        self, rng: np.random.Generator, forms: Sequence[type[Form]], runs: int, static: bool, sample_s: float
    ) -> Unit:
        """A unit whose programmes and instruments show the forms; `runs` to fit on, one held out."""


@dataclass(frozen=True)
class Reality:
    """One reality.

    Attributes
    ----------
    name
        As it is chosen by.
    known
        Forms of effects that the catalogue holds; an effect may have several.
    invented
        Effects that no library holds.
    wrong_structure
        Another thermal order than any twin's.
    draw_unit
        Its units.
    """

    name: str
    known: tuple[type[Form], ...]
    invented: tuple[type[Form], ...]
    wrong_structure: type[Form]
    draw_unit: DrawUnit

    @property
    def known_names(self) -> tuple[str, ...]:
        """Ids of the catalogue's effects that have a form here, in order."""
        return tuple(dict.fromkeys(form.name for form in self.known))

    @property
    def invented_names(self) -> tuple[str, ...]:
        """Names of what no library holds, in order."""
        return tuple(dict.fromkeys(form.name for form in self.invented))

    def forms_of(self, name: str) -> tuple[type[Form], ...]:
        """Forms of one effect, known or not."""
        everything = (*self.known, *self.invented, self.wrong_structure)
        return tuple(form for form in everything if form.name == name)
