"""The contract of features, as a check that any feature builder can be put to."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.features import Features
from fogml.features.own import Recursion
from fogml.features.parse import parse_features
from fogml.features.signal import NOT_INPUTS, TIME_ON
from fogml.features.traced import Symbol, Writer, traced
from fogml.runs.facts import Facts
from fogml.runs.run import Run

AGREEMENT = 1e-9
"""Greatest difference between two ways to the same value, relative to the column's size."""


def check_feature(features: Features | str, runs: Sequence[Run] | None = None) -> None:
    """Check that features keep the contract that models, streaming and export rely on.

    The checks: parameters and text rebuild equal features; names are distinct, one per column;
    columns are finite and the input stays untouched; no value depends on later samples; sample by
    sample and block by block give the values of the whole run; a recursion of one's own is written with
    what becomes C; after a long gap windowed atoms are
    0 until their windows are full; the box comes from the given runs' full rows only, and a second
    fit finds the same; the limit leaves the inside alone and levels off without a corner beyond.

    Parameters
    ----------
    features
        Features, or their text.
    runs
        Runs to check on, with at least two; synthetic ones that suit the features if None: one
        with regular samples, one with irregular samples and gaps.

    Raises
    ------
    AssertionError
        Naming the part of the contract that is not kept.
    """
    if isinstance(features, str):
        features = parse_features(features)
    runs = synthetic_runs(features) if runs is None else runs
    assert len(runs) >= 2, "check_feature needs at least two runs"
    _check_parameters(features)
    _check_written(features)
    for run in runs:
        _check_columns(features, run)
        _check_causality(features, run)
        _check_streaming(features, run)
        _check_gap(features, run)
    _check_box(features, runs)


def synthetic_runs(features: Features, seed: int = 0) -> list[Run]:
    """A regular run, and an irregular one with short and long gaps, long enough for the windows."""
    rng = np.random.default_rng(seed)
    windows = [atom.window.length_s for atom in features.atoms if atom.window is not None]
    windows += [atom.memory for atom in features.atoms if atom.operator == "lag"]
    sample_s = min([length for length in windows if length > 0.0], default=16.0) / 8.0
    count = int(np.ceil(4.0 * features.window_s / sample_s)) + 400
    regular = sample_s * np.arange(count)
    interval = sample_s * rng.uniform(0.7, 1.3, count)
    # Dropped samples: some gaps are short enough to be spanned, one is longer than any window.
    interval[rng.choice(count, 5, replace=False)] += 2.0 * sample_s
    interval[count // 3] += features.window_s + 20.0 * sample_s
    return [_run(features, "regular", regular, rng), _run(features, "irregular", np.cumsum(interval), rng)]


def _run(features: Features, name: str, time: NDArray[Any], rng: np.random.Generator) -> Run:
    columns = {"time": time, "gyro": np.zeros(len(time))}
    share = (time - time[0]) / (time[-1] - time[0])
    for sensor in features.sensors:
        lag, noise = rng.uniform(0.0, 0.5), 0.01 * rng.standard_normal(len(time))
        columns[sensor] = 20.0 + 25.0 * np.sin(2.0 * np.pi * share - lag) + 5.0 * share + noise
    # Time since power-on comes from the facts, unless the features take it as a column.
    columns.pop(TIME_ON, None)
    return Run(name=name, columns=columns, facts=Facts(powered_on=float(time[0]) - 30.0))


def _inputs(run: Run) -> tuple[str, ...]:
    return tuple(name for name in run.columns if name not in NOT_INPUTS)


def _same(left: FloatArray, right: FloatArray, what: str) -> None:
    assert left.shape == right.shape, f"{what}: shapes {left.shape} and {right.shape}"
    if left.size:
        size = np.maximum(np.abs(left).max(axis=0), np.abs(right).max(axis=0))
        worst = (np.abs(left - right) / np.where(size > 0.0, size, 1.0)).max()
        assert worst <= AGREEMENT, f"{what}: they differ by {worst:.1e} of the column's size"


def _check_parameters(features: Features) -> None:
    again = type(features)(**features.get_params())
    assert again == features, "parameters do not rebuild equal features"
    assert again.text == features.text, "the text is not canonical: it changes when it is read again"
    assert hash(again) == hash(features), "equal features have different hashes"
    names = features.names()
    assert len(set(names)) == len(names), f"names repeat: {names}"


def _check_written(features: Features) -> None:
    """Recursions take symbols, and keep as many numbers as they begin with."""
    for atom in features.atoms:
        declared, given = atom.declared, atom.given
        if not isinstance(declared, Recursion):
            continue
        begun = declared.start(20.0, *given)
        assert isinstance(begun, tuple) and begun, f"{atom.text}: start gives {begun!r}, no tuple of numbers"
        gone_on = declared.step(begun, 20.5, 20.0, 1.0, *given)
        assert isinstance(gone_on, tuple) and len(gone_on) == len(begun), (
            f"{atom.text}: step gives {gone_on!r}, no tuple of {len(begun)} numbers as start does"
        )
        writer = Writer("double", repr, False)
        x, last, dt, *state = (Symbol(writer, name) for name in ("x", "last", "dt", *map(str, begun)))
        for what, values in (
            ("start", (x,)),
            ("step", (tuple(state), x, last, dt)),
            ("value", (tuple(state), x)),
            ("settled", (tuple(state), x)),
        ):
            function = getattr(declared, what)
            try:
                traced(function, *values, *given) if function is not None else None
            except InputError as error:
                raise AssertionError(f"{atom.text}: {what}: {error}") from None


def _check_columns(features: Features, run: Run) -> None:
    before = {name: values.copy() for name, values in run.columns.items()}
    columns = features.transform(run)
    assert columns.shape == (len(run), len(features.names())), "one column per name was expected"
    assert columns.dtype == np.float64, f"columns are {columns.dtype}, not float64"
    assert np.isfinite(columns).all(), f"columns of {run.name} are not finite everywhere"
    assert np.array_equal(columns, features.transform(run)), "a second transform gives other numbers"
    for name, values in before.items():
        assert np.array_equal(values, run.columns[name]), f"transform changed the run's column {name}"


def _check_causality(features: Features, run: Run) -> None:
    half = len(run) // 2
    values, full, settled = features.atom_values(run, run.sample_s)
    cut_values, cut_full, cut_settled = features.atom_values(run[:half], run.sample_s)
    assert np.array_equal(settled[:half], cut_settled), "whether a memory is settled depends on later samples"
    assert np.array_equal(full[:half], cut_full), "whether a window is full depends on later samples"
    _same(values[:half], cut_values, "a value depends on whether later samples exist")
    later = {
        name: np.concatenate([run.columns[name][:half], 2.0 * run.columns[name][half:] + 7.0])
        for name in _inputs(run)
    }
    changed = features.atom_values(run.with_columns(**later), run.sample_s).values
    _same(values[:half], changed[:half], "a value depends on later samples")


def _check_streaming(features: Features, run: Run) -> None:
    values, full, settled = features.atom_values(run)
    stream = features.stream(run.sample_s, powered_on_s=run.facts.powered_on)
    names = _inputs(run)
    rows = zip(*(run.columns[name].tolist() for name in ("time", *names)))
    steps = [stream.step(time, dict(zip(names, temperatures))) for time, *temperatures in rows]
    assert np.array_equal(full, [step.full for step in steps]), "streaming finds other windows full"
    assert np.array_equal(settled, [step.settled for step in steps]), "streaming finds other memories settled"
    _same(values, np.array([step.atoms for step in steps]), "streaming and the whole run")
    composed = np.array([step.values for step in steps])
    _same(features.transform(run), composed, "streaming and the whole run, composed")
    blocks = features.blocks(run.sample_s)
    edges = [0, len(run) // 7, len(run) // 7 + 1, len(run) // 2, len(run)]
    pieces = [blocks.push(run[low:high]) for low, high in pairwise(edges)]
    in_blocks = [np.concatenate(parts) for parts in zip(*pieces)]
    assert np.array_equal(full, in_blocks[1]), "blocks find other windows full"
    assert np.array_equal(settled, in_blocks[2]), "blocks find other memories settled"
    _same(values, in_blocks[0], "blocks and the whole run")


def _check_gap(features: Features, run: Run) -> None:
    windowed = [column for column, atom in enumerate(features.atoms) if atom.window is not None]
    if not windowed:
        return
    half = len(run) // 2
    shift = features.window_s + 100.0 * run.sample_s
    time = np.concatenate([run.time[:half], run.time[half:] + shift])
    values, full, settled = features.atom_values(run.with_columns(time=time), run.sample_s)
    assert not full[half], "a window counts right after a gap longer than itself"
    assert not full[0], "a window counts at the first sample"
    assert full.any(), "no window ever counts"
    assert not (settled & ~full).any(), "a window is settled that does not count"
    assert not values[[0, half]][:, windowed].any(), "a windowed atom does not begin at 0"


def _check_box(features: Features, runs: Sequence[Run]) -> None:
    train, test = runs[0], runs[1]
    fitted = type(features)(**features.get_params()).fit([train])
    box = dict(fitted.box)
    values, full, _ = fitted.atom_values(train)
    low, high = np.array(list(box.values())).T
    assert np.array_equal(low, values[full].min(axis=0)), (
        "the box is not that of the training run's full rows"
    )
    assert np.array_equal(high, values[full].max(axis=0)), (
        "the box is not that of the training run's full rows"
    )
    fitted.transform(test, limited=True)
    assert dict(fitted.box) == box, "a transform of another run changed the box"
    assert dict(fitted.fit([train]).box) == box, "a second fit finds another box"
    inside = values[full]
    limited, outside = fitted.limit(inside)
    assert np.array_equal(limited, inside), "the limit changes values inside the box"
    assert not outside.any(), "a training row counts as outside"
    span = np.where(high > low, high - low, 1.0)
    for bound, away in ((high, 1.0), (low, -1.0)):
        steps = np.array([1e-6, 0.02, 0.5, 100.0])[:, None]
        soft, far = fitted.limit(bound + away * steps * span)
        beyond = away * (soft - bound) / span
        moved = high > low
        assert np.allclose(beyond[0, moved], 1e-6, rtol=1e-3), "the limit has a corner at the box's edge"
        assert (np.diff(beyond[:, moved], axis=0) > 0.0).all(), "the limit does not rise steadily"
        assert (beyond <= 0.05 * (1.0 + 1e-9)).all(), "limited values go more than 5 % beyond the box"
        assert far[1:].all(), "rows far beyond the box do not count as outside"
