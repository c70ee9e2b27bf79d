"""T·ΔT as an input of an RBF network: what it brings, to which model, on which runs.

Run ``python -m experiments.rbf_product``; it reads ``config.yaml`` and writes ``results.json``,
``results.md``, ``results.html`` and figures beside itself. ``--quick`` prints a small version.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.rbf_product.loop import loops
from experiments.rbf_product.page import drawings, page
from experiments.rbf_product.world import Made, deviation, made, signal_to_noise, unit
from experiments.results import write_results
from fogml import __version__
from fogml.models.names import make_model
from fogml.yaml_text import read_yaml

HERE = Path(__file__).parent
MODELS = {"RBF, patent's form": "rbf-patent", "RBF, fogml's": "rbf", "polynomial": "polynomial"}
RATES = {"first difference": "diff(T)[first]", "64 s windows": "dT"}
WAYS = ("up", "down", "both")
QUICK_CASES = [
    *(f"{label}|64 s windows|both" for label in MODELS),
    *(f"RBF, patent's form|64 s windows|{way}" for way in ("up", "down")),
    "RBF, patent's form|first difference|both",
]
"""What the quick version trains; all otherwise."""


def settings_of(quick: bool) -> dict[str, Any]:
    """The settings, cut down where quick."""
    settings: dict[str, Any] = read_yaml(HERE / "config.yaml")
    if quick:
        settings |= {"seeds": [1], "products": [0.0, 0.01], "rates": [10, 60]}
        settings["loop"] = {**settings["loop"], "centres": [8], "widths": [2.0], "index": 0.05}
        settings |= {"sample": 5.0, "samples": {"first difference": 2.0}, "cases": QUICK_CASES}
    return settings


def features(name: str, rate: str, product: bool) -> str:
    """Feature text of a model: T (to the third order in a polynomial), its rate, and their product."""
    first = "T^1..3" if name == "polynomial" else "T"
    return f"{first}, {rate}" + (f", T*{rate}" if product else "")


def runs_of(settings: Mapping[str, Any], product: float, rates: Any, seed: int) -> dict[str, Made]:
    """A fresh run each way at each rate."""
    twin = unit(settings, product)
    return {
        f"{rate} {way}": made(twin, rate, way, 1000 * seed + 10 * number + k, settings["sample"])
        for number, rate in enumerate(rates)
        for k, way in enumerate(WAYS)
    }


def directions(settings: Mapping[str, Any]) -> dict[str, Any]:
    """By model, rate, training and product: what is left on a fresh run each way at 10 degC/h."""
    found: dict[str, Any] = {}
    # What a first difference tells goes with the sampling.
    samples = {rate: settings.get("samples", {}).get(rate, settings["sample"]) for rate in RATES}
    for seed in settings["seeds"]:
        twin = unit(settings, settings["product"])
        tests = {
            s: runs_of({**settings, "sample": s}, settings["product"], [10], seed)
            for s in set(samples.values())
        }
        for k, way in enumerate(WAYS):
            train = {s: made(twin, 10, way, 5000 + 10 * seed + k, s) for s in tests}
            for label, name in MODELS.items():
                for rate, text in RATES.items():
                    key = f"{label}|{rate}|{way}"
                    if key not in settings.get("cases", [key]):
                        continue
                    sample_s = samples[rate]
                    for product in (False, True):
                        model = make_model(name, features(name, text, product)).fit(train[sample_s].run)
                        row = found.setdefault(key, {}).setdefault(str(product), [])
                        row.append(
                            {
                                n: deviation(model, test, settings["averaging"])
                                for n, test in tests[sample_s].items()
                            }
                        )
    return {key: {p: _median(rows) for p, rows in told.items()} for key, told in found.items()}


def sizes(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Own error by size of T·dT in the truth, with and without the term, trained both ways, 64 s windows."""
    found: dict[str, Any] = {}
    for product in settings["products"]:
        for seed in settings["seeds"]:
            twin = unit(settings, product)
            train = made(twin, 10, "both", 7000 + seed, settings["sample"])
            tests = {
                str(rate): made(twin, rate, "both", 8000 + 10 * seed + k, settings["sample"])
                for k, rate in enumerate(settings["rates"])
            }
            for label, name in MODELS.items():
                for term in (False, True):
                    model = make_model(name, features(name, "dT", term)).fit(train.run)
                    row = found.setdefault(label, {}).setdefault(str(product), {}).setdefault(str(term), [])
                    row.append(
                        {n: deviation(model, test, settings["averaging"]) for n, test in tests.items()}
                    )
    return {
        label: {size: {t: _median(rows) for t, rows in told.items()} for size, told in by_size.items()}
        for label, by_size in found.items()
    }


def mean_removed(settings: Mapping[str, Any]) -> dict[str, float]:
    """A test run whose bias has moved since training, with its mean removed and without."""
    told = []
    for seed in settings["seeds"]:
        train = made(unit(settings, settings["product"]), 10, "both", 9000 + seed, settings["sample"])
        moved = unit(settings, settings["product"], b0=0.05 + settings["moved_bias"])
        test = made(moved, 10, "both", 9100 + seed, settings["sample"])
        model = make_model("rbf-patent", features("rbf", "dT", True)).fit(train.run)
        told.append({"test": deviation(model, test, settings["averaging"])})
    return _median(told)["test"]


def _median(rows: list[dict[str, dict[str, float]]]) -> dict[str, dict[str, float]]:
    return {
        name: {key: float(np.median([row[name][key] for row in rows])) for key in rows[0][name]}
        for name in rows[0]
    }


def results(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Every figure of the page."""
    sensors = (settings["unit"], settings["coarse"])
    return {
        "version": __version__,
        "signal_to_noise": [
            [
                told["sensor_resolution"],
                told["sensor_noise"],
                signal_to_noise(told["sensor_resolution"], told["sensor_noise"]),
            ]
            for told in sensors
        ],
        "directions": directions(settings),
        "sizes": sizes(settings),
        "mean_removed": mean_removed(settings),
        "loops": loops(settings),
    }


def main(quick: bool = False) -> None:
    """Compute, and write unless quick."""
    settings = settings_of(quick)
    values = results(settings)
    text = page(values, settings)
    if not quick:
        write_results(HERE, values, text, drawings(values))
    print(text)


if __name__ == "__main__":
    main("--quick" in sys.argv[1:])
