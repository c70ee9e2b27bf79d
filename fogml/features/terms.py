"""Terms: products of powers of atoms, and the plan by which columns are made of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.atoms import Atom


@dataclass(frozen=True)
class Term:
    """A product of powers of atoms, such as ``T^2*dT``.

    Equal products are equal objects, in whatever order they were written.

    Attributes
    ----------
    factors
        Pairs of an atom and its power, 1 or more; values first, then differences, rates, directions.
    """

    factors: tuple[tuple[Atom, int], ...]

    def __post_init__(self) -> None:
        powers: dict[Atom, int] = {}
        for atom, power in self.factors:
            if int(power) != power or power < 1:
                raise InputError(
                    f"term: {atom.text} to the power {power}; a whole number from 1 was expected"
                )
            powers[atom] = powers.get(atom, 0) + int(power)
        if not powers:
            raise InputError("term: it has no factor")
        object.__setattr__(self, "factors", tuple(sorted(powers.items(), key=lambda pair: pair[0].order)))

    @property
    def text(self) -> str:
        """Text form, e.g. ``(T_in-T_out)^2*dT``."""
        if len(self.factors) == 1 and self.factors[0][1] == 1:
            return self.factors[0][0].text
        return "*".join(
            atom.factor_text if power == 1 else f"{atom.factor_text}^{power}" for atom, power in self.factors
        )

    @property
    def atoms(self) -> tuple[Atom, ...]:
        """Its atoms, each once."""
        return tuple(atom for atom, _ in self.factors)

    def __mul__(self, other: Term) -> Term:
        return Term(self.factors + other.factors)

    def without(self, atom: Atom) -> tuple[tuple[Atom, int], ...]:
        """The factors left when one power of `atom` is taken away."""
        return tuple(
            (held, power - (held == atom)) for held, power in self.factors if held != atom or power > 1
        )


@dataclass(frozen=True)
class Step:
    """How one column is made: from an earlier column or an atom, times atoms, in this order.

    Attributes
    ----------
    column
        Earlier column to start from, or None to start from the first of `atoms`.
    atoms
        Columns of the atom values to multiply by.
    """

    column: int | None
    atoms: tuple[int, ...]


def composition_plan(terms: Sequence[Term], atoms: Sequence[Atom]) -> tuple[Step, ...]:
    """Steps that make one column per term with as few products as earlier columns allow."""
    place = {atom: index for index, atom in enumerate(atoms)}
    made: dict[tuple[tuple[Atom, int], ...], int] = {}
    steps = []
    for column, term in enumerate(terms):
        earlier = ((made.get(term.without(atom)), place[atom]) for atom in reversed(term.atoms))
        found = next(((source, atom) for source, atom in earlier if source is not None), None)
        if found is not None:
            steps.append(Step(found[0], (found[1],)))
        else:
            steps.append(Step(None, tuple(place[atom] for atom, power in term.factors for _ in range(power))))
        made[term.factors] = column
    return tuple(steps)


def atom_matrix(values: ArrayLike, atoms: int) -> FloatArray:
    """Values of so many atoms as float64."""
    matrix = np.asarray(values, dtype=np.float64)
    if matrix.ndim != 2 or matrix.shape[1] != atoms:
        raise InputError(f"features: atom values of shape {matrix.shape}, (n, {atoms}) was expected")
    return matrix


def atom_columns(plan: Sequence[Step], columns: Sequence[FloatArray], atoms: int) -> list[FloatArray]:
    """Where to put the values of atoms: in the column of a term that is the atom alone, else apart."""
    places = {step.atoms: out for step, out in zip(plan, columns) if step.column is None}
    return [places[(atom,)] if (atom,) in places else np.empty_like(columns[0]) for atom in range(atoms)]


def compose(plan: Sequence[Step], atoms: Sequence[FloatArray], columns: Sequence[FloatArray]) -> None:
    """Fill term columns, arrays (n,), from atom values; an atom may stand in its own term's column."""
    for step, out in zip(plan, columns):
        if step.column is not None:
            np.multiply(columns[step.column], atoms[step.atoms[0]], out=out)
            continue
        first, *others = (atoms[place] for place in step.atoms)
        if others:
            np.multiply(first, others[0], out=out)
        elif first is not out:
            out[:] = first
        for other in others[1:]:
            out *= other


def unique_terms(terms: Iterable[Term]) -> tuple[Term, ...]:
    """The terms in order, each once."""
    return tuple(dict.fromkeys(terms))
