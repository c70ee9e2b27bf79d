"""Judgements with known figures, for the tests of pages: closed-form drift, seeded noise."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from fogml.runs.findings import Finding
from fogml.validation.results import AveragedSeries, Judgement, LimitOutcome, Metrics, RunJudgement

AVERAGING_S = 100.0
FLOOR = 0.0075


def metrics_of(values: np.ndarray, **more: float) -> Metrics:
    """The figures of averages, by their definitions."""
    bias, stability = float(np.mean(values)), float(np.std(values))
    return Metrics(bias, stability, float(np.ptp(values)), float(np.hypot(bias, stability)), **more)


def programme(n: int, start_deg_c: float, stop_deg_c: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Temperature [degC], its rate [degC/min] and the regime of a soak, a ramp up, a soak, a ramp down."""
    parts = np.array_split(np.arange(n), 5)
    temperature, regime = np.empty(n), np.empty(n, dtype="<U10")
    ends = (start_deg_c, start_deg_c, stop_deg_c, stop_deg_c, start_deg_c, start_deg_c)
    names = ("start_up", "ramp_up", "soak", "ramp_down", "soak")
    for part, name, (a, b) in zip(parts, names, pairwise(ends), strict=True):
        temperature[part] = np.linspace(a, b, len(part))
        regime[part] = name
    rate = np.gradient(temperature) / (AVERAGING_S / 60.0)
    return temperature, rate, regime


def judged_run(
    name: str = "b.csv",
    *,
    left: float = 0.01,
    offset: float = 0.0,
    outside: float = 0.0,
    gap: bool = False,
    n: int = 360,
    seed: int = 0,
    unit: str | None = "FOG-0417",
    findings: tuple[Finding, ...] = (),
    notes: tuple[str, ...] = (),
) -> RunJudgement:
    """A run with a loop in T of half-width 0.3 deg/h, of which a share ``left`` is left after."""
    random = np.random.default_rng(seed)
    temperature, rate, regime = programme(n, -20.0, 60.0)
    time = AVERAGING_S * (np.arange(n) + 0.5)
    keep = np.ones(n, dtype=bool)
    if gap:
        keep[n // 2 : n // 2 + n // 10] = False
    drift = 0.004 * temperature + 0.4 * rate
    after = offset + left * drift + FLOOR * random.standard_normal(n)
    before = drift + after - left * drift
    flag = np.zeros(n, dtype=np.int8)
    flag[temperature >= np.quantile(temperature, 1.0 - outside) if outside else np.zeros(n, bool)] = 1
    width = np.full(n, 1.645 * FLOOR + 0.004)
    series = AveragedSeries(
        *(a[keep] for a in (time, temperature, rate, before, after, drift, -width, width, regime, flag))
    )
    return RunJudgement(
        run=name,
        unit=unit,
        axis="x",
        averaging_s=AVERAGING_S,
        before=metrics_of(
            before[keep], bias_stability_10s=0.33, temperature_sensitivity=0.0041, hysteresis=0.02
        ),
        after=metrics_of(
            after[keep], bias_stability_10s=0.03, temperature_sensitivity=0.0002, hysteresis=0.001
        ),
        floor=FLOOR,
        outside_training=outside,
        rows_used=36000,
        rows_left_out=128,
        bias_reference="training mean",
        series=series,
        coverage=float(np.mean(np.abs(series.after) <= series.upper)),
        findings=findings,
        notes=notes,
    )


def judgement(test_runs: int = 1, *, limit: float = 0.05, kind: str = "rbf", **run: Any) -> Judgement:
    """A judgement of ``test_runs`` test runs with a design index and a limit on bias stability."""
    names = ["b.csv", "c.csv", "d.csv", "e.csv", "f.csv"][:test_runs]
    test = tuple(judged_run(name, seed=1 + i, **run) for i, name in enumerate(names))
    rms = max(r.after.rms for r in test)
    stability = max(r.after.bias_stability for r in test)
    return Judgement(
        model={
            "kind": kind,
            "features": ["T", "dT", "T*dT"],
            "parameters": 41,
            "bytes": 344,
            "unit": "FOG-0417",
            "axis": "x",
            "window_s": 128.0,
            "rows": 35872,
            "box": {"T": [-20.0, 60.0], "dT": [-0.67, 0.67]},
            "interval": {"half_width_90": 0.0163, "averaging_s": 100.0, "residuals": 358, "folds": 5},
            "notes": [],
        },
        train=(judged_run("a.csv", seed=9),),
        test=test,
        design_index=LimitOutcome("rms", limit, rms, rms <= limit),
        limits=(LimitOutcome("bias_stability", 0.02, stability, stability <= 0.02),),
        notes=("Earth rate is not known: biases are relative to the training runs' mean.",),
    )


def linear_judgement() -> Judgement:
    """A judgement of a linear model that tells its coefficients."""
    base = judgement(kind="M2")
    coefficients = {
        "1": {"value": 0.1, "se": 0.001},
        "T": {"value": 0.004, "se": 0.0001},
        "dT": {"value": 0.4, "se": 0.002},
    }
    model = {
        **base.model,
        "features": ["T", "dT"],
        "parameters": 3,
        "bytes": 24,
        "coefficients": coefficients,
    }
    return Judgement(model=model, train=base.train, test=base.test, notes=base.notes)
