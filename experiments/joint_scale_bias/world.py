"""The unit, the staircases and what is measured on them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.synthetic_world import programme
from fogml.arrays import FloatArray
from fogml.models.table import usable_rows
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.signals.averages import block_averages
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin

COLUMNS = ("T_in", "T_out", "rate")
PATENT_STEPS = tuple(range(-40, 71, 10))
SETTLE_S, LAST_S = 150, 300
"""A soak's residual is taken over so long, so long after its turns; runs are of 1 Hz [s]."""


def unit(settings: Mapping[str, Any], **changed: float) -> Twin:
    """The twin of the comparison, with settings of ``unit`` changed."""
    told = {**settings["unit"], **changed}
    sensors = Sensors(SensorErrors(noise=told["sensor_noise"], resolution=told["sensor_resolution"]))
    twin = Twin("joint", sensors=sensors).with_nominal(**told["nominal"]).with_noise(N=told["random_walk"])
    for effect, key in (("thermal_hysteresis", "bias_hysteresis"), ("sf_hysteresis", "scale_hysteresis")):
        if told[key] > 0.0:
            twin = twin.with_effect(effect, told[key], half_width=told["half_width"])
    return twin


def known_unit() -> Twin:
    """Without noise, bias 0.5 + 0.01 T deg/h, T in degC, scale factor of second order."""
    return Twin("known answers").with_nominal(e0=80.0, k1=3.0, k2=0.02, b0=0.75, b1=0.01)


def patent_staircase(turning: Collection[int] = PATENT_STEPS) -> dict[str, Any]:
    """The patent's programme, with turns in the soaks at these temperatures [degC] alone."""
    steps: list[Any] = [{"soak at 25 degC for 30 min": ["power on"]}]
    for temperature in PATENT_STEPS:
        soak, minute = ("1 h", 50) if temperature == PATENT_STEPS[0] else ("30 min", 20)
        steps.append(f"ramp to {temperature} degC at 1 degC/min")
        stay = f"soak at {temperature} degC for {soak}"
        turn = f"turn at -10 deg/s for 60 s, then 10 deg/s for 60 s, from minute {minute}"
        steps.append({stay: [turn]} if temperature in turning else stay)
    return {"name": "staircase", "start_temperature": "25 degC", "power": "off", "steps": steps}


def second_staircase(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Other steps, downwards, with other rates of chamber and table."""
    told = settings["second"]
    steps: list[Any] = [{"soak at 25 degC for 30 min": ["power on"]}]
    rate = told["rate"]
    for temperature in told["temperatures"]:
        steps.append(f"ramp to {temperature} degC at {told['ramp']} degC/min")
        turn = f"turn at {-rate} deg/s for 60 s, then {rate} deg/s for 60 s, from minute {told['turn_at']}"
        steps.append({f"soak at {temperature} degC for {told['soak']} min": [turn]})
    return {"name": "second", "start_temperature": "25 degC", "power": "off", "steps": steps}


@dataclass(frozen=True)
class Made:
    """A simulated run and its noise [deg/h], shape (n,)."""

    run: Run
    noise: FloatArray

    def floor(self, averaging_s: float) -> float:
        """Standard deviation of the averages of the noise realised at rest [deg/h]."""
        used = usable_rows(self.run, np.ones(len(self.run), dtype=bool))[0]
        averages = block_averages(self.run.time[used], self.noise[used], window_s=averaging_s)
        return float(averages.values[0].std())


def made(steps: Mapping[str, Any], twin: Twin, latitude: float, seed: int) -> Made:
    """A run at 1 Hz, input axis up at a latitude [deg]."""
    facts = Facts(axis="x", latitude=latitude, input_axis="up")
    found = simulate(steps, twin, sample_s=1.0, seed=seed, columns=COLUMNS, facts=facts, truth=True)
    assert found.truth is not None
    return Made(found.run, found.truth.noise)


def soak_residuals(run: Run, rate_deg_h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Temperature [degC] and mean residual [deg/h] of five minutes at rest after the turns of each soak."""
    turning = np.flatnonzero(run.rate != 0.0)
    ends = turning[np.diff(turning, append=len(run) + 1000) > SETTLE_S] + 1
    error, temperature = rate_deg_h - run.reference_deg_h, run.temperature("T")
    rows = [slice(end + SETTLE_S, end + SETTLE_S + LAST_S) for end in ends.tolist()]
    return (
        np.array([temperature[part].mean() for part in rows]),
        np.array([error[part].mean() for part in rows]),
    )


def earth_in_rate(run: Run) -> Run:
    """The run with Earth rate written into its reference by hand, as no side file tells it."""
    earth = (run.reference_deg_h - 3600.0 * run.rate)[0] / 3600.0
    return without_facts(run).with_columns(rate=run.rate + earth)


def without_facts(run: Run) -> Run:
    """The run without latitude and attitude."""
    plain = run.facts.model_copy(update={"latitude": None, "input_axis": None})
    return Run(run.name, run.columns, plain)


def only_inner(run: Run) -> Run:
    """The run with the inner sensor alone."""
    return Run(run.name, {k: v for k, v in run.columns.items() if k != "T_out"}, run.facts)


def set_point() -> FloatArray:
    """The steps of the patent's staircase as the chamber is told them [degC], 1 Hz."""
    steps: list[tuple[str, float, float]] = []
    for temperature in PATENT_STEPS[1:]:
        steps += [("ramp", temperature, 1.0), ("soak", 30.0, 0.0)]
    return programme(steps, PATENT_STEPS[0], 1.0)
