"""How strongly an effect shows: its contribution, its d', and the amplitude that gives a wanted d'.

What a perfect diagnosis would find: the true structural gap, its segments, what the true form closes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame import nominal
from fogml.blind.frame.form import Additive, Distorting, Form, Sensing, Shape
from fogml.blind.frame.noise import Projected
from fogml.blind.frame.unit import Unit, UnitRun

_LEAST_OUTSIDE = 0.02
"""Share of an effect's whitened length that must lie outside the nominal constants' span."""
_TOLERANCE = 1e-4


class TooWeak(Exception):
    """This unit can't show the effect at the wanted strength."""


@dataclass(frozen=True, eq=False)
class Acting:
    """One effect at work on a unit: its form, shape and amplitude (0 before it is set)."""

    form: Form
    shape: Shape
    amplitude: float = 0.0
    d_prime: float = 0.0

    def contribution(self, unit: Unit, run: UnitRun, before: tuple[Acting, ...] = ()) -> FloatArray:
        """What the gap of a run holds of it [deg/h], shape (n,).

        Of one on the sensors beside those that act `before` it, so that all add up to what a replay lacks.
        """
        form, world = self.form, run.world
        if isinstance(form, Additive):
            return self.amplitude * form.response(world, self.shape, np.random.default_rng(run.seed))
        if isinstance(form, Distorting):
            output = unit.output(run)
            return form.distorted(output, world, self.amplitude, self.shape) - output
        trusted = nominal.output(unit.constants, unit.seen(run, recorded(unit, run, before)))
        return trusted - nominal.output(unit.constants, unit.seen(run, recorded(unit, run, (*before, self))))

    @property
    def reads(self) -> bool:
        """Whether it makes a sensor's value a reading, after whatever falsifies what the sensor feels."""
        return isinstance(self.form, Sensing) and type(self.form).read is not Sensing.read


def acting_before(effects: tuple[Acting, ...], effect: Acting) -> tuple[Acting, ...]:
    """Those of all effects on the sensors that act before one of them.

    Each changes what a sensor feels or what it gives, and none both.
    """
    chain = sorted((e for e in effects if isinstance(e.form, Sensing)), key=lambda e: e.reads)
    return tuple(chain[: chain.index(effect)]) if effect in chain else ()


def recorded(unit: Unit, run: UnitRun, effects: tuple[Acting, ...]) -> dict[str, FloatArray]:
    """Recorded temperatures under all `effects` that act on sensors [degC]."""
    acting = [(e, e.form) for e in effects if isinstance(e.form, Sensing) and e.amplitude > 0.0]
    felt = dict(run.sensed.felt)
    for effect, form in acting:
        for name in unit.instruments.coil:
            felt[name] = form.felt(name, felt[name], run.world, effect.amplitude, effect.shape)
    values = run.sensed.recorded(felt)
    for effect, form in acting:
        for name in unit.instruments.coil:
            values[name] = form.read(values[name], effect.amplitude, effect.shape)
    return values


class Scales:
    """Measures contributions on a unit's fit runs by the true whitening."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit
        self.whitenings = [unit.whitening(r) for r in unit.fit]

    def projected(self, effects: tuple[Acting, ...] = ()) -> Projected:
        """Nominal columns as a replay has them, from what the sensors recorded under `effects`."""
        columns = [self.unit.columns(r, recorded(self.unit, r, effects)) for r in self.unit.fit]
        return Projected(self.whitenings, columns)

    def d_prime(self, effect: Acting, projected: Projected | None = None) -> float:
        """||W (I - P) s|| over the fit runs."""
        projected = projected or self.projected((effect,) if isinstance(effect.form, Sensing) else ())
        return projected.length(self._series(effect))

    def with_strength(self, form: Form, shape: Shape, sign: float, wanted: float) -> Acting:
        """The effect at the amplitude that gives d' = `wanted`, by bisection where it is not linear.

        Raises
        ------
        TooWeak
            If no amplitude that a gyro can have does, or the effect lies in the span of the constants.
        """
        if isinstance(form, Additive):
            one = Acting(form, shape, 1.0)
            projected = self.projected()
            series = self._series(one)
            length = projected.length(series)
            whole = sum(float(s @ w.solve(s[:, None])[:, 0]) for s, w in zip(series, self.whitenings))
            if not length > _LEAST_OUTSIDE * np.sqrt(whole):
                raise TooWeak(form.name)
            if wanted / length > form.largest:
                raise TooWeak(form.name)
            return replace(one, amplitude=sign * wanted / length, d_prime=wanted)
        return self._bisected(form, shape, wanted)

    def _bisected(self, form: Form, shape: Shape, wanted: float) -> Acting:
        assert isinstance(form, Distorting | Sensing)
        fixed = self.projected() if isinstance(form, Distorting) else None

        def at(log_amplitude: float) -> float:
            return self.d_prime(Acting(form, shape, float(np.exp(log_amplitude))), fixed)

        high = float(np.log(form.greatest))
        low = high - np.log(1e6)
        if at(high) < wanted or at(low) > wanted:
            raise TooWeak(form.name)
        reached = np.inf
        for _ in range(60):
            middle = 0.5 * (low + high)
            reached = at(middle)
            low, high = (middle, high) if reached < wanted else (low, middle)
            if abs(reached / wanted - 1.0) < _TOLERANCE:
                break
        if abs(reached / wanted - 1.0) > 0.01:
            # A form with steps jumps over the wanted strength.
            raise TooWeak(form.name)
        return Acting(form, shape, float(np.exp(middle)), reached)

    def _series(self, effect: Acting) -> list[FloatArray]:
        """Its contributions to the fit runs, on the rows that count."""
        return [effect.contribution(self.unit, r)[self.unit.skipped :] for r in self.unit.fit]


AVERAGING_S = 100.0
_SHORTEST_S = 600.0


@dataclass(frozen=True)
class Closing:
    """Rms values in deg/h over averages of `AVERAGING_S` on one held-out run."""

    run: str
    recalibrated: float
    after: float
    floor: float
    closed: float | None


class Reckoning:
    """All effects of a case together.

    Attributes
    ----------
    contributions
        By run name and place in `effects` [deg/h], shape (n,).
    d_prime
        Of all effects together.
    """

    def __init__(self, scales: Scales, effects: tuple[Acting, ...]) -> None:
        self.unit, self.effects, self._scales = scales.unit, effects, scales
        unit = self.unit
        self._width = max(round(AVERAGING_S / unit.sample_s), 1)
        self._projected = scales.projected(effects)
        self.contributions = {
            (run.name, place): effect.contribution(unit, run, acting_before(effects, effect))
            for run in unit.runs
            for place, effect in enumerate(effects)
        }
        self._totals = [self._signatures(run).sum(axis=1) for run in unit.fit]
        self.d_prime = self._projected.length(self._totals) if effects else 0.0

    def segments(self) -> list[tuple[str, float, float]]:
        """(run, from s, to s) where 100 s averages of the true structural gap exceed the floor.

        The structural gap is what is left of the contributions once the nominal constants took up
        their part; the floor is what the noise leaves after the same.
        """
        if not self.effects:
            return []
        theta = self._projected.constants(self._totals)
        found = []
        for run, total, columns, whitening in zip(
            self.unit.fit, self._totals, self._projected.columns, self._scales.whitenings
        ):
            gap = means(total - columns @ theta, self._width)
            taken = means(columns, self._width) @ np.linalg.cholesky(_positive(self._projected.covariance))
            square = whitening.mean_square_of_means(self._width) - float(np.mean(np.sum(taken**2, axis=1)))
            floor = np.sqrt(max(square, whitening.white / self._width))
            block = self._width * self.unit.sample_s
            start = float(run.world.time[self.unit.skipped])
            for first, stop in runs_of(np.abs(gap) > floor):
                if (stop - first) * block >= _SHORTEST_S:
                    found.append((run.name, start + first * block, start + stop * block))
        return found

    def closing(self) -> list[Closing]:
        """What the true signatures, fitted on the fit runs with the nominal constants, close.

        Of an effect that each run draws anew, nobody knows a held-out run's.
        """
        unit = self.unit
        gaps, plain, wide = {}, {}, {}
        for run in unit.runs:
            columns = unit.columns(run, recorded(unit, run, self.effects))
            gaps[run.name] = (recorded_output(unit, run, self.effects) - run.world.rate_deg_h)[unit.skipped :]
            plain[run.name] = columns
            signatures = self._signatures(run)
            if run in unit.held_out:
                signatures = signatures * [not effect.form.drawn_per_run for effect in self.effects]
            wide[run.name] = np.concatenate([columns, signatures], axis=1)
        sd = np.array([nominal.PRIOR_SD[name] for name in unit.constant_names])
        loose = np.concatenate([sd, np.full(len(self.effects), np.inf)])
        fit = [gaps[r.name] for r in unit.fit]

        def residuals(columns: dict[str, FloatArray], sd: FloatArray) -> dict[str, FloatArray]:
            projected = Projected(self._scales.whitenings, [columns[r.name] for r in unit.fit])
            theta = projected.constants(fit, sd)
            return {r.name: gaps[r.name] - columns[r.name] @ theta for r in unit.held_out}

        before, after = residuals(plain, sd), residuals(wide, loose)
        return [self._closed(r, before[r.name], after[r.name]) for r in unit.held_out]

    def _closed(self, run: UnitRun, before: FloatArray, behind: FloatArray) -> Closing:
        whitening = self.unit.whitening(run)
        recalibrated = mean_square(before, self._width)
        after = mean_square(behind, self._width)
        floor = whitening.mean_square_of_means(self._width)
        white = whitening.white / self._width
        blocks = len(before) // self._width
        # The slow part of the noise has about two degrees of freedom in a run.
        spread = np.sqrt(2.0 * white**2 / blocks + (floor - white) ** 2)
        gained = recalibrated - floor
        foreseen = any(not effect.form.drawn_per_run for effect in self.effects)
        closed = (recalibrated - after) / gained if foreseen and gained > 1.645 * spread else None
        return Closing(
            run.name, float(np.sqrt(recalibrated)), float(np.sqrt(after)), float(np.sqrt(floor)), closed
        )

    def _signatures(self, run: UnitRun) -> FloatArray:
        """Contributions of the effects side by side, on the rows that count."""
        series = [self.contributions[run.name, place] for place in range(len(self.effects))]
        whole = np.stack(series, axis=1) if series else np.empty((len(run.world.time), 0))
        return whole[self.unit.skipped :]


def recorded_output(unit: Unit, run: UnitRun, effects: tuple[Acting, ...]) -> FloatArray:
    """The gyro's record [deg/h]: nominal, additive effects, distortions, noise; shape (n,)."""
    output = unit.output(run)
    for effect in effects:
        if isinstance(effect.form, Additive):
            output = output + effect.contribution(unit, run)
    for effect in effects:
        if isinstance(effect.form, Distorting):
            output = effect.form.distorted(output, run.world, effect.amplitude, effect.shape)
    return np.asarray(output + run.noise)


def means(x: FloatArray, width: int) -> FloatArray:
    """Means over whole blocks of `width` rows."""
    blocks = len(x) // width
    return np.asarray(x[: blocks * width].reshape(blocks, width, *x.shape[1:]).mean(axis=1))


def mean_square(x: FloatArray, width: int) -> float:
    """Mean square of the means over blocks."""
    return float(np.mean(means(x, width) ** 2))


def runs_of(flags: FloatArray) -> list[tuple[int, int]]:
    """(first, stop) of each stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def _positive(matrix: FloatArray) -> FloatArray:
    """A covariance with enough on its diagonal for a Cholesky factor."""
    return matrix + np.diag(1e-9 * np.diag(matrix) + 1e-300)
