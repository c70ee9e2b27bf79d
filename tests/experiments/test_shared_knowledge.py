"""Shared knowledge: the ideal check is the likelihood ratio that it says it is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from experiments.shared_knowledge.ideal import nats_for_odd
from experiments.shared_knowledge.page import page
from experiments.shared_knowledge.units import MEAN, NOISE, SPREAD, TRAIN_RATE, run, unit

HOURS = 0.75


def _together(values: dict) -> np.ndarray:
    return np.array([*values["polynomial"], values["rate"], values["product"]])


@pytest.mark.parametrize(("seed", "far"), [(1, 1.0), (2, 6.0)])
def test_the_ideal_check_is_the_ratio_of_two_normal_densities(seed, far):
    world = unit(seed, far)
    made = run(world, 2 * seed, TRAIN_RATE, HOURS)
    temperature = made.columns["T"]
    # What one constant does is what a unit with it and without differ by, its noise the same.
    columns = []
    for place in range(6):
        pair = []
        for size in (0.0, 1.0):
            constants = np.zeros(6)
            constants[place] = size
            other = type(world)(
                polynomial=tuple(constants[:4]), gradient=0.0, rate=constants[4], product=constants[5]
            )
            pair.append(other.drift(made.time, temperature, temperature))
        columns.append(pair[1] - pair[0])
    matrix = np.column_stack(columns)
    densities = [
        multivariate_normal(
            matrix @ _together(MEAN),
            NOISE**2 * np.eye(len(made))
            + (width * matrix * _together(SPREAD)) @ (width * matrix * _together(SPREAD)).T,
        ).logpdf(made.gyro)
        for width in (3.0, 1.0)
    ]
    assert nats_for_odd(made, HOURS, 3.0) == pytest.approx(densities[0] - densities[1], abs=1e-5)


def _row(far: float, hours: float, seed: int, drawn: float, **more: object) -> dict:
    row = {
        "seed": seed,
        "far": far,
        "hours": hours,
        "left": False,
        "told": hours < 6.0,
        "agreement": 0.5,
        "nats": {"3": -1.0 - seed, "6": -2.0 - seed},
        "before": 2.0,
        "alone": 1.0,
        "drawn": drawn,
        "anyway": drawn,
        "auto": 1.0,
        "rms_alone": 1.0,
        "rms_drawn": drawn,
        "half": 0.5 * (1.0 + drawn),
        "shown_alone": 1.0,
        "shown_drawn": 1.0,
        "floor": 0.1,
    }
    return {**row, **more}


def test_the_page_counts_harm_and_benefit():
    rows = [
        _row(far, hours, seed, 1.3 if far == 3.0 and seed == 1 and hours == 1.5 else 0.9)
        for far in (1.0, 3.0, 6.0)
        for hours in (1.5, 6.0)
        for seed in range(4)
    ]
    text = page(rows, fleet=24, averaging_s=100.0)
    assert "Of those 16 the fleet made 15 better by more than 5 % and 1 worse" in text
    assert "fogml's | 0.0% | 0.0% | 1 of 16 | 1.30 |" in text
    assert "| 1 | 3 | 1.5 | 1.30 | 1.00 | 50% | -2.0 | 50% |" in text
    assert "In 1 of these 1" in text
