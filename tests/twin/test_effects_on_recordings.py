"""What effects answer on plain recordings, without nodes, drives and facts: numbers, or exactly nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.twin.chain import through_chain
from fogml.twin.inputs import Inputs
from fogml.twin.nominal import NominalConstants, temperature_slopes
from fogml.twin.registry import effects
from fogml.twin.replay import inputs_of_run
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin

PROGRAMME = [
    "soak at 25 degC for 1 h",
    "ramp to -40 degC at 1 degC/min",
    {"soak at -40 degC for 2 h": ["turn at 10 deg/s for 60 s, then -10 deg/s for 60 s, from minute 60"]},
    "ramp to 60 degC at 1 degC/min",
    "soak at 60 degC for 2 h",
]
UNIT = Twin(nominal=NominalConstants(100.0, 20.0, 0.2, 2.0, 0.02, 2e-4, 0.3, 1.0))
MADE = simulate(PROGRAMME, UNIT, sample_s=10.0).run
UNSEEN = {"thermal_shock", "moisture", "warmup_bias", "vibration_rectification"}
"""Candidates that a run with table rate and coil, case temperatures shows nothing of: none of its ramps is
a shock, and humidity, power-on and vibration are not recorded."""


def recording(*names: str, rows: object = slice(None)) -> Run:
    columns = {"time": MADE.time, "gyro": MADE.gyro, **{name: MADE.columns[name] for name in names}}
    return Run("plain", {name: values[rows] for name, values in columns.items()}, Facts())  # type: ignore[index]


def one_sensor(run: Run) -> Run:
    return Run(run.name, {("T" if k == "T_in" else k): v for k, v in run.columns.items()}, run.facts)


def uneven() -> np.ndarray:
    kept = np.sort(np.random.default_rng(0).permutation(len(MADE))[: int(0.7 * len(MADE))])
    return kept[(kept < 900) | (kept > 1080)]


RUNS = {
    "T alone": one_sensor(recording("T_in")),
    "two faces": recording("T_in", "T_out"),
    "uneven with gaps": one_sensor(recording("T_in", rows=uneven())),
    "uneven, table": recording("rate", "T_in", "T_out", rows=uneven()),
    "table": recording("rate", "T_in", "T_out", "T_case"),
    "two samples": one_sensor(recording("T_in", rows=slice(500, 502))),
    "at rest": Run("rest", {"time": MADE.time, "gyro": MADE.gyro, "T": np.full(len(MADE), 25.1)}, Facts()),
}


def asked(run: Run) -> Inputs:
    """Inputs with what effects of the later stages meet."""
    inputs, _ = inputs_of_run(run)
    met = through_chain(UNIT, inputs, inputs).output
    return replace(inputs, output=met, slopes=temperature_slopes(inputs, UNIT.nominal))


@pytest.mark.parametrize("name", RUNS)
def test_responses_are_finite_and_vanish_exactly_or_not_at_all(name: str) -> None:
    given = asked(RUNS[name])
    for id, declared in effects().items():
        for grade in ("tactical", "navigation"):
            found = declared.response(given.afresh(), **declared.default_shape(grade))  # type: ignore[arg-type]
            assert found.shape == (len(given),) and np.isfinite(found).all(), id
            # A rest of rounding would be taken for a response.
            assert not found.any() or np.abs(found).max() > 1e-12, id


def test_what_a_run_with_table_and_two_faces_shows_nothing_of() -> None:
    given = asked(RUNS["table"])
    silent = {
        id
        for id, declared in effects().items()
        if declared.candidate
        and declared.stage != "noise"
        and not declared.response(given.afresh(), **declared.default_shape()).any()
    }
    assert silent == UNSEEN
