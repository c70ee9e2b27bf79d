"""A small gyro model of a few lines, no twin: the protocol at its plainest, for checks by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fogml.gap.frame import Frame
from fogml.gap.model import Constant, NoisePrior
from fogml.gap.observation import Observation, observe
from fogml.gap.run_whitener import RunWhitener
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.quantities import Quantity

NOISE = NoiseModel(0.02, 0.03, 0.05)
MEANS = {"offset": 0.0, "slope": 0.0}


@dataclass(frozen=True)
class Kind:
    """A candidate: a formula with its amplitude and shape."""

    id: str
    amplitude: Quantity
    shape: tuple[Quantity, ...] = ()
    title: str = "a candidate"
    stage: str = "bias"
    confused_with: Mapping[str, str] = field(default_factory=dict)


SIZE = Quantity("amplitude", "deg/h", (0.1, 10.0), (0.1, 10.0), limits=(-1e3, 1e3), signed=True)
POSITIVE = Quantity("amplitude", "deg/h", (0.1, 10.0), (0.1, 10.0), limits=(0.0, 1e3))
PLACE = Quantity("centre_temperature", "degC", (10.0, 30.0), (10.0, 30.0), limits=(-50.0, 90.0))
WIDTH = Quantity("width", "degC", (3.0, 12.0), (3.0, 12.0), limits=(0.1, 50.0))
SHARE = Quantity("share", "1", (0.0, 1.0), (0.0, 1.0), limits=(0.0, 1.0))
PERIOD = Quantity("period", "s", (200.0, 4000.0), (200.0, 4000.0), limits=(1.0, 1e5))
PHASE = Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), limits=(-720.0, 720.0))
TEETH = Quantity("harmonic", "1", (1.0, 36.0), (1.0, 36.0), limits=(0.01, 1e4))
KINDS = {
    k.id: k
    for k in (
        Kind("bend", SIZE, (PLACE, WIDTH)),
        Kind("cube", POSITIVE),
        Kind("mixture", SIZE, (SHARE,)),
        Kind("line", SIZE, (PERIOD, PHASE)),
        Kind("rippled", SIZE, (PERIOD, PHASE)),
        Kind("toothed", SIZE, (TEETH, PHASE)),
        Kind("tilted", SIZE),
        Kind("mute", SIZE),
    )
}
KINDS["bend_again"] = Kind("bend_again", SIZE, (PLACE, WIDTH))


class DrawnPerRun(Kind):
    """A candidate whose amplitude is another one on each run."""

    drawn_per_run = True


KINDS["cube_drawn"] = DrawnPerRun("cube_drawn", SIZE)


@dataclass(frozen=True)
class OnRun:
    """The model with a run's inputs."""

    run: Run

    @property
    def u(self):
        return (self.run.temperature() - 20.0) / 20.0

    def columns(self):
        return {"offset": np.ones(len(self.run)), "slope": self.u}

    def output(self, constants, effects=()):
        columns = self.columns()
        base = sum(constants[name] * columns[name] for name in columns)
        return base + sum(e.amplitude * self.response(e.id, e.shape, constants) for e in effects)

    def reading_noise(self, constants):
        return np.zeros(len(self.run))

    def nuisances(self, constants):
        return {}

    def response(self, id, shape, constants):
        u, t = self.u, self.run.time - self.run.time[0]
        if id.startswith("bend"):
            return np.tanh((self.run.temperature() - shape["centre_temperature"]) / shape["width"])
        if id == "rippled":
            phase = 2.0 * np.pi * t / shape["period"] + np.radians(shape["phase"])
            return u**3 + 1e-3 * np.sin(phase)
        if id.startswith("cube"):
            return u**3
        if id == "mixture":
            return u**2 + shape["share"] * np.sin(t / 700.0)
        if id == "line":
            return np.sin(2.0 * np.pi * t / shape["period"] + np.radians(shape["phase"]))
        if id == "toothed":
            # A table that turns once in 500 s.
            return np.cos(2.0 * np.pi * shape["harmonic"] * t / 500.0 + np.radians(shape["phase"]))
        return 0.0 * u if id == "mute" else 0.3 * u - 0.1


@dataclass(frozen=True)
class SmallModel:
    """Offset and slope over temperature; candidates by name."""

    ids: tuple[str, ...] = ("bend", "cube", "mixture", "line")
    name: str = "small"
    grade: str = "tactical"
    memory_s: float = 0.0
    constants: tuple[Constant, ...] = (
        Constant("offset", "deg/h", 0.0, 3.0),
        Constant("slope", "deg/h", 0.0, 1.0),
    )
    noise: NoisePrior = field(default_factory=lambda: NoisePrior(NOISE.N, NOISE.B, NOISE.K))

    def candidates(self):
        return {id: KINDS[id] for id in self.ids}

    def on(self, run):
        return OnRun(run)

    def write(self, path, constants, effects, noise, standard_errors):
        path.write_text("small\n", encoding="utf-8")


def ramps(name="a", count=200, step=20.0, low=0.0, high=40.0, turns=2) -> Run:
    """A run of zeros whose temperature goes up and down in straight ramps."""
    time = step * np.arange(count)
    levels = np.where(np.arange(turns + 1) % 2 == 0, low, high)
    temperature = np.interp(time, np.linspace(0.0, time[-1], turns + 1), levels)
    return Run.from_columns(name, time=time, gyro=np.zeros(count), T=temperature)


def noise_of(run: Run, rng: np.random.Generator, noise: NoiseModel = NOISE) -> np.ndarray:
    """Noise of a run by the Cholesky factor of its dense covariance."""
    return np.linalg.cholesky(dense(run.time, run.sample_s, noise)) @ rng.standard_normal(len(run))


def dense(time, step, noise: NoiseModel = NOISE) -> np.ndarray:
    """The noise's covariance, with the ladder of flicker that a diagnosis takes."""
    return noise.covariance(time, step, noise.ladder(step, 30.0 * (time[-1] - time[0] + step)))


def recorded(run: Run, model: SmallModel, constants, effects=(), noise=None) -> Run:
    """The run with a gyro that follows the model, and a given noise."""
    gyro = model.on(run).output({**MEANS, **constants}, effects)
    return run.with_columns(gyro=gyro if noise is None else gyro + noise)


def framed(runs: list[Run], model: SmallModel, noise: NoiseModel = NOISE) -> Frame:
    """Runs as the whitened rows of a diagnosis."""
    observations: list[Observation] = [observe(run, model) for run in runs]
    whiteners = [RunWhitener(noise, o, MEANS) for o in observations]
    return Frame(observations, whiteners, model.constants, MEANS)
