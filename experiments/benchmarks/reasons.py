"""Why a peer comes off better where it does, by what is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

PAIRS = {
    "rbf": "Nystroem takes its centres at random and five widths from a grid; ours searches centres, widths "
    "and ridge by evidence, and leaves about half the error.",
    "csv": "Ours parses by pyarrow, whose threads OMP_NUM_THREADS bounds, and then checks every value "
    "(missing, infinite, time going back, stuck values, saturation, outliers, thermometers that drop out, "
    "bursts of a logger, units that can't be): a third as much again, on one core. pandas 3.1 parses on all "
    "cores whatever OMP_NUM_THREADS says, checks nothing, and keeps whole numbers as integers, which cost "
    "less to parse.",
    "read-csv": "As for pandas: plain readers parse, and check nothing.",
    "read-csv-1e7": "Over 64 MB a file goes part by part into temporary files, so that its length does not "
    "matter to memory; plain readers hold all of it, and pandas 3.1 parses on all cores; what is read is "
    "then looked through some 25 columns' worth out of these files, on one core.",
    "read-parquet": "Files of other formats than text are decoded in a process of its own, with limits on "
    "time and memory, so that a damaged or hostile one ends nothing else; samples pass through a pipe while "
    "more are decoded, and every value is checked. Plain readers do neither, and decode on all cores.",
    "read-parquet-1e7": "Decoded in a process of its own on one core, put into temporary files part by part, "
    "and checked value by value in bounded memory; plain readers decode on all cores into memory.",
    "write-csv": "polars formats numbers by a faster routine of its own; ours writes through pyarrow, every "
    "digit, into a file that appears whole with its side file. Another library for this alone, or digits "
    "formatted by our own code, would cost more trust than it saves time.",
    "write-parquet": "As much is encoded; ours writes a file that appears whole, and its facts.",
    "features": "The plain way keeps no mask of full windows, knows no gaps and assumes even sampling.",
    "allan": "The plain way gives no intervals.",
    "compensate": "As fast as Arrow itself reads and writes the file, within chance.",
    "help": "The plain side prints no help.",
}
"""Beginning of a job's name to the reason; the longest that fits counts."""
MODELS = {
    "no model": "a model learned on one leg may do harm on another, which nothing cannot",
    "cubic": "in ramps of few rates temperature and its rate move together, and a model of T alone cannot "
    "take up a term in the rate that does not hold at another",
    "gaussian-process": "it averages over functions where others choose one",
    "svr": "residuals count linearly in it and not at all under epsilon, and away from its training rows it "
    "falls back to a constant",
    "kernel-ridge": "away from its training rows it falls back to the mean",
    "nystroem": "away from its training rows it falls back to a constant",
    "random-forest": "away from its training rows it stays at the last leaf's constant",
    "boosting": "away from its training rows it stays at the last leaf's constant",
    "perceptron": "away from its training rows it goes on by itself, for better or worse",
    "gru": "its state can follow hysteresis and warm-up, which no function of T, dT and T·dT at one instant "
    "holds; and a hundred steps of Adam may take less of the training runs' slow noise for drift",
    "rbf-interpolator": "away from its training rows its linear part goes on",
}
"""What in a model may explain that it comes off best on held-out runs."""


def pair_reason(name: str) -> str:
    """Why the plain side is faster in a job; empty where nothing is known."""
    fitting = [prefix for prefix in PAIRS if name.startswith(prefix)]
    return PAIRS[max(fitting, key=len)] if fitting else ""


def lost_pairs(jobs: Sequence[Mapping[str, Any]]) -> list[str]:
    """Lines on the jobs in which the plain way is faster."""
    lost = [job for job in jobs if job["ratio"]["median"] < 1.0]
    grouped: dict[str, list[str]] = {}
    for job in lost:
        told = f"{job['name']} ({1.0 / job['ratio']['median']:.2g} times)"
        grouped.setdefault(pair_reason(job["name"]), []).append(told)
    return [f"- {', '.join(names)}. {reason}".rstrip() for reason, names in grouped.items()]


def winners(labels: Sequence[str]) -> str:
    """What may explain that others than fogml come off best in some column."""
    told = [f"{label} ({MODELS[label]})" for label in dict.fromkeys(labels) if label in MODELS]
    return f"Others that are lowest in a column, and what may explain it: {'; '.join(told)}." if told else ""
