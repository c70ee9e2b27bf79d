"""Noise terms of filtered, polled and averaged logs: whether intervals of N hold the truth."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.signal import butter, lfilter

from experiments.real_files.section import Section, table
from fogml.arrays import FloatArray
from fogml.runs.noise_of_run import noise_report
from fogml.runs.run import Run

N_TRUE = 0.01
"""Angle random walk of every log [deg/sqrt(h)]."""
LOGS, QUICK_LOGS = 200, 3
SAMPLES = 30_000


def white(rng: np.random.Generator, samples: int, sample_s: float) -> FloatArray:
    """White noise of `N_TRUE` [deg/h]."""
    return N_TRUE * 60.0 / np.sqrt(sample_s) * rng.standard_normal(samples)


def filtered(corner_hz: float, rate_hz: float) -> Callable[[np.random.Generator], FloatArray]:
    """Behind a Butterworth low pass of second order, as a logger's firmware has."""
    b, a = butter(2, corner_hz / (0.5 * rate_hz))
    return lambda rng: np.asarray(lfilter(b, a, white(rng, SAMPLES, 1.0 / rate_hz)))


def held(times: int) -> Callable[[np.random.Generator], FloatArray]:
    """Each value several times, at 100 Hz."""
    return lambda rng: np.repeat(white(rng, SAMPLES // times, 0.01 * times), times)


def counted(
    corner_hz: float, rate_hz: float, count_deg: float
) -> Callable[[np.random.Generator], FloatArray]:
    """Behind a low pass, as whole counts of angle whose rest stays for the next sample."""
    rate = filtered(corner_hz, rate_hz)

    def make(rng: np.random.Generator) -> FloatArray:
        angle = np.cumsum(rate(rng) + 7.0) / 3600.0 / rate_hz
        return np.diff(np.floor(angle / count_deg), prepend=0.0) * count_deg * 3600.0 * rate_hz - 7.0

    return make


KINDS: dict[str, tuple[float, Callable[[np.random.Generator], FloatArray]]] = {
    "white": (100.0, lambda rng: white(rng, SAMPLES, 0.01)),
    **{f"{corner:g} Hz filter": (100.0, filtered(corner, 100.0)) for corner in (1.0, 2.0, 5.0, 10.0, 20.0)},
    **{f"each value {times} times": (100.0, held(times)) for times in (2, 4, 10)},
    "running mean of 10": (
        100.0,
        lambda rng: np.convolve(white(rng, SAMPLES, 0.01), np.full(10, 0.1), "valid"),
    ),
    "0.3 Hz filter at 10 Hz": (10.0, filtered(0.3, 10.0)),
    "the same in counts of 0.1 arcsec": (10.0, counted(0.3, 10.0, 0.1 / 3600.0)),
}
"""Sampling rate [Hz] and maker of each kind of log."""


def figures(kind: str, logs: int) -> dict[str, Any]:
    """Coverage, mean and width of the 90 % interval of N over simulated logs of a kind."""
    rate_hz, make = KINDS[kind]
    values, inside, widths, doubted = [], [], [], []
    for seed in range(logs):
        gyro = 7.0 + make(np.random.default_rng(seed))
        run = Run.from_columns("log", time=np.arange(len(gyro)) / rate_hz, gyro=gyro)
        report = noise_report(run)
        term = report["terms"]["N"]
        low, high = term["ci"]
        values.append(term["value"] or 0.0)
        inside.append(low <= N_TRUE <= high)
        widths.append((high - low) / N_TRUE)
        doubted.append(any(warning["code"] == "model_misfit" for warning in report["warnings"]))
    covered = float(np.mean(inside))
    return {
        "logs": logs,
        "mean": float(np.mean(values)),
        "least": float(np.min(values)),
        "most": float(np.max(values)),
        "coverage": covered,
        "coverage_se": float(np.sqrt(covered * (1.0 - covered) / logs)),
        "median_width": float(np.median(widths)),
        "doubted": float(np.mean(doubted)),
    }


def section(quick: bool) -> Section:
    """The part of the page."""
    logs = QUICK_LOGS if quick else LOGS
    found = {kind: figures(kind, logs) for kind in KINDS}
    rows = [
        (
            kind,
            f"{f['mean']:.5f}",
            f"{f['least']:.5f} … {f['most']:.5f}",
            f"{f['coverage']:.3f} ± {f['coverage_se']:.3f}",
            f"{f['median_width']:.1%}",
            f"{f['doubted']:.1%}",
        )
        for kind, f in found.items()
    ]
    words = (
        f"## Noise terms of filtered, polled and averaged logs\n\nSynthetic: white noise of N = {N_TRUE} "
        f"deg/√h, {SAMPLES:,} samples, {logs} logs of each kind. Coverage: share of the "
        f"stated 90 % intervals of "
        "N that hold the truth, with its standard error. Doubted: logs with a warning "
        "that the model does not "
        "fit, which is right for none of them (stated chance 0.1 %).\n"
    )
    head = ("log", "mean N", "least … most", "coverage", "interval's width", "doubted")
    return Section(f"{words}\n{table(head, rows)}\n", found)
