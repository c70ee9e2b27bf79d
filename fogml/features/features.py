"""Features of a run's temperatures and other columns, as a scikit-learn style transformer over runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.features.atoms import Atom, AtomValues, Memories, evaluate
from fogml.features.blocks import evaluate_measured, heeded_rows, unmeasured_rows
from fogml.features.box import Box, reaching_box
from fogml.features.grammar import parse_terms
from fogml.features.signal import check_holds
from fogml.features.slices import SavedSlices, Slices
from fogml.features.terms import Term, atom_columns, atom_matrix, compose, composition_plan, unique_terms
from fogml.features.transformer import Transformer
from fogml.runs.dropouts import RULE, DropoutRule
from fogml.runs.exchange import one_run, runs_of
from fogml.runs.run import Run
from fogml.runs.thermometers import SavedLimits, rule_of

if TYPE_CHECKING:
    from fogml.features.blocks import FeatureBlocks
    from fogml.features.stream import FeatureStream


class Features(Transformer):
    """An ordered tuple of feature terms, each a product of powers of atoms.

    ``Features("T, dT, T*dT")`` builds them from feature text; ``a + b`` puts two beside each other
    (repeats dropped), ``a * b`` makes all products of a term of one and a term of the other.
    Every feature is causal. Two are equal where their terms are, in the same order, whatever box
    they have learned. ``thermometer`` is what thermometers can show: readings beyond are none.

    Parameters
    ----------
    text
        Feature text; the grammar is in `fogml.features.grammar`.

    Raises
    ------
    InputError
        If the text is not understood; the message points at the place.
    """

    def __init__(self, text: str) -> None:
        self.text = text

    @classmethod
    def from_terms(cls, terms: Iterable[Term]) -> Self:
        """Features from terms, repeats dropped."""
        return cls(", ".join(term.text for term in unique_terms(terms)))

    @property
    def text(self) -> str:
        """Canonical feature text: equal features have equal texts, and it parses to the same features."""
        return self._text

    @text.setter
    def text(self, text: str) -> None:
        if not isinstance(text, str):
            raise InputError(
                f"features: a text such as 'T, dT, T*dT' was expected, not {type(text).__name__}"
            )
        self._terms = parse_terms(text)
        canonical = ", ".join(term.text for term in self._terms)
        # scikit-learn's clone asks for the very object that it passed in.
        self._text = text if text == canonical else canonical
        self._atoms = tuple(dict.fromkeys(atom for term in self._terms for atom in term.atoms))
        self._plan = composition_plan(self._terms, self._atoms)
        self._box: Box | None = None
        self._slices: Slices | None = None
        self.thermometer: DropoutRule = RULE

    def __repr__(self) -> str:
        return f"Features({self.text!r})"

    def __len__(self) -> int:
        return len(self._terms)

    def __eq__(self, other: object) -> bool:
        return self._terms == other._terms if isinstance(other, Features) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._terms)

    def __add__(self, other: Features) -> Features:
        if not isinstance(other, Features):
            return NotImplemented
        return Features.from_terms(self.terms + other.terms)

    def __mul__(self, other: Features) -> Features:
        if not isinstance(other, Features):
            return NotImplemented
        return Features.from_terms(mine * theirs for mine in self.terms for theirs in other.terms)

    def names(self) -> list[str]:
        """Names of the k columns, each the text form of its term."""
        return [term.text for term in self._terms]

    @property
    def terms(self) -> tuple[Term, ...]:
        """The k terms, in order."""
        return self._terms

    @property
    def atoms(self) -> tuple[Atom, ...]:
        """The a atoms that the terms are made of, in order of first use."""
        return self._atoms

    @property
    def sensors(self) -> tuple[str, ...]:
        """Temperatures and other columns needed, by their names in formulas."""
        return tuple(dict.fromkeys(name for atom in self._atoms for name in atom.signal.sensors))

    @property
    def window_s(self) -> float:
        """Longest look-back until every window is full [s]; 0 where no atom has a window."""
        return max((atom.window.span_s for atom in self._atoms if atom.window is not None), default=0.0)

    @property
    def memory_s(self) -> float:
        """History [s] beyond which samples no longer change a window's value at float64.

        Memory operators carry a state instead (`atom_values`).
        """
        return max((atom.window.memory_s for atom in self._atoms if atom.window is not None), default=0.0)

    def fit(self, runs: Run | Sequence[Run], y: object = None) -> Self:
        """Learn the box: each atom's lowest and highest value over the runs' rows whose windows count.

        Parameters
        ----------
        runs
            Training runs.
        y
            Not used; there for scikit-learn's pipelines.

        Raises
        ------
        InputError
            If a run lacks a temperature, or no row has a full window.
        """
        return self.learn([self.atom_values(run)[:2] for run in runs_of(runs)])

    def learn(self, parts: Sequence[tuple[FloatArray, BoolArray]]) -> Self:
        """As `fit`, from the runs' atom values (n, a) and where they are full (n,)."""
        self._box, self._slices = Box.around(parts), Slices.learn(self._atoms, parts)
        return self

    @property
    def fitted(self) -> bool:
        """Whether a box was learned or taken over."""
        return self._box is not None

    @property
    def box(self) -> Mapping[str, tuple[float, float]]:
        """The learned box: text of each atom to its (low, high), in the atom's unit.

        Raises
        ------
        InputError
            If nothing was learned yet.
        """
        box = self._learned_box()
        pairs = zip(self._atoms, box.low.tolist(), box.high.tolist())
        return MappingProxyType({atom.text: (low, high) for atom, low, high in pairs})

    @property
    def slices(self) -> Slices | None:
        """Trained ranges at each temperature, learned with the box; None where nothing depends on it."""
        return self._slices

    def set_box(
        self,
        box: Mapping[str, tuple[float, float]],
        slices: SavedSlices | None = None,
        thermometer: SavedLimits | None = None,
    ) -> Self:
        """Take over a box as `box` gives it, slices and limits of thermometers, as of a saved model.

        Raises
        ------
        InputError
            If an atom's bounds are missing.
        """
        missing = [atom.text for atom in self._atoms if atom.text not in box]
        if missing:
            raise InputError(f"trained box: no bounds of {', '.join(missing)}")
        low, high = zip(*(box[atom.text] for atom in self._atoms))
        self._box = Box(np.array(low), np.array(high))
        self._slices = None if slices is None else Slices.from_saved(slices, self._atoms)
        self.thermometer = self.thermometer if thermometer is None else rule_of(thermometer)
        return self

    def _learned_box(self) -> Box:
        if self._box is None:
            raise InputError("features: no box was learned yet; fit them to training runs first")
        return self._box

    def atom_values(
        self, run: Run, sample_s: float | None = None, *, memories: Memories | None = None, skip: int = 0
    ) -> AtomValues:
        """Values of the atoms, and where they mean something.

        Parameters
        ----------
        run
            A run with the columns in `sensors`.
        sample_s
            Nominal sample interval [s]; the run's median interval if None.
        memories
            What memory operators hold from the samples before, and are left with for those after; they
            begin afresh if None.
        skip
            The first rows of the run that `memories` have seen already.

        Raises
        ------
        InputError
            If a column is missing, or a window or time constant is shorter than the sample interval.
        """
        check_holds(run, self.sensors, self._text)
        run = run.read_by(self.thermometer)
        values = np.empty((len(run), len(self._atoms)), order="F")
        return AtomValues(values, *evaluate_measured(self._atoms, run, sample_s, values, memories, skip))

    def compose(self, atom_values: ArrayLike) -> FloatArray:
        """The k feature columns, shape (n, k), from atom values of shape (n, a)."""
        values = atom_matrix(atom_values, len(self._atoms))
        columns = np.empty((len(values), len(self)), order="F")
        compose(self._plan, list(values.T), list(columns.T))
        return columns

    def limit(
        self, atom_values: ArrayLike, full: ArrayLike | None = None, *, linear: bool = False
    ) -> tuple[FloatArray, BoolArray]:
        """Limit atom values smoothly to the learned box.

        Inside the box they stay as they are; beyond it they level off, with a continuous first
        derivative, before 5 % of the span, so that models fall back smoothly. For a model that is
        linear, rates and gradients are followed further: see `fogml.features.box`.

        Parameters
        ----------
        atom_values
            Shape (n, a).
        full
            Where the windows are full, as `atom_values` tells, shape (n,); None takes all as full.
            Elsewhere windowed atoms that are 0 stay so and don't count as outside.
        linear
            Whether the model goes on linearly beyond its training rows.

        Returns
        -------
        limited : (n, a) array
            `atom_values` itself where nothing exceeds the box.
        outside : (n,) bool array
            Rows with an atom more than 1 % of its span beyond the box, or jointly outside (`Slices`).
        """
        in_full = None if full is None else np.asarray(full, dtype=np.bool_)
        values, box = atom_matrix(atom_values, len(self._atoms)), self._learned_box()
        heeded = heeded_rows(self._atoms, values, in_full)
        limited, outside = box.limit(values, heeded)
        if self._slices is not None and len(values):
            outside |= self._slices.outside(values) & (True if in_full is None else in_full)
        if linear and limited is not values:
            limited, _ = reaching_box(box, self._terms, self._atoms).limit(values, heeded)
        return limited, outside

    def transform(self, run: Run, *, limited: bool = False, linear: bool = False) -> Any:
        """Feature columns of a run, shape (n, k); a frame of them where `set_output` asks for one.

        Parameters
        ----------
        run
            A run with the columns in `sensors`.
        limited
            Whether atoms are limited to the learned box first.
        linear
            If so, as for a model that goes on linearly.
        """
        check_holds(one_run(run), self.sensors, self._text)
        run = run.read_by(self.thermometer)
        if limited or unmeasured_rows(self._atoms, run) is not None:
            values, full, _ = self.atom_values(run)
            held = self.limit(values, full, linear=linear)[0] if limited else values
            return self._contained(self.compose(held))
        columns = np.empty((len(run), len(self)), order="F")
        terms = list(columns.T)
        atoms = atom_columns(self._plan, terms, len(self._atoms))
        evaluate(self._atoms, run, None, atoms)
        compose(self._plan, atoms, terms)
        return self._contained(columns)

    def fit_transform(self, run: Run, y: object = None) -> Any:
        """`fit` to one run, then what `transform` makes of it."""
        return self.fit(one_run(run)).transform(run)

    def stream(
        self,
        sample_s: float,
        *,
        limited: bool = False,
        linear: bool = False,
        powered_on_s: float | None = None,
    ) -> FeatureStream:
        """The same features sample by sample, in bounded memory; parameters are those of `FeatureStream`."""
        from fogml.features.stream import FeatureStream

        return FeatureStream(self, sample_s, limited=limited, linear=linear, powered_on_s=powered_on_s)

    def blocks(self, sample_s: float) -> FeatureBlocks:
        """The same atom values block by block of a long run, in bounded memory.

        Parameters
        ----------
        sample_s
            Nominal sample interval [s].
        """
        from fogml.features.blocks import FeatureBlocks

        return FeatureBlocks(self, sample_s)
