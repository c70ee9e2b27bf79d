"""Jobs of the twin: simulation and replay beside a loop over samples, noise beside colorednoise."""

from __future__ import annotations

import math
import os
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from experiments.benchmarks.harness import Job, Timed, Work
from fogml.arrays import FloatArray
from fogml.runs.run import Run

IMU_SIMULATOR = "GNSS_INS_SIM"
"""Environment variable with the folder of a checkout of gnss-ins-sim."""
_LOOPED = 100_000
_COLUMNS = ("T_in", "T_out", "rate")
_STEPS: list[Any] = [
    "soak at 25 degC for 1 h",
    "ramp to -40 degC at 1 degC/min",
    {"soak at -40 degC for 2 h": ["turn at 10 deg/s for 60 s, then -10 deg/s for 60 s, from minute 60"]},
    "ramp to 60 degC at 1 degC/min",
    {"soak at 60 degC for 2 h": ["turn at 10 deg/s for 60 s, then -10 deg/s for 60 s, from minute 60"]},
    "ramp to 25 degC at 1 degC/min",
    "soak at 25 degC for 100 min",
]


def _programme() -> Any:
    from fogml.twin.programme import load_programme

    return load_programme(_STEPS)


def _everything() -> Any:
    """The tactical twin with every effect of the catalogue on."""
    from fogml.twin.registry import effects
    from fogml.twin.twin_file import load_twin

    twin = load_twin("tactical")
    for id, declared in effects().items():
        if id not in twin.settings and not set(declared.conflicts) & set(twin.settings):
            twin = twin.with_effect(id)
    return twin


def _shared() -> Any:
    """What the loop over samples does as well: plant, nominal gyro, hysteresis."""
    from fogml.twin.twin_file import load_twin

    twin = load_twin("tactical").with_noise(N=0.0, B=0.0, K=0.0, Q=0.0)
    plant = replace(twin.plant, airflow=type(twin.plant.airflow)())
    bare = replace(twin, plant=plant, settings={}).with_nominal(m=0.0)
    return bare.with_effect("thermal_hysteresis", 0.12, half_width=8.0)


def _loop(twin: Any, timeline: Any, count: int) -> FloatArray:
    """The same by a plain loop: nodes by explicit Euler, one sample after another."""
    block = timeline.block(0, count)
    network, c = twin.network, twin.nominal
    nodes = network.nodes
    place = {name: i for i, name in enumerate(nodes)}
    conduction, boundary = network.matrices()
    k, b = conduction.tolist(), boundary[:, 0].tolist()
    capacity = list(network.capacities.values())
    heated, watt = place[network.heating.node], network.heating.steady_w
    rises = network.steady_rises()
    state = [float(block.set_point[0]) + rises[name] * watt for name in nodes]
    dt, play, out = timeline.sample_s, math.nan, []
    rates, chamber = block.table_rate.tolist(), block.set_point.tolist()
    inner, outer = place["T_in"], place["T_out"]
    for i in range(count):
        u = state[inner] - 25.0
        if math.isnan(play):
            play = state[inner]
        play = min(max(play, state[inner] - 8.0), state[inner] + 8.0)
        bias = c.b0 + u * (c.b1 + c.b2 * u) + c.g * (state[inner] - state[outer])
        bias += 0.12 * (play - state[inner]) / 8.0
        scale = 1.0 + 1e-6 * (c.e0 + u * (c.k1 + u * c.k2))
        out.append(scale * (3600.0 * rates[i] + _EARTH) + bias)
        flows = [
            b[j] * chamber[i] - sum(k[j][m] * state[m] for m in range(len(state))) for j in range(len(state))
        ]
        flows[heated] += watt
        state = [x + dt * flow / heat for x, flow, heat in zip(state, flows, capacity)]
    return np.array(out)


_EARTH = 15.041067 * math.sin(math.radians(39.9))


def _shared_part(quick: bool, folder: Path) -> Work:
    from fogml.twin.simulate import simulate
    from fogml.twin.timeline import Timeline

    programme, twin = _programme(), _shared()
    clock = Timeline(programme, 20.0 if quick else 1.0)

    def ours() -> FloatArray:
        return simulate(programme, twin, sample_s=clock.sample_s, columns=_COLUMNS).run.gyro

    def check(a: FloatArray, b: FloatArray) -> str:
        # Euler steps are off by about half a step of the fastest change of temperature, 1 degC/min.
        allowed = 0.5 * clock.sample_s / 60.0 * (twin.nominal.b1 + 0.12 / 8.0 + 0.05) + 1e-3
        turning = np.abs(a - np.median(a)) > 100.0
        worst = float(np.abs(a - b)[~turning].max())
        assert worst <= 4.0 * allowed, worst
        return f"outputs of {len(a)} samples to {worst:.1g} deg/h: the loop steps by Euler"

    return Work(ours, lambda: _loop(twin, clock, len(clock)), check)


def _every_effect(samples: int, quick_samples: int, quick: bool) -> Work:
    from fogml.twin.simulate import simulate
    from fogml.twin.timeline import Timeline

    programme, count = _programme(), quick_samples if quick else samples
    sample_s = programme.total_s / count
    twin, shared = _everything(), _shared()
    looped = min(count, 1000 if quick else _LOOPED)

    def ours() -> int:
        return len(simulate(programme, twin, sample_s=sample_s, columns=_COLUMNS).run)

    def plain() -> Timed:
        import time

        begin = time.perf_counter()
        _loop(shared, Timeline(programme, programme.total_s / looped), looped)
        return Timed((time.perf_counter() - begin) * count / looped, count)

    def check(a: int, b: int) -> str:
        assert a == b
        return f"{a} samples, {len(twin.settings)} effects; the loop has one and was timed on {looped}"

    return Work(ours, plain, check)


def _ten_hours(quick: bool, folder: Path) -> Work:
    return _every_effect(36_000, 2_000, quick)


def _ten_million(quick: bool, folder: Path) -> Work:
    return _every_effect(10_000_000, 5_000, quick)


def _replay(quick: bool, folder: Path) -> Work:
    from fogml.twin.replay import replay
    from fogml.twin.simulate import simulate

    twin = _everything()
    run = simulate(_programme(), twin, sample_s=60.0 if quick else 1.0).run
    widths = iter(np.linspace(3.0, 20.0, 1000).tolist())
    replay(twin, run)

    def ours() -> FloatArray:
        changed = twin.with_effect("thermal_hysteresis", half_width=next(widths))
        return replay(changed, run)

    def plain() -> FloatArray:
        # A run that is new to the replay: every signature is worked out.
        return replay(twin, Run(run.name, run.columns, run.facts))

    def check(a: FloatArray, b: FloatArray) -> str:
        apart = float(np.abs(a - b).max())
        assert a.shape == b.shape and 0.0 < apart < 1.0, apart
        size = f"{len(a)} samples, {len(twin.settings)} effects"
        return f"{size}; half widths of 3 and 8 degC differ by {apart:.2g} deg/h"

    return Work(ours, plain, check)


def _flicker(quick: bool, folder: Path) -> Work:
    from fogml.signals.allan import allan_deviation
    from fogml.signals.random_noise import Flicker

    count = 100_000 if quick else 10_000_000

    def ours() -> FloatArray:
        return Flicker(1.0, 1.0, np.random.default_rng(1)).block(count)

    def plain() -> FloatArray:
        import colorednoise

        return np.asarray(colorednoise.powerlaw_psd_gaussian(1, count, random_state=1))

    def check(a: FloatArray, b: FloatArray) -> str:
        taus = np.array([10.0, 100.0, 1000.0])
        found = [allan_deviation(x, 1.0, taus=taus).adev for x in (a, b)]
        # colorednoise gives unit variance: the shape alone can be compared.
        flat = [adev / adev[0] for adev in found]
        assert np.allclose(found[0], 0.664, rtol=0.1) and np.allclose(*flat, rtol=0.1)
        return "Allan deviations flat from 10 to 1000 samples, ours at 0.664"

    return Work(ours, plain, check)


def _imu_simulator_missing() -> str | None:
    """Why gnss-ins-sim can't be measured here."""
    named = os.environ.get(IMU_SIMULATOR)
    if named and not (Path(named) / "gnss_ins_sim" / "pathgen" / "pathgen.py").is_file():
        return f"{IMU_SIMULATOR} is '{named}', which holds no gnss_ins_sim/pathgen/pathgen.py"
    if not named and find_spec("gnss_ins_sim") is None:
        return f"{IMU_SIMULATOR} is not set: the folder of a checkout of github.com/Aceinna/gnss-ins-sim"
    return None


def _imu_noise(quick: bool, folder: Path) -> Work:
    named = os.environ.get(IMU_SIMULATOR)
    if named and named not in sys.path:
        sys.path.append(named)
    from gnss_ins_sim.pathgen import pathgen

    from fogml.signals.random_noise import gauss_markov

    count = 20_000 if quick else 1_000_000
    correlation, drift = 100.0, 1.0

    def ours() -> FloatArray:
        rng = np.random.default_rng(1)
        return np.stack([gauss_markov(rng, count, 1.0, drift, correlation) for _ in range(3)], axis=1)

    def plain() -> FloatArray:
        return np.asarray(pathgen.bias_drift([correlation] * 3, [drift] * 3, count, 1.0))

    def check(a: FloatArray, b: FloatArray) -> str:
        assert a.shape == b.shape and 0.7 < np.std(a) < 1.3 and 0.3 < np.std(b) / np.std(a) < 3.0
        return f"standard deviations {np.std(a):.2f} and {np.std(b):.2f}"

    return Work(ours, plain, check)


_LOOP = "a loop over samples in Python, plant by Euler steps"
TWIN_JOBS: tuple[Job, ...] = (
    Job(
        "twin-shared",
        "simulate 10 h at 1 Hz: plant, nominal gyro, hysteresis",
        "simulate",
        _LOOP,
        _shared_part,
        least_ratio=10.0,
    ),
    Job(
        "twin-ten-hours",
        "simulate 10 h at 1 Hz, every effect on",
        "simulate",
        f"{_LOOP}, with hysteresis alone",
        _ten_hours,
        limit_s=0.5,
    ),
    Job(
        "twin-ten-million",
        "simulate 10,000,000 samples, every effect on",
        "simulate, the run in memory",
        f"{_LOOP}, with hysteresis alone, timed on a part",
        _ten_million,
        limit_s=10.0,
        limit_mb=1000.0,
        memory=True,
    ),
    Job(
        "twin-replay",
        "replay 10 h at 1 Hz, every effect on, the shape of one changed",
        "replay of a run replayed before",
        "replay of a new run",
        _replay,
        limit_s=0.05,
    ),
    Job(
        "flicker",
        "flicker noise, 10,000,000 samples",
        "fogml.signals.random_noise.Flicker",
        "colorednoise.powerlaw_psd_gaussian",
        _flicker,
    ),
    Job(
        "gauss-markov",
        "Gauss-Markov bias drift, 1,000,000 samples of three axes",
        "fogml.signals.random_noise.gauss_markov",
        "bias_drift of gnss-ins-sim, a checkout of its repository",
        _imu_noise,
        missing=_imu_simulator_missing,
    ),
)
