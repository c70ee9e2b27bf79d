"""Arguments of the procedures' functions that are none: refused, by name, in Python as on a command line."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.lab.forms import multipoint_form
from fogml.lab.joint import two_step
from fogml.lab.navigation import constant_drift
from fogml.lab.north import Scheme
from fogml.lab.north_positions import north_from_positions
from fogml.lab.rate_json import rate_json
from fogml.monitor.watch import watch
from fogml.runs.run import Run
from fogml.validation.index_search import train_until_index


def seek(name: str) -> Run:
    """Four stays of a minute in positions 1 to 4, told by a column or by the table's angle."""
    place = np.repeat([0, 1, 2, 3], 60)
    told = place + 1.0 if name == "position" else -90.0 * place
    gyro = 10.0 * np.cos(np.radians(30.0 + 90.0 * place)) + 0.01 * np.random.default_rng(0).normal(size=240)
    return Run("seek", {"time": np.arange(240.0), "gyro": gyro, name: told})


def ladder() -> Run:
    rate = np.repeat([0.0, 10.0, -10.0, 20.0, -20.0, 0.0], 60)
    noise = np.random.default_rng(1).normal(size=len(rate))
    columns = {"time": np.arange(360.0), "gyro": 3600.0 * rate + noise, "rate": rate, "T": np.full(360, 25.0)}
    return Run("ladder", columns)


BAD = (np.nan, np.inf, -np.inf)
CASES: list[tuple[Callable[[Any], Any], tuple[float, ...], str]] = [
    (lambda x: rate_json([ladder()], source="", settle_s=x), (*BAD, -1.0), "settle"),
    (lambda x: north_from_positions(seek("position"), order_deg=(0, 90, 180, x)), BAD, "order"),
    (lambda x: north_from_positions(seek("position"), order_deg=()), (0.0,), "three different angles"),
    (lambda x: Scheme((0.0, 90.0, 180.0, x)), BAD, "order"),
    (lambda x: north_from_positions(seek("angle"), angle_tolerance_deg=x), (*BAD, 0.0, -1.0), "tolerance"),
    (lambda x: constant_drift(x, [1.0], 40.0), BAD, "drift"),
    (lambda x: constant_drift(1.0, [1.0, x], 40.0), (*BAD, -1.0), "hours"),
    (lambda x: two_step(ladder(), order=x), (*BAD, -1, 1.5), "order"),
    (lambda x: multipoint_form(["T1"], x, 1), (*BAD, 0, 1.5), "order"),
    (lambda x: watch([], bias_limit=x), (*BAD, 0.0, -1.0), "bias limit"),
    (lambda x: train_until_index(ladder(), x), (*BAD, 0.0, -1.0), "design index"),
]


@pytest.mark.parametrize(("call", "values", "named"), CASES)
def test_a_number_that_is_none_is_refused_by_name(call, values, named: str) -> None:
    for value in values:
        with pytest.raises(InputError, match=re.escape(named)):
            call(value)
