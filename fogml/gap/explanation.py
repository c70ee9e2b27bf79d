"""An explanation of the runs: a set of effects, and what acts beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Rest = Literal["nothing", "form", "unknown"]
"""What acts beside a set of effects."""


@dataclass(frozen=True)
class Chosen:
    """An effect in a set.

    Attributes
    ----------
    candidate
        Id.
    node
        Its best node.
    length
        The best standard deviation of its columns' coefficients.
    size
        Whitened length of its most probable response; columns that cancel each other need coefficients far
        above it.
    """

    candidate: str
    node: int
    length: float
    size: float


@dataclass(frozen=True)
class Explanation:
    """A set of effects, and what acts beside it.

    Attributes
    ----------
    effects
        The effects at their best shapes.
    rest
        What acts besides.
    group
        The best group of columns for the rest, and its length; None where nothing acts.
    log_evidence
        Over that of no effect and no unknown, shapes and sizes averaged.
    log_posterior
        With the prior of the set, not normalised.
    exact
        Whether the effects explain the runs better without room for another form.
    """

    effects: tuple[Chosen, ...]
    rest: Rest
    group: tuple[str, float] | None
    log_evidence: float
    log_posterior: float
    exact: bool = False

    @property
    def ids(self) -> frozenset[str]:
        """Ids of the effects."""
        return frozenset(c.candidate for c in self.effects)

    @property
    def unknown(self) -> tuple[str, float] | None:
        """The unknown's group and length; None where it does not act."""
        return self.group if self.rest == "unknown" else None
