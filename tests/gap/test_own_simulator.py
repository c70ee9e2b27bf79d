"""Another simulator in the twin's place: its constants, its replay, its own candidates."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.diagnosis import diagnose
from fogml.gap.model import Constant, EffectValue, NoisePrior
from fogml.gap.settings import STANDARD
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.programme import programme_from
from fogml.twin.quantities import Quantity
from fogml.yaml_text import parse_yaml

SIZE = Quantity("amplitude", "deg/h", (0.1, 10.0), (0.1, 10.0), limits=(-1e3, 1e3), signed=True)
PLACE = Quantity("centre_temperature", "degC", (5.0, 35.0), (5.0, 35.0), limits=(-50.0, 90.0))
WIDTH = Quantity("width", "degC", (3.0, 12.0), (3.0, 12.0), limits=(0.1, 50.0))
NOISE = NoiseModel(0.02, 0.005, 0.005)
ASKED: list[str] = []
"""Runs of which nuisances were asked."""


@dataclass(frozen=True)
class Kind:
    """A candidate as the protocol asks for it, and no more."""

    id: str
    shape: tuple = ()
    amplitude: Quantity = SIZE
    title: str = "A candidate"
    stage: str = "bias"
    confused_with: dict = field(default_factory=dict)


KINDS = {k.id: k for k in (Kind("bend", (PLACE, WIDTH)), Kind("creep"), Kind("bend_again", (PLACE, WIDTH)))}


class OnRun:
    def __init__(self, run):
        self.run = run

    def columns(self):
        u = self.run.temperature() / 20.0
        return {"offset": np.ones(len(u)), "slope": u}

    def output(self, constants, effects=()):
        base = sum(constants[name] * column for name, column in self.columns().items())
        return base + sum(e.amplitude * self.response(e.id, e.shape, constants) for e in effects)

    def reading_noise(self, constants):
        return np.zeros(len(self.run))

    def nuisances(self, constants):
        ASKED.append(self.run.name)
        return {"line": 0.01 * np.sin(self.run.time / 500.0)}

    def response(self, id, shape, constants):
        if id.startswith("bend"):
            return np.tanh((self.run.temperature() - shape["centre_temperature"]) / shape["width"])
        return np.sqrt(self.run.time - self.run.time[0]) / 100.0


@dataclass(frozen=True)
class Simulator:
    offered: tuple[str, ...] = ("bend", "creep", "bend_again")
    name: str = "own"
    grade: str = "tactical"
    memory_s: float = 0.0
    constants: tuple = (Constant("offset", "deg/h", 0.0, 3.0), Constant("slope", "deg/h", 0.0, 1.0))
    noise: NoisePrior = field(default_factory=lambda: NoisePrior(NOISE.N, NOISE.B, NOISE.K))

    def candidates(self):
        return {id: KINDS[id] for id in self.offered}

    def on(self, run):
        return OnRun(run)

    def write(self, path, constants, effects, noise, standard_errors):
        path.write_text("".join(f"{e.id} {e.amplitude}\n" for e in effects), encoding="utf-8")


def made_runs(effects=(), count=160, step=90.0, offsets=(1.5, 1.5, 1.5), noisier=1.0, seed=5):
    rng, made, time = np.random.default_rng(seed), [], step * np.arange(count)
    root = np.linalg.cholesky(NOISE.covariance(time, step, NOISE.ladder(step, 30.0 * count * step)))
    for offset, (name, low, high) in zip(offsets, (("a", 0.0, 40.0), ("b", 5.0, 38.0), ("c", -2.0, 41.0))):
        corners = [20.0, high, high, low, low, 20.0, 20.0]
        temperature = np.interp(time, np.linspace(0.0, time[-1], 7), corners)
        run = Run.from_columns(name, time=time, gyro=np.zeros(count), T=temperature)
        gyro = OnRun(run).output({"offset": offset, "slope": -0.4}, effects)
        gyro = gyro + (noisier if name == "c" else 1.0) * (root @ rng.standard_normal(count))
        made.append(run.with_columns(gyro=gyro))
    return made


def test_an_own_candidate_is_named_with_its_numbers(tmp_path):
    truth = EffectValue("bend", 0.6, {"centre_temperature": 17.0, "width": 5.0})
    runs, model = made_runs((truth,)), Simulator()
    found = diagnose(model, runs[:2], runs[2:], without=["bend_again"])
    assert [f.effect for f in found.named] == ["bend"]
    (cause,) = found.named
    # What the user takes off the candidates, and looks the same, is as likely.
    assert cause.left_out == ("bend_again",) and cause.members == ("bend",)
    assert (
        found.unknown.probability == pytest.approx(0.5, abs=0.1) and "bend_again" in found.unknown.looks_like
    )
    _shares(found)
    assert cause.amplitude.value == pytest.approx(0.6, abs=4.0 * cause.amplitude.se)
    assert cause.parameters["centre_temperature"].value == pytest.approx(17.0, abs=2.0)
    assert found.how_far[0].closed > 0.9
    slope = next(c for c in found.constants if c.name == "slope")
    assert slope.value == pytest.approx(-0.4, abs=4.0 * slope.se)
    # What can't be simulated is not planned.
    assert found.separating_run is None and found.model == "own"
    found.write_model(model, tmp_path / "fitted")
    assert (tmp_path / "fitted").read_text().startswith("bend 0.")


def _shares(found):
    """Of one run or regime they add to 1; a cause alone makes all of it."""
    parts = {(s.run, s.regime) for s in found.shares}
    assert (None, None) in parts and ("a", None) in parts
    for part in parts:
        held = [s for s in found.shares if (s.run, s.regime) == part]
        assert sum(s.share for s in held) == pytest.approx(1.0)
        assert all(s.ci90[0] <= s.share <= s.ci90[1] for s in held)
    assert found.named[0].share == pytest.approx(1.0)


def test_constants_that_changed_between_two_runs_and_a_noisier_held_out_run():
    runs = made_runs(offsets=(1.5, 2.6, 2.6), noisier=3.0)
    priors = replace(STANDARD, reported=replace(STANDARD.reported, suspected=0.2))
    found = diagnose(Simulator(offered=("creep",)), runs[:2], runs[2:], plan=False, priors=priors)
    assert found.verdict == "unknown" and found.least_suspected == 0.2
    assert found.unknown.looks_like == "comes of constants that changed between two runs, a and b"
    (far,) = found.how_far
    assert "white noise of this run is" in far.note
    assert far.floor == pytest.approx(3.0 * NOISE.N * np.sqrt(3600.0 / 90.0), rel=0.2)


def test_what_is_not_known_is_repeated_with_the_power_on_earlier():
    truth = EffectValue("bend", 0.6, {"centre_temperature": 17.0, "width": 5.0})
    runs = made_runs((truth,))
    found = diagnose(Simulator(offered=("creep",)), runs[:2], runs[2:])
    assert found.verdict == "unknown"
    run = found.separating_run
    assert run.separates == ("temperature", "power-on", "time") and run.distance > 3.0
    programme = programme_from(parse_yaml(run.programme, "test"))
    # The corners of the recorded course, after an hour without power and some with it.
    assert programme.total_hours == pytest.approx(run.hours, rel=0.02)
    assert len(run.steps) == 8 and sum("ramp" in step for step in run.steps) == 3


def test_nothing_missing_is_nothing_missing_and_a_model_without_candidates_has_the_catalogues():
    runs = made_runs()
    found = diagnose(Simulator(offered=()), runs[:2], runs[2:], plan=False)
    assert found.verdict == "no_gap"
    assert "thermal_hysteresis" in {e.effect for e in found.evidence}
    offset = next(c for c in found.constants if c.name == "offset")
    assert offset.value == pytest.approx(1.5, abs=4.0 * offset.se)


def test_a_model_without_constants_or_with_one_that_is_known_is_diagnosed():
    runs = made_runs()

    class Fixed(Simulator):
        def on(self, run):
            return Known(run)

    class Known(OnRun):
        def columns(self):
            return {}

        def output(self, constants, effects=()):
            return super().output({}, effects) + 1.5 - 0.4 * self.run.temperature() / 20.0

    found = diagnose(Fixed(("creep",), constants=()), runs[:2], runs[2:], plan=False)
    assert found.verdict == "no_gap" and found.constants == ()
    held = (Constant("offset", "deg/h", 1.5, 0.0), Constant("slope", "deg/h", 0.0, 1.0))
    offset, slope = diagnose(Simulator(("creep",), constants=held), runs[:2], runs[2:], plan=False).constants
    assert (offset.value, offset.se) == (1.5, 0.0)
    assert slope.value == pytest.approx(-0.4, abs=4.0 * slope.se)


def test_a_simulator_is_asked_in_time_that_is_linear_in_the_runs():
    asked = []
    for runs in (made_runs()[:2], [*made_runs(), *made_runs(seed=6)][:6]):
        ASKED.clear()
        runs = [replace(run, name=f"{i}") for i, run in enumerate(runs)]
        diagnose(Simulator(("creep",)), runs, (), plan=False)
        asked.append(len(ASKED) / (len(runs) + 1))
    assert asked[1] == pytest.approx(asked[0], rel=0.2)


def _giving(**methods):
    kind = type("Giving", (OnRun,), methods)
    return type("Odd", (Simulator,), {"on": lambda self, run: kind(run)})(("creep",))


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (
            _giving(output=lambda s, c, e=(): np.full(len(s.run), np.nan)),
            "a: output .* gives nan at sample 1",
        ),
        (
            _giving(output=lambda s, c, e=(): np.zeros(5)),
            r"gives shape \(5,\); \(160,\)",
        ),
        (_giving(response=lambda s, *a: np.zeros(3)), "a: response to 'creep' .* gives shape"),
        (
            _giving(response=lambda s, *a: np.full(len(s.run), np.inf)),
            "'creep' .* gives inf",
        ),
        (
            _giving(nuisances=lambda s, c: {"line": "none"}),
            "nuisance 'line' .* gives str of <U4",
        ),
        (
            Simulator(("creep",), grade="excellent"),
            "grade is 'excellent'; grades are tactical",
        ),
        (Simulator(("creep",), memory_s=-1.0), "memory_s is -1.0; a number of 0 or above"),
        (Simulator(("creep",), noise=NoisePrior(float("nan"), 0.0, 0.0)), "N of its noise is nan"),
        (Simulator(("creep",), noise=NoisePrior(0.1, 0.0, 0.0, 0.5)), "factor_N of its noise is 0.5"),
        (
            Simulator(constants=(Constant("offset", "deg/h", 0.0, -3.0),)),
            "'offset' has mean 0.0 and sd -3.0",
        ),
        (Simulator(constants=2 * (Constant("offset", "deg/h", 0.0, 3.0),)), "stands there 2 times"),
    ],
)
def test_what_a_simulator_gives_amiss_is_told_by_its_name(model, message):
    runs = made_runs()
    with pytest.raises(InputError, match=message):
        diagnose(model, runs[:2], runs[2:], plan=False)
