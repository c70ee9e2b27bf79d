"""What a plan promises against fits of runs of its programme: the twin's replay, plain NumPy's noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtr as normal_cdf

from experiments.lab_uncertainty.measure import Told, coverage, of_errors, share
from experiments.lab_uncertainty.signals import Noise
from fogml.arrays import FloatArray
from fogml.gap.frame import Setting, fixed_columns, whitener_of
from fogml.gap.model import EffectValue
from fogml.gap.planning.fisher import Unknowns, expected, unknowns, usual_value
from fogml.gap.planning.programme_family import Design, Family
from fogml.gap.planning.rehearsal import FINE_S, Rehearsal, Stage, stage
from fogml.gap.planning.separating import LEAST_DISTANCE, distances, members_of
from fogml.gap.scene import Scene
from fogml.gap.settings import STANDARD
from fogml.intervals import Z90
from fogml.signals.noise_model import NoiseModel
from fogml.twin.registry import effect
from fogml.twin.replay import Replayer
from fogml.twin.set_up import Sensors
from fogml.twin.twin_file import load_twin

DESIGN = Design(rates=(1.0, None, None), ladder="rates")


@dataclass(frozen=True)
class Promise:
    """What is wanted of a programme of 8 h; or a pair to be told apart, at the distance that is enough.

    Thermometers are exact, or the twin's; shapes of effects are those of the plan, or drawn: evenly over
    their range, or from the catalogue's prior.
    """

    want: tuple[str, ...] = ()
    apart: tuple[str, str] | None = None
    thermometers: bool = False
    drawn: Literal["", "range", "prior"] = ""


CASES = {
    "constants": Promise(("k1", "k2", "b1", "b2")),
    "constants, thermometers of the twin": Promise(("k1", "k2", "b1", "b2"), thermometers=True),
    "hysteresis as planned": Promise(("thermal_hysteresis",)),
    "hysteresis, width of the catalogue's prior": Promise(("thermal_hysteresis",), drawn="prior"),
    "hysteresis, width drawn": Promise(("thermal_hysteresis",), drawn="range"),
    "rate times temperature": Promise(("temperature_rate_product",)),
    "hysteresis, rate times temperature": Promise(apart=("thermal_hysteresis", "temperature_rate_product")),
    "rate times temperature, hysteresis": Promise(apart=("temperature_rate_product", "thermal_hysteresis")),
}
_REACH = 1.5
_STARTS = (0.15, 0.85)
"""Where fits of a shape begin beside the plan's, as shares of its range."""


class Bench:
    """A programme's run, as it acts and as it is read, and fits of what it gives."""

    def __init__(self, case: Promise) -> None:
        self.case, self.twin = case, load_twin("tactical")
        white = self.twin.noise
        noise = NoiseModel(white.N, white.B, white.K)
        self.values = {n: c for n, c in vars(self.twin.nominal).items() if isinstance(c, float)}
        sensors = self.twin.sensors if case.thermometers else Sensors()
        self.on: Stage = stage(replace(self.twin, sensors=sensors), noise, self.values)
        self.family = Family(hours=10.0)
        self.rehearsal = Rehearsal(self.on, self.family, DESIGN, FINE_S)
        rows = self.rehearsal.rows
        self.kept, self.acting = rows.kept, Replayer(rows.run)
        self.whitener = whitener_of(noise, rows)
        self.noise = Noise(white.N, white.B, white.K)
        scene = Scene((rows,), 1, self.twin.grade, constants=self.values)
        setting = Setting(scene, self.on.model.constants, STANDARD, ())
        own = replace(self.on.model.twin, sensors=sensors)
        self.missed = fixed_columns(setting, 0, own)[:, len(self.constants) :]
        self.missed_white = self._whiten(self.missed)

    def _whiten(self, values: FloatArray) -> FloatArray:
        return np.asarray(self.whitener.whiten(np.ascontiguousarray(values)))

    @cached_property
    def constants(self) -> dict[str, tuple[float, float]]:
        """Mean and deviation of each."""
        return {c.name: (c.mean, c.sd) for c in self.on.model.constants}

    def read(self, seed: int) -> Replayer:
        """The replay of temperatures as thermometers read them."""
        if not self.case.thermometers:
            return self.acting
        programme, facts = self.family.programme(DESIGN), self.rehearsal.rows.run.facts
        run = self.on.acting.simulate(programme, sample_s=FINE_S, facts=facts, seed=seed).run
        return Replayer(run.with_columns(gyro=np.zeros(len(run))))

    def output(self, replayer: Replayer, constants: Mapping[str, float], *held: EffectValue) -> FloatArray:
        """Drift [deg/h]."""
        twin = self.on.model.twin.with_nominal(**constants)
        for id in self.case.apart or ():
            twin = twin.without_effect(id)
        for one in held:
            twin = twin.with_effect(one.id, one.amplitude, **one.shape)
        return replayer.output(twin)[self.kept]

    def drawn(self, rng: np.random.Generator, *held: EffectValue) -> tuple[FloatArray, dict[str, float]]:
        """A run's output and the constants behind it."""
        constants = {name: float(rng.normal(*told)) for name, told in self.constants.items()}
        output = self.output(self.acting, constants, *held)
        output = output + self.noise.draw(rng, len(self.kept), self.rehearsal.rows.row_s)[self.kept]
        if not self.case.thermometers:
            output = output + self.missed @ rng.standard_normal(self.missed.shape[1])
        return output, constants

    def fitted(
        self, output: FloatArray, replayer: Replayer, held: tuple[EffectValue, ...], known: bool
    ) -> tuple[float, dict[str, float]]:
        """Least squares of all unknowns: the sum of squares and the estimates.

        Shapes have the plan's priors where `known`, and are free within reach of their range otherwise.
        """
        names = list(self.constants)
        sizes: list[float] = []
        starts: list[float] = []
        priors: list[float | None] = []
        bounds: list[tuple[float, float]] = []

        def unknown(size: float, start: float, prior: float | None, ends: tuple[float, float]) -> None:
            sizes.append(size)
            starts.append(start)
            priors.append(prior)
            bounds.append(ends)

        for one in held:
            declared = effect(one.id)
            one_sign = not declared.amplitude.signed and declared.amplitude.limits[0] >= 0.0
            unknown(abs(one.amplitude), 1.0, None, (0.0 if one_sign else -np.inf, np.inf))
            for quantity in declared.shape:
                low, high = quantity.range(self.twin.grade)
                sd = 0.5 * (high - low) / Z90
                at = one.shape[quantity.name] / sd
                reach = (max(quantity.limits[0], low / _REACH), min(quantity.limits[1], high * _REACH))
                unknown(sd, at, at if known else None, (reach[0] / sd, reach[1] / sd))
        count, own = len(names), np.array(sizes)

        def split(x: FloatArray) -> tuple[dict[str, float], list[EffectValue]]:
            constants = {n: m + s * z for (n, (m, s)), z in zip(self.constants.items(), x[:count])}
            values, place, made = own * x[count : count + len(own)], 0, []
            for one in held:
                shape = dict(zip((q.name for q in effect(one.id).shape), values[place + 1 :].tolist()))
                made.append(EffectValue(one.id, float(values[place]), shape))
                place += 1 + len(shape)
            return constants, made

        def residual(x: FloatArray) -> FloatArray:
            constants, made = split(x)
            left = self._whiten(output - self.output(replayer, constants, *made))
            left = left - self.missed_white @ x[count + len(own) :]
            told = [x[count + i] - p for i, p in enumerate(priors) if p is not None]
            return np.concatenate((left, x[:count], told, x[count + len(own) :]))

        more = self.missed.shape[1]
        start = np.concatenate((np.zeros(count), starts, np.zeros(more)))
        ends = [
            np.concatenate((np.full(count, sign), [b[side] for b in bounds], np.full(more, sign)))
            for side, sign in enumerate((-np.inf, np.inf))
        ]
        start = np.clip(start, ends[0] + 1e-9, ends[1] - 1e-9)
        found = least_squares(residual, start, bounds=(ends[0], ends[1]), x_scale=1.0)
        constants, made = split(found.x)
        told = dict(constants)
        for one in made:
            told |= {f"{one.id}.amplitude": one.amplitude}
            told |= {f"{one.id}.{name}": value for name, value in one.shape.items()}
        return 2.0 * float(found.cost), told


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    bench = Bench(CASES[name])
    rows: Callable[..., list[dict[str, Any]]] = _errors if bench.case.apart is None else _apart
    return rows(bench, name, repeats, seed)


def _errors(bench: Bench, name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    of: Unknowns = unknowns(bench.on, bench.case.want)
    deviations = np.sqrt(np.diag(expected(bench.rehearsal, of)))
    promised = {of.parameters[i].name: float(deviations[i]) * of.parameters[i].scale for i in of.wanted}
    told: dict[str, list[Told | None]] = {}
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        held = tuple(_drawn(one, bench, rng) if bench.case.drawn else one for one in of.effects)
        output, constants = bench.drawn(rng, *held)
        found = bench.fitted(output, bench.read(repeat), of.effects, known=True)[1]
        true = dict(constants)
        for one in held:
            true |= {f"{one.id}.amplitude": one.amplitude}
            true |= {f"{one.id}.{key}": value for key, value in one.shape.items()}
        for key, se in promised.items():
            told.setdefault(key, []).append(of_errors(found[key] - true[key], se))
    return [coverage(name, key, every) for key, every in told.items()]


def _drawn(one: EffectValue, bench: Bench, rng: np.random.Generator) -> EffectValue:
    shape, grade = effect(one.id).shape, bench.twin.grade
    if bench.case.drawn == "prior":
        return replace(one, shape={q.name: q.draw(rng, grade) for q in shape})
    return replace(one, shape={q.name: float(rng.uniform(*q.range(grade))) for q in shape})


def _apart(bench: Bench, name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    assert bench.case.apart is not None
    usual = [usual_value(bench.on, id) for id in bench.case.apart]
    pairs = distances(bench.rehearsal, members_of(bench.on, bench.family, usual), refined=True)
    true = replace(usual[0], amplitude=usual[0].amplitude * LEAST_DISTANCE / float(pairs[0, 1]))
    wrong = 0
    for repeat in range(repeats):
        output, _ = bench.drawn(np.random.default_rng([seed, repeat]), true)
        squares = [
            min(
                bench.fitted(output, bench.acting, (_at(one, share_of, bench),), known=False)[0]
                for share_of in ((None, *_STARTS) if effect(one.id).shape else (None,))
            )
            for one in (true, usual[1])
        ]
        wrong += squares[1] < squares[0]
    stated = float(normal_cdf(-0.5 * LEAST_DISTANCE))
    return [share(name, f"the other fits better at a distance of {LEAST_DISTANCE:g}", wrong, repeats, stated)]


def _at(one: EffectValue, share_of: float | None, bench: Bench) -> EffectValue:
    if share_of is None:
        return one
    ranges = {q.name: q.range(bench.twin.grade) for q in effect(one.id).shape}
    return replace(one, shape={key: low + share_of * (high - low) for key, (low, high) in ranges.items()})
