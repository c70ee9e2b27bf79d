"""A diagnosis says what is doubtful in its runs before what it assumed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fogml.gap.sentences import assumed, other_way
from fogml.runs.checks import check_run
from fogml.runs.run import Run


def said(temperature: Any) -> str:
    rng = np.random.default_rng(0)
    time = np.arange(3000.0)
    run = Run.from_columns("hot.csv", time=time, gyro=rng.normal(5.0, 0.1, 3000), T=temperature(time))
    run = run.with_findings(check_run(run))
    rows = SimpleNamespace(run=run, masked={}, readings={"T_electronics": None}, row_s=10.0)
    priors = SimpleNamespace(described=lambda: ["none"])
    setting = SimpleNamespace(scene=SimpleNamespace(runs=[rows]), priors=priors, widened={})
    found: Any = SimpleNamespace(setting=setting, points=SimpleNamespace(source="the run"))
    return assumed(found, ())[0]


def test_what_makes_every_figure_wrong_is_said_first() -> None:
    assert said(lambda time: 293.15 + time / 200.0).startswith("hot.csv: 'T' is stated in degC")
    assert said(lambda time: 20.0 + time / 200.0).startswith("Runs were brought to means")


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (1.0, ""),
        (0.4, ""),
        (-0.1, ""),
        (0.0, ""),
        (-1.1, "a sign may be wrong"),
        (1.0 / 3600.0, "3600 times less than was recorded: a unit may be wrong"),
        (-206264.8, "times more and of the other sign than was recorded"),
    ],
)
def test_a_replay_of_another_sign_or_unit_is_told(times: float, said: str) -> None:
    rng = np.random.default_rng(3)
    drift = [np.cumsum(rng.standard_normal(400)) for _ in range(2)]
    recorded = [d + rng.normal(9.0, 0.5, 400) for d in drift]
    told = other_way(recorded, [times * d + 4.0 for d in drift])
    assert said in told and bool(told) == bool(said)
