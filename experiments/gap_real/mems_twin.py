"""A laboratory's own simulator in the place of the twin: a MEMS gyro whose bias is a polynomial of T.

::

    gyro = c0 + c1 v + c2 v**2 + c3 v**3 + effects,      v = (T - 25 degC) / 50 degC

It knows nothing of `fogml.twin.twin.Twin`: `MemsTwin` and `MemsOnRun` offer what
`fogml.gap.model.GyroModel` and `ModelOnRun` ask for, and no more. Its candidate effects borrow the
equations of the catalogue that need the temperature alone, with sizes of a MEMS gyro.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.gap.model import Constant, EffectValue, NoisePrior
from fogml.outputs import whole_file
from fogml.runs.run import Run
from fogml.twin.effect import Effect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.registry import effect
from fogml.yaml_text import yaml_text

BORROWED = {
    "shupe_mohr": "Bias in proportion to the rate of temperature",
    "temperature_rate_product": "Temperature times its rate",
    "thermal_hysteresis": "Thermal hysteresis of the bias",
    "stress_relaxation": "Relaxing stress in package and solder",
    "bias_polynomial": "Bias of fourth and fifth order in temperature",
    "glass_transition": "A transition of the adhesive at one temperature",
    "thermal_shock": "A shock by fast ramps that decays",
}
"""Bias effects of the catalogue that need the temperature alone, and what they are on a MEMS gyro."""
LARGER = 100.0
"""How much larger than a tactical fibre-optic gyro's a MEMS gyro's thermal errors are."""
RATE_WINDOW_S = 64.0
NOISE = NoisePrior(N=0.01, B=0.5, K=0.5)


@dataclass(frozen=True)
class MemsEffect:
    """A candidate: an equation of the catalogue with a MEMS gyro's sizes."""

    declared: Effect
    title: str

    @property
    def id(self) -> str:
        """Name in reports."""
        return self.declared.id

    @property
    def stage(self) -> str:
        """All of them add to the bias."""
        return "bias"

    @property
    def amplitude(self) -> Quantity:
        """The catalogue's, scaled."""
        own = self.declared.amplitude
        low, high = own.tactical
        scaled = (LARGER * low, LARGER * high)
        return replace(own, tactical=scaled, navigation=scaled, limits=(-1e5, 1e5), signed=True)

    @property
    def shape(self) -> tuple[Quantity, ...]:
        """The catalogue's."""
        return self.declared.shape

    @property
    def drawn_per_run(self) -> bool:
        """Whether its size is another one on each run."""
        return self.declared.drawn_per_run

    @property
    def confused_with(self) -> Mapping[str, str]:
        """The catalogue's look-alikes among those that are borrowed."""
        return {id: how for id, how in self.declared.confused_with.items() if id in BORROWED}


@dataclass(frozen=True, eq=False)
class MemsOnRun:
    """The simulator with a run's temperature, and with that of the recording before it, if known."""

    run: Run
    earlier: Run | None = None

    def _inputs(self) -> Inputs:
        """Time and temperature on one clock, the earlier recording first."""
        time, temperature = self.run.time, self.run.temperature()
        if self.earlier is not None:
            before = self.earlier.time - self.earlier.time[-1] - self.earlier.sample_s + time[0]
            time = np.concatenate([before, time])
            temperature = np.concatenate([self.earlier.temperature(), temperature])
        return Inputs(
            time=time,
            temperatures={"T": temperature},
            table_rate=np.zeros(len(time)),
            rate_window_s=RATE_WINDOW_S,
            hindsight=True,
        )

    def columns(self) -> Mapping[str, FloatArray]:
        """Response to a unit of each constant: powers of v, each of shape (n,)."""
        v = (self.run.temperature() - 25.0) / 50.0
        return {f"c{power}": v**power for power in range(4)}

    def output(self, constants: Mapping[str, float], effects: tuple[EffectValue, ...] = ()) -> FloatArray:
        """The replay [deg/h], shape (n,)."""
        total = sum((constants[name] * column for name, column in self.columns().items()), np.zeros(()))
        for value in effects:
            total = total + value.amplitude * self.response(value.id, value.shape, constants)
        return np.asarray(total)

    def response(self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]) -> FloatArray:
        """Change of the output per unit of an effect's amplitude [deg/h], shape (n,)."""
        found = effect(id).signature(self._inputs(), **shape)
        return np.asarray(found[len(found) - len(self.run) :], dtype=np.float64)

    def nuisances(self, constants: Mapping[str, float]) -> Mapping[str, FloatArray]:
        """None: what the thermometer lags by is for the diagnosis to find."""
        return {}


@dataclass(frozen=True, eq=False)
class MemsTwin:
    """The simulator.

    Parameters
    ----------
    earlier
        Name of a run to the recording of the same unit that ended where it begins.
    noise
        A quiet MEMS gyro's within a factor of three: no static run of this unit ships.
    values, spreads
        Constants and the standard deviations of their priors [deg/h].
    """

    earlier: Mapping[str, Run] = field(default_factory=dict)
    noise: NoisePrior = NOISE
    values: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(("c0", "c1", "c2", "c3"), 0.0))
    spreads: Mapping[str, float] = field(
        default_factory=lambda: {"c0": 500.0, "c1": 200.0, "c2": 100.0, "c3": 100.0}
    )
    name: str = "MEMS bias polynomial"
    grade: str = "tactical"
    memory_s: float = 2.0 * RATE_WINDOW_S

    @property
    def constants(self) -> tuple[Constant, ...]:
        """Coefficients of the polynomial."""
        return tuple(Constant(name, "deg/h", self.values[name], self.spreads[name]) for name in self.values)

    def candidates(self) -> Mapping[str, MemsEffect]:
        """Effects to choose from, by id."""
        return {id: MemsEffect(effect(id), title) for id, title in BORROWED.items()}

    def on(self, run: Run) -> MemsOnRun:
        """The simulator with a run's temperature."""
        if not run.temperature_columns:
            raise InputError(f"{run.name}: holds no temperature; the MEMS twin needs a column 'T [degC]'")
        return MemsOnRun(run, self.earlier.get(run.name))

    def write(
        self,
        path: Path,
        constants: Mapping[str, float],
        effects: tuple[EffectValue, ...],
        noise: NoisePrior,
        standard_errors: Mapping[str, float],
    ) -> None:
        """Write constants, effects and noise as YAML."""
        content = {
            "simulator": self.name,
            "constants": {
                name: {"value": float(value), "unit": "deg/h", "sd": float(standard_errors[name])}
                for name, value in constants.items()
            },
            "noise": {"N": float(noise.N), "B": float(noise.B), "K": float(noise.K)},
            "effects": {
                e.id: {"amplitude": float(e.amplitude), **{k: float(v) for k, v in e.shape.items()}}
                for e in effects
            },
        }
        with whole_file(path) as partial:
            partial.write_text(yaml_text(content), encoding="utf-8")


def legs_of(axis: str, noise: NoisePrior = NOISE) -> tuple[list[Run], MemsTwin]:
    """The three legs of the shipped thermal cycle, and the simulator that knows what went before each."""
    from fogml.runs.shipped import shipped_run

    legs = [shipped_run(f"thermal-cycle-{leg}-{axis}") for leg in "123"]
    cycle: dict[str, Run] = {}
    for number, leg in enumerate(legs[1:], start=1):
        cycle[leg.name] = _joined(legs[:number])
    return legs, MemsTwin(cycle, noise)


def _joined(legs: list[Run]) -> Run:
    """Legs one after the other as one recording of time and temperature."""
    times, begin = [], 0.0
    for leg in legs:
        times.append(begin + leg.time - leg.time[0])
        begin = float(times[-1][-1]) + leg.sample_s
    temperature = np.concatenate([leg.temperature() for leg in legs])
    time = np.concatenate(times)
    return Run.from_columns("earlier", legs[0].facts, time=time, gyro=np.zeros(len(time)), T=temperature)
