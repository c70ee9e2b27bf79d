"""Diagnoses with known figures, for the tests of pages."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fogml.gap.result import (
    CandidateEvidence,
    Diagnosis,
    Estimate,
    Found,
    HowFar,
    NoiseReport,
    RunAmplitude,
    SeparatingRun,
    Unknown,
    Verdict,
)
from fogml.gap.result_parts import (
    ConstantFit,
    Course,
    GapSegment,
    RunSeries,
    Share,
    TemperatureExcess,
    TimescaleExcess,
    Where,
)

FLOOR = 0.0075


def series(run: str, role: str = "fit", *, n: int = 240, left: float = 0.0, note: str = "") -> RunSeries:
    """A run with a loop in temperature of which a share ``left`` is left after."""
    random = np.random.default_rng(len(run))
    time = 100.0 * (np.arange(n) + 0.5)
    temperature = 25.0 + 30.0 * np.sin(2.0 * np.pi * np.arange(n) / n)
    rate = np.gradient(temperature) * 0.6
    noise = FLOOR * random.standard_normal(n)
    loop = 0.05 * np.cos(2.0 * np.pi * np.arange(n) / n)
    recorded = 2.0 + 0.01 * temperature + loop + noise
    return RunSeries(
        run=run,
        role="held_out" if role == "held_out" else "fit",
        averaging_s=100.0,
        time_s=time,
        temperature_degc=temperature,
        rate_degc_min=rate,
        regime=np.where(rate > 0.05, 1, np.where(rate < -0.05, 2, 3)).astype(np.int8),
        recorded=recorded,
        replayed_before=np.zeros(n),
        replayed_recalibrated=recorded - loop - noise,
        replayed_after=recorded - left * loop - noise,
        gap_recalibrated=loop + noise,
        gap_after=left * loop + noise,
        floor=FLOOR,
        gyro="FOG-0417",
        axis="x",
        note=note,
    )


def hysteresis(members: tuple[str, ...] = ("thermal_hysteresis",), **changes: Any) -> Found:
    """Hysteresis of the bias, found on two runs."""
    values: dict[str, Any] = {
        "effect": "thermal_hysteresis",
        "stage": "bias",
        "members": members,
        "probability": 0.972,
        "prior_probability": 0.03 * len(members),
        "amplitude": Estimate(0.0214, 0.0011, "deg/h"),
        "parameters": {"half_width": Estimate(9.12, 0.43, "degC")},
        "by_run": (RunAmplitude("a.csv", 0.0221, 0.0015), RunAmplitude("b.csv", 0.0206, 0.0017)),
    }
    return Found(**values | changes)


def diagnosis(
    verdict: Verdict = "explained",
    found: tuple[Found, ...] | None = None,
    unknown: float = 0.02,
    **changes: Any,
) -> Diagnosis:
    """A diagnosis of two runs with one held out."""
    if found is None:
        found = () if verdict in ("no_gap", "unknown") else (hysteresis(),)
    status = "named" if found else "no_sign"
    note = "synthetic: programme cycle, twin FOG-0417"
    values: dict[str, Any] = {
        "fit": ("a.csv", "b.csv"),
        "held_out": ("c.csv",),
        "noise_run": "static.csv",
        "held_out_is_part": False,
        "verdict": verdict,
        "found": found,
        "unknown": Unknown(unknown, "follows the direction of temperature change" if unknown > 0.05 else ""),
        "where": Where(
            stage=(Share("bias", 0.9), Share("sensor", 0.1)),
            regime=(
                Share("ramp_up", 0.7, (0.6, 0.8), 0.042, (0.038, 0.046), True),
                Share("soak", 0.3, (0.1, 0.5), 0.011, (0.0, 0.02), False),
            ),
            temperature=(
                TemperatureExcess(-10.0, 0.0, 0.031, True, 0.04, -0.03),
                TemperatureExcess(0.0, 10.0, 0.001, False, None, -0.01),
            ),
            timescale=(
                TimescaleExcess(100.0, 3.1, (2.8, 3.4), True),
                TimescaleExcess(1000.0, 1.2, (0.7, 1.7), False),
            ),
            segments=(GapSegment("a.csv", 5400.0, 9000.0, 0.033),),
        ),
        "how_far": (HowFar("c.csv", 100.0, 2.31, 0.0361, 0.0079, FLOOR, 0.984, (0.961, 1.003)),),
        "undetectable": ("sensor_placement",),
        "separating_run": None,
        "constants": (
            ConstantFit("e0", "ppm", 0.0, 500.0, 0.4, 499.0),
            ConstantFit("b0", "deg/h", 0.0, 5.0, 2.014, 0.021),
        ),
        "evidence": (
            CandidateEvidence(
                "thermal_hysteresis", "Thermal hysteresis of the bias", "bias", 412.0, 0.97, 31.0, status
            ),
            CandidateEvidence(
                "sensor_lag", "Lag of the temperature sensors", "sensor", 51.0, 0.0, 8.0, "no_sign"
            ),
            CandidateEvidence(
                "sensor_placement",
                "Place of the temperature sensors",
                "sensor",
                -1.1,
                0.0,
                0.02,
                "undetectable",
            ),
            CandidateEvidence("sf_asymmetry", "Asymmetry", "scale_factor", 0.0, 0.0, 0.0, "in_constants"),
        ),
        "noise": NoiseReport(
            coefficients={"N": 0.0012, "B": 0.004, "K": 0.002},
            relative_se={"N": 0.02, "B": 0.2, "K": 0.5},
            source="static run static.csv",
            white=True,
            p_value=0.41,
            lags_s=(10.0, 20.0, 40.0),
            autocorrelation=(0.01, -0.02, 0.005),
            scales_s=(10.0, 20.0, 40.0, 80.0),
            variance_ratio=(1.01, 0.97, 1.1, 0.9),
            samples=2400,
        ),
        "effects": (),
        "series": (
            series("a.csv", note=note),
            series("b.csv", note=note),
            series("c.csv", "held_out", note=note),
        ),
        "assumed": ("Earth rate is known.",),
    }
    return Diagnosis(**values | changes)


def every_diagnosis() -> dict[str, Diagnosis]:
    """One of each verdict, with what else a page may have to show."""
    pair = hysteresis(("thermal_hysteresis", "sensor_lag"))
    separating = SeparatingRun(
        ("thermal_hysteresis", "sensor_lag"),
        "schema: fogml.programme/1\nname: separating-run\n",
        6.2,
        11.5,
        ("soak at 25 degC for 1 h", "ramp to 60 degC at 2 degC/min"),
        ({"summary": "one ramp rate", "hours": 9.0, "programme": "name: b\n", "distance": 4.1},),
    )
    at_floor = (HowFar("c.csv", 100.0, 2.31, 0.0076, 0.0076, FLOOR, None, None, "at the floor"),)
    return {
        "explained": diagnosis(),
        "ambiguous": diagnosis("ambiguous", (pair,), separating_run=separating),
        "partly_explained": diagnosis("partly_explained", unknown=0.83),
        "unknown": diagnosis("unknown", unknown=0.91),
        "no_gap": diagnosis("no_gap", how_far=at_floor, where=Where()),
    }


def with_courses(found: Diagnosis) -> Diagnosis:
    """A diagnosis that kept what effects make of its runs: the loop as found, and one that does not act."""
    told = []
    for shown in found.series:
        loop = shown.replayed_after - shown.replayed_recalibrated
        mohr, slow = 0.02 * shown.rate_degc_min, 0.1 * loop
        courses = (
            Course("thermal_hysteresis", 0.05, "deg/h", True, True, loop),
            Course("shupe_mohr", 0.5, "deg/h/(degC/min)", False, True, mohr),
            Course("sensor_lag", 20.0, "s", False, False, slow),
        )
        told.append(replace(shown, courses=courses))
    return replace(found, series=tuple(told))
