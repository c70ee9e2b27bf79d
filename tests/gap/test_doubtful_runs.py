"""A diagnosis says what is doubtful in its runs before what it assumed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from fogml.gap.reports import assumed
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
