"""How strongly an effect shows: its contribution, its d', and the amplitude that gives a wanted d'."""

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
