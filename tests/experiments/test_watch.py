"""No watched figure is half as much again as at the recorded release; and the watch itself can see."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from experiments import watch
from experiments.watch.__main__ import page, recorded, with_release, worse
from experiments.watch.counting import calls, in_own_process, modules_loaded, peak_bytes
from experiments.watch.figures import WATCHED
from fogml import __version__
from fogml.signals.averages import block_averages

HERE = Path(watch.__file__).parent


def test_nothing_has_become_half_as_much_again() -> None:
    rows = recorded()
    assert set(rows[-1]["figures"]) == set(WATCHED), "a figure is new or gone: python -m experiments.watch"
    assert not worse(in_own_process("experiments.watch.figures.measured()"), rows[-1]["figures"])


def test_the_release_in_force_is_recorded_and_the_page_is_of_the_rows() -> None:
    rows = recorded()
    assert rows[-1]["release"] == __version__, "python -m experiments.watch records a release"
    assert (HERE / "results.md").read_text(encoding="utf-8") == page(rows)


def test_a_figure_that_grows_by_half_is_told() -> None:
    before = recorded()[-1]["figures"]
    key = "auto_calls"
    assert worse({**before, key: 1.51 * before[key]}, before) == [
        f"{WATCHED[key].words}: {1.51 * before[key]:.4g}, was {before[key]:.4g}"
    ]
    assert not worse({**before, key: 1.49 * before[key]}, before)
    # A tool that is missing here, or was then, tells nothing.
    assert not worse({key: None}, before) and not worse(before, {key: None})


def test_a_loop_over_rows_shows_in_calls_and_a_copy_in_memory() -> None:
    time, values = np.arange(400.0), np.ones(400)
    once = calls(lambda: block_averages(time, values, window_s=10.0))
    many = calls(lambda: [block_averages(time, values, window_s=10.0) for _ in range(50)])
    assert once > 0 and many == 50 * once
    assert calls(lambda: [len(str(i)) for i in range(1000)]) == 0  # not fogml's
    one, two = in_own_process("tests.experiments.test_watch.peaks()")
    assert one == pytest.approx(800_000, rel=0.01) and two >= 1_590_000
    assert modules_loaded("import decimal") > 0 == modules_loaded("import sys")


def peaks() -> tuple[int, int]:
    """Of one array of 800 kB, and of two whose sum is a third."""
    return peak_bytes(lambda: np.ones(100_000)), peak_bytes(lambda: np.ones(100_000) + np.ones(100_000))


def test_a_row_takes_the_place_of_its_release() -> None:
    rows = with_release([], "1.0", {"a": 1.0})
    rows = with_release(rows, "1.1", {"a": 2.0})
    again = with_release(rows, "1.1", {"a": 3.0})
    assert [(row["release"], row["figures"]["a"]) for row in again] == [("1.0", 1.0), ("1.1", 3.0)]
    assert json.loads(json.dumps(again)) == again
