"""The runs of a diagnosis together, places where causes sit, lines that stand out, and what a family is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from fogml.arrays import FloatArray
from fogml.gap.rows import READ, Rows
from fogml.gap.settings import Grids
from fogml.runs.steps import recorded_step
from fogml.signals.bases import lag
from fogml.twin.effect import Effect
from fogml.twin.quantities import Grade
from fogml.twin.twin import Twin

PLACES = {0.5: "middle of the coil", 0.0: "inner face", 1.0: "outer face", -0.5: "hub"}
"""Places of the winding by the share of the outer face in their temperature."""


class Place(NamedTuple):
    """A temperature on the even rows [degC], how likely it is the one, and where it is."""

    temperature: FloatArray
    weight: float
    name: str


@dataclass(frozen=True, eq=False)
class Scene:
    """All runs of a diagnosis together: what grids and places have to be the same for.

    Attributes
    ----------
    runs
        Fit runs, then held-out ones.
    fitted
        How many are fit runs.
    grade
        Whose ranges hold.
    lines_hz
        Frequencies that stand out of the fit runs.
    candidates
        What may be named, by id.
    grids
        How closely families look.
    constants
        At which effects meet the output, by name.
    cache
        What several families ask for.
    """

    runs: tuple[Rows, ...]
    fitted: int
    grade: Grade
    lines_hz: tuple[float, ...] = ()
    candidates: Mapping[str, Effect] = field(default_factory=dict)
    grids: Grids = field(default_factory=Grids)
    constants: Mapping[str, float] = field(default_factory=dict)
    cache: dict[Any, Any] = field(default_factory=dict)

    @property
    def fit(self) -> tuple[Rows, ...]:
        """Fit runs."""
        return self.runs[: self.fitted]

    def records(self, name: str) -> list[bool]:
        """Whether each run records a temperature or a drive: a family has the same blocks on all of them."""
        return [name in r.readings or name in r.even.drives for r in self.runs]

    @cached_property
    def range_degc(self) -> tuple[float, float]:
        """Least and greatest T of the fit runs."""
        held = [r.temperature for r in self.fit]
        return min(float(t.min()) for t in held), max(float(t.max()) for t in held)

    @property
    def span_degc(self) -> float:
        """Width of that range, 1 at least."""
        low, high = self.range_degc
        return max(high - low, 1.0)

    @cached_property
    def span_s(self) -> float:
        """The longest fit run [s]."""
        return max(float(r.run.span_s) for r in self.fit)

    @cached_property
    def row_s(self) -> float:
        """The longest row [s]."""
        return max(r.row_s for r in self.fit)

    @cached_property
    def most_of_own(self) -> int:
        """How many half waves or steps a course in a run's own time has at most."""
        return max(int(max(map(len, self.fit)) / self.grids.rows_each), 2)

    @cached_property
    def begun_s(self) -> tuple[float, ...]:
        """When each run's clock began, after the first run's [s]; one after the other where unknown."""
        started = [r.run.facts.started for r in self.runs]
        if all(s is not None for s in started):
            # Differences of the moments themselves: a clock without a zone is not this machine's.
            first = min(started)  # type: ignore[type-var]
            return tuple((s - first).total_seconds() for s in started)  # type: ignore[operator]
        edges = np.cumsum([0.0, *(float(r.run.time[-1]) - r.since_s + r.row_s for r in self.runs)])
        return tuple(float(e) - r.since_s for e, r in zip(edges, self.runs))

    @property
    def in_time(self) -> list[int]:
        """Fit runs in the order in which they began."""
        return sorted(range(self.fitted), key=lambda i: self.begun_s[i])

    @cached_property
    def order_known(self) -> bool:
        """Whether the runs say when they began, so that what one leaves behind meets the next."""
        return len(self.runs) > 1 and all(r.run.facts.started is not None for r in self.runs)

    def before(self, rows: Rows) -> tuple[Rows, ...]:
        """Runs that came before one, in order; none where that is not known."""
        if not self.order_known:
            return ()
        own = self.begun_s[self.runs.index(rows)]
        earlier = [(b, i) for i, b in enumerate(self.begun_s) if b < own]
        return tuple(self.runs[i] for _, i in sorted(earlier))

    def coil(self, rows: Rows) -> list[Place]:
        """Places in the winding."""
        return self._bank(rows, tuple(m for m in self.grids.mixes if m >= 0.0), (0.0,))

    def optics(self, rows: Rows, mixes: Sequence[float] | None = None) -> list[Place]:
        """Places of optics and electronics: the recorded one first, then lags behind the coil's faces."""
        bank = self._bank(rows, tuple(self.grids.mixes if mixes is None else mixes), self.grids.place_lags_s)
        if "T_electronics" not in rows.readings:
            # As the model's own plant has it, self-heating included.
            return [Place(rows.even.temperature("T_electronics"), 1.0, "electronics"), *bank]
        recorded = rows.even.temperatures["T_electronics"]
        return [Place(recorded, float(len(bank)), "recorded electronics"), *bank]

    def _bank(self, rows: Rows, mixes: tuple[float, ...], lags_s: tuple[float, ...]) -> list[Place]:
        """Places of mixes and lags; those left out that drive as the first mix does, on all runs."""
        key = ("bank", id(rows), mixes, lags_s)
        if key not in self.cache:
            faces = [(r.even.temperature("T_in"), r.even.temperature("T_out")) for r in self.runs]
            apart = max(float(np.abs(outer - inner).max()) for inner, outer in faces)
            near = self.grids.same_degc
            inner, outer = rows.even.temperature("T_in"), rows.even.temperature("T_out")
            self.cache[key] = [
                Place(
                    lag(rows.even.time, (1.0 - m) * inner + m * outer, s),
                    1.0,
                    PLACES[m] + (f", {s:g} s late" if s else ""),
                )
                for i, m in enumerate(mixes)
                if i == 0 or not abs(m - mixes[0]) * apart < near
                for s in lags_s
            ]
        return list(self.cache[key])


class Block(NamedTuple):
    """One member of a family, its few shapes given: columns of independent coefficients.

    ``columns`` [deg/h per unit] have shape (m, k), ``shape`` says which member, ``weight`` how likely it is.
    Of a ``positive`` one physics gives the first column's sign.
    """

    columns: FloatArray
    shape: Mapping[str, Any] = {}
    weight: float = 1.0
    positive: bool = False


Build = Callable[[Rows, Scene], Iterator[Block]]
"""Blocks of one run, the same on every run of a scene."""


@dataclass(frozen=True)
class Family:
    """What a cause can do.

    Attributes
    ----------
    id
        The effect's; of an unknown cause what it looks like.
    kind
        ``known`` may be named, ``unknown`` and ``plant`` may not; what is ``left_out`` by the user
        takes no part, and is asked whether it looks like what is named.
    build
        Its blocks on a run.
    words
        What it looks like, of an unknown.
    drawn_per_run
        Whether each run draws its coefficients anew.
    largest
        Usual most of a coefficient, in its unit, where no card says it.
    """

    id: str
    kind: Literal["known", "unknown", "plant", "left_out"]
    build: Build
    words: str = ""
    drawn_per_run: bool = False
    largest: float = math.inf


def column_block(*columns: FloatArray, positive: bool = False, **shape: Any) -> Block:
    """A block of columns of shape (m,) each."""
    return Block(np.column_stack(columns), shape, positive=positive)


def steps_are_coarse(scene: Scene, twin: Twin) -> bool:
    """Whether a sensor of the fit runs reads in coarser steps than a good one, and than the twin's.

    Of those that the model is driven by: a chamber's set point goes in whole steps by itself.
    """
    usual = max(scene.grids.coarse_step_degc, 1.01 * twin.sensors.common.resolution)
    names = {n for r in scene.fit for place in READ for n in r.run.sensors(place)}
    steps = [recorded_step(r.run.columns[n]) for r in scene.fit for n in names & set(r.run.columns)]
    return max(steps, default=0.0) > usual


def outstanding_lines(scene: Scene) -> tuple[float, ...]:
    """The frequencies [Hz] of most power over that of their neighbours, the most first."""
    grids, count = scene.grids, scene.grids.outstanding_lines
    step = grids.line_spacing / scene.span_s
    frequencies = np.arange(4.0 * step, 0.5 / scene.row_s, step)
    if len(frequencies) < grids.line_neighbours:
        return tuple(float(f) for f in frequencies[:count])
    power = np.zeros(len(frequencies))
    comb = math.isqrt(len(frequencies))
    for rows in scene.fit:
        phase = np.pi * (rows.time_s - rows.time_s[0]) / max(rows.time_s[-1] - rows.time_s[0], 1.0)
        order = max(int((rows.time_s[-1] - rows.time_s[0]) / grids.drift_s), 1)
        smooth = np.cos(phase[:, None] * np.arange(order + 1))
        known = np.concatenate([smooth, rows.constants], axis=1)
        known = known / np.maximum(np.linalg.norm(known, axis=0), 1e-300)
        left = rows.gap - known @ np.linalg.lstsq(known, rows.gap, rcond=1e-10)[0]
        # Each frequency is one of a coarse comb and one of a fine one: exponentials of two short lists.
        coarse = np.exp(-2j * np.pi * np.outer(frequencies[::comb], rows.time_s))
        fine = np.exp(-2j * np.pi * np.outer(step * np.arange(comb), rows.time_s))
        waves = ((coarse * left) @ fine.T).ravel()[: len(frequencies)]
        power += np.abs(waves) ** 2 / max(float(left @ left), 1e-300)
    power /= np.maximum(median_filter(power, grids.line_neighbours, mode="nearest"), 1e-300)
    peaks = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] > power[2:])) + 1
    best = peaks[np.argsort(-power[peaks])][:count]
    return tuple(float(f) for f in frequencies[best])
