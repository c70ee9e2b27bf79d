"""Compensation: nanoseconds a sample in batches, microseconds a sample one by one."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.benchmarks.needs import needs
from experiments.benchmarks.peer_model import Budget, PeerModel
from experiments.benchmarks.peers import PEERS, Learner
from experiments.benchmarks.study import Study
from experiments.benchmarks.training import OURS, QUICK_MODELS, training_run
from fogml.arrays import FloatArray
from fogml.features.parse import parse_features

Side = Callable[[FloatArray], FloatArray]
FULL = Budget(settings=4, folds=3)
QUICK = Budget(settings=1, folds=2, most_rows=100)
_BATCH, _ONE_BY_ONE = 100_000, 200


def _sessions(model: Any, folder: Path) -> dict[str, Side]:
    """The network exported to ONNX, in onnxruntime with one thread; none where that is not installed."""
    if needs("onnx", "onnxruntime")():
        return {}
    import onnxruntime

    from fogml.export.export import export_model
    from fogml.export.settings import ExportSettings

    found: dict[str, Side] = {}
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    for dtype in ("float64", "float32"):
        place = folder / dtype
        place.mkdir()
        export_model(model, place, ExportSettings(to="onnx", dtype=dtype))
        path = next(place.glob("*.onnx"))
        session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        kind = np.float64 if dtype == "float64" else np.float32

        def run(X: FloatArray, session: Any = session, kind: Any = kind) -> FloatArray:
            return np.asarray(session.run(None, {"features": X.astype(kind)})[0])

        found[f"{OURS} in onnxruntime, {dtype}"] = run
    return found


def _learned(learner: Learner) -> Side:
    return lambda X: learner.along(X, np.arange(len(X), dtype=np.float64))


def measure(quick: bool, repeats: int, folder: Path) -> dict[str, Any]:
    """Every model on the same features, in turns within this process."""
    from fogml.models.names import make_model
    from fogml.models.regressors import predict_rows

    budget = QUICK if quick else FULL
    run = training_run(600, (0.5, 1.0, 2.0), 1_500 if quick else 30_000)
    model: Any = make_model("rbf").fit(run)
    columns = parse_features("T, dT, T*dT").transform(run)
    columns = np.resize(columns[200:], (2_000 if quick else _BATCH, columns.shape[1]))
    sides: dict[str, Side] = {OURS: lambda X: predict_rows(model.regressor_, X), **_sessions(model, folder)}
    differences = {
        label: float(np.max(np.abs(side(columns) - sides[OURS](columns)))) for label, side in sides.items()
    }
    for peer in PEERS:
        if not quick or peer.name in QUICK_MODELS:
            learner = PeerModel(peer, budget).fit(run).learner_
            sides[peer.name] = _wide(learner) if peer.name == "cubic" else _learned(learner)
    one_by_one = columns[: 20 if quick else _ONE_BY_ONE]
    spent: dict[str, dict[str, list[float]]] = {label: {"batch": [], "single": []} for label in sides}
    for turn in range(repeats + 1):
        for label in sides if turn % 2 == 0 else reversed(sides):
            side = sides[label]
            begin = time.perf_counter()
            side(columns)
            middle = time.perf_counter()
            if label != "gru":
                for row in one_by_one:
                    side(row[None])
            end = time.perf_counter()
            if turn:  # The first turn warms caches and compiles.
                spent[label]["batch"].append((middle - begin) / len(columns) * 1e9)
                spent[label]["single"].append((end - middle) / len(one_by_one) * 1e6)
    streamed = [_streamed(model, run, 50 if quick else 2_000) for _ in range(repeats)]
    rows = [
        {"model": label, "batch_ns": times["batch"], "single_us": times["single"] if label != "gru" else None}
        for label, times in spent.items()
    ]
    return {"batch": len(columns), "rows": rows, "streamed_us": streamed, "differences": differences}


def _wide(learner: Learner) -> Side:
    """The cubic takes powers of T."""
    return lambda X: learner.along(X[:, :1] ** np.arange(1, 4), np.arange(len(X), dtype=np.float64))


def _streamed(model: Any, run: Any, count: int) -> float:
    """Microseconds a sample of fogml's stream: windows, features, box and network."""
    stream = model.stream(run.sample_s)
    inner, outer = run.columns["T_in"].tolist(), run.columns["T_out"].tolist()
    clock = run.time.tolist()
    begin = time.perf_counter()
    for i in range(count):
        step = stream.step(clock[i], {"T_in": inner[i], "T_out": outer[i]})
        model.regressor_.predict(step.values[None])
    return (time.perf_counter() - begin) / count * 1e6


def page(found: Mapping[str, Any]) -> str:
    """Table of the compensation."""
    ours = {row["model"]: row for row in found["rows"]}[OURS]
    lines = [
        f"Drift of features T, dT and T·dT: {found['batch']:,} rows at once, and row by row from Python. "
        f"Medians "
        "(least to greatest) of turns in one process; ratio: its time over ours. A GRU cannot be called "
        "row by "
        "row without keeping its state by hand. The whole stream of fogml, windows and box included, takes "
        f"{statistics.median(found['streamed_us']):.3g} µs a sample in Python; the C export is measured in "
        "`firmware.md`.",
        "",
        "| model | batch, ns a sample | ratio | row by row, µs a sample | ratio |",
        "|---|---:|---:|---:|---:|",
    ]
    for row in found["rows"]:
        cells = []
        for key in ("batch_ns", "single_us"):
            if row[key] is None:
                cells += ["", ""]
                continue
            ratios = [a / b for a, b in zip(row[key], ours[key])]
            cells += [
                f"{statistics.median(row[key]):.3g} ({min(row[key]):.3g}–{max(row[key]):.3g})",
                f"{statistics.median(ratios):.3g}",
            ]
        lines.append(f"| {row['model']} | {' | '.join(cells)} |")
    told = ", ".join(
        f"{label.split(', ')[-1]} {value:.1e}"
        for label, value in found["differences"].items()
        if label != OURS
    )
    if told:
        lines += ["", f"Largest difference of onnxruntime from ours [deg/h]: {told}."]
    return "\n".join(lines)


COMPENSATION_STUDIES = (Study("compensation", "compensation, batch and streaming", measure, page),)
