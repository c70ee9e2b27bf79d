"""The start-up at room temperature, which the paper tells of in a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from experiments.multipoint_table.__main__ import SAMPLE_S, SENSORS, programme, unit
from fogml.arrays import FloatArray
from fogml.lab.forms import multipoint_form
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.signals.averages import block_averages
from fogml.twin.plant.heat import SelfHeating
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin

AVERAGING_S = 100.0
FORMS = {
    f"{points} point{'s' if points > 1 else ''} {order}/{rate}": multipoint_form(
        SENSORS[:points], order, rate
    )
    for points in (1, 2, 4)
    for order, rate in ((5, 3), (2, 1))
}


def heated(settings: Mapping[str, Any], hidden: bool) -> Twin:
    """The unit with electronics that warm up, and a part of the warm-up that no coil sensor shows."""
    told = settings["start_up"]
    twin = unit()
    heating = SelfHeating(told["steady_power"], told["initial_power"], told["time_constant"])
    twin = replace(twin, plant=replace(twin.plant, heating=heating))
    return twin.with_effect("warmup_bias", told["hidden"]) if hidden else twin


def cold_start(ambient: float, hours: float) -> dict[str, Any]:
    """Power-on of a unit that has been at an ambient temperature for long."""
    steps = [{f"soak at {ambient} degC for {hours} h": ["power on"]}]
    return {"name": "start-up", "start_temperature": f"{ambient} degC", "power": "off", "steps": steps}


def start_up(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Standard deviation of 100 s averages [deg/h] on start-ups, by form and what it was fitted to."""
    told = settings["start_up"]
    found: dict[str, Any] = {}
    for hidden in (False, True):
        twin = heated(settings, hidden)
        ambients = told["ambients"]
        tests = {
            f"{ambient} degC": _run(cold_start(ambient, told["hours"]), twin, 20 + k)
            for k, ambient in enumerate(ambients)
        }
        middle = ambients[len(ambients) // 2]
        start, cycle = _run(cold_start(middle, told["hours"]), twin, 10), _run(programme(1.0), twin, 11)
        training = {
            f"a start-up at {middle} degC": [start],
            "the thermal cycle": [cycle],
            "both": [start, cycle],
        }
        nothing = {name: _stability(run, run.error_deg_h) for name, run in tests.items()}
        rows = {"none": {"": nothing}}
        for source, runs in training.items():
            for label, text in FORMS.items():
                model = make_model("polynomial", text, parameters={"ridge": 0.0}).fit(runs)
                scored = {}
                for name, test in tests.items():
                    evaluation = model.evaluate(test)
                    left = np.where(evaluation.full, test.error_deg_h - evaluation.drift, np.nan)
                    scored[name] = _stability(test, left)
                rows.setdefault(label, {})[source] = scored
        found["with a hidden part" if hidden else "heat alone"] = rows
    return found


def curve(settings: Mapping[str, Any]) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Time [h], and the output before and after two forms fitted to the cycle, in averages of 100 s."""
    told = settings["start_up"]
    twin = heated(settings, hidden=False)
    run = _run(cold_start(25, told["hours"]), twin, 21)
    cycle = _run(programme(1.0), twin, 11)
    series = {"before": run.error_deg_h}
    for label in ("1 point 2/1", "4 points 2/1"):
        model = make_model("polynomial", FORMS[label], parameters={"ridge": 0.0}).fit(cycle)
        series[label] = model.compensate(run).compensated - run.reference_deg_h
    means = {name: block_averages(run.time, y, window_s=AVERAGING_S) for name, y in series.items()}
    return means["before"].time_s / 3600.0, {name: mean.values[0] for name, mean in means.items()}


def _stability(run: Run, error_deg_h: FloatArray) -> float:
    """Standard deviation of averages of the rows that are not NaN [deg/h]."""
    told = np.isfinite(error_deg_h)
    return float(block_averages(run.time[told], error_deg_h[told], window_s=AVERAGING_S).values[0].std())


def _run(steps: Any, twin: Twin, seed: int) -> Run:
    return simulate(steps, twin, sample_s=SAMPLE_S, seed=seed, columns=SENSORS).run
