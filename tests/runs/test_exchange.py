"""Runs as pandas frames, pickled and shown, with nothing lost on the way."""

from __future__ import annotations

import copy
import pickle
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from fogml.errors import InputError
from fogml.runs.facts import Facts
from fogml.runs.reading import read_run
from fogml.runs.run import Run
from fogml.signals.allan import allan_deviation

TIME = np.arange(600.0)


def run() -> Run:
    facts = Facts(unit="F-1", axis="x")
    return Run.from_columns(
        "a.csv", facts, time=TIME, gyro=np.sin(TIME), T_in=20.0 + TIME / 100.0, dial=TIME % 7
    )


def test_a_run_comes_back_from_its_frame() -> None:
    frame = run().to_pandas()
    assert list(frame) == ["time [s]", "gyro [deg/h]", "T_in [degC]", "dial"]
    back = Run.from_pandas(frame, "a.csv", run().facts)
    assert back.hash == run().hash and back.facts == run().facts
    frame.iloc[0, 1] = 99.0
    assert run().gyro[0] == 0.0


def test_units_of_a_frame_are_converted() -> None:
    frame = pd.DataFrame({"gyro [deg/s]": [1.0, 2.0], "T [K]": [273.15, 283.15]}, index=[0.0, 0.5])
    made = Run.from_pandas(frame)
    np.testing.assert_allclose(made.gyro, [3600.0, 7200.0])
    np.testing.assert_allclose(made.columns["T"], [0.0, 10.0])
    np.testing.assert_allclose(made.time, [0.0, 0.5])
    assert Run.from_pandas(pd.DataFrame({"time": [0, 1], "gyro [count]": [5, 6]})).gyro_unit == "count"


SUMMER_ENDS = pd.date_range("2026-10-24 22:00", periods=400, freq="1min", tz="UTC")


@pytest.mark.parametrize(
    ("index", "last_s"),
    [
        (pd.date_range("2026-01-01", periods=400, freq="500ms", unit="ms"), 199.5),
        (SUMMER_ENDS.tz_convert("Europe/Berlin"), 399 * 60.0),
        (pd.timedelta_range(0, periods=400, freq="500ms"), 199.5),
        (pd.Index(0.5 * np.arange(400)), 199.5),
        (pd.Index(500 * np.arange(400), name="time [ms]"), 199.5),
        (pd.Index(500.0 * np.arange(400), name="time [ms]"), 199.5),
        (pd.RangeIndex(400, name="Time (min)"), 399 * 60.0),
        (pd.date_range("2026-01-01", periods=400, freq="500ms", name="time [ms]"), 199.5),
    ],
)
def test_an_index_of_times_is_the_time_as_a_column_of_them_is(index: pd.Index, last_s: float) -> None:
    frame = pd.DataFrame({"gyro": np.sin(np.arange(400.0))}, index=index)
    made = Run.from_pandas(frame)
    assert made.time[-1] - made.time[0] == pytest.approx(last_s, rel=1e-12)
    again = Run.from_pandas(frame.reset_index(names=index.name or "time"))
    assert again.hash == made.hash and again.facts == made.facts
    assert made.facts.started == (index[0] if isinstance(index, pd.DatetimeIndex) else None)


def test_an_index_that_may_count_rows_is_no_clock() -> None:
    whole = pd.DataFrame({"gyro": np.arange(9.0), "T": 20.0})
    for frame in (whole, whole[whole.gyro != 3.0], whole.set_index("T")):
        with pytest.raises(InputError, match="call the index 'time \\[s\\]'"):
            Run.from_pandas(frame)


def test_a_frame_is_looked_at_as_a_file_is(tmp_path: Path) -> None:
    warm = 293.15 + 10.0 * np.sin(TIME / 100.0)
    frame = pd.DataFrame({"time [s]": TIME, "gyro [deg/h]": np.sin(TIME), "T [degC]": np.round(warm, 2)})
    frame.loc[50:, "time [s]"] += 100.0
    frame.to_csv(tmp_path / "a.csv", index=False)
    read, made = read_run(tmp_path / "a.csv"), Run.from_pandas(frame, "a.csv")
    assert {"gap", "implausible_temperature"} <= {finding.code for finding in made.findings}
    assert made.findings == read.findings and made.hash == read.hash


def test_a_frame_is_called_as_a_file_is() -> None:
    frame = pd.DataFrame({"Time (ms)": [0, 500], "gyro_dps": [1.0, 2.0], "Rate (deg/h)": [3600.0, 7200.0]})
    made = Run.from_pandas(frame)
    np.testing.assert_allclose(made.reference_deg_h, [3600.0, 7200.0])
    np.testing.assert_allclose(made.error_deg_h, 0.0, atol=1e-9)
    np.testing.assert_allclose(made.time, [0.0, 0.5])


def test_a_run_keeps_what_it_was_given() -> None:
    values = np.sin(TIME)
    frame = pd.DataFrame({"time": TIME, "gyro": values})
    shown = values.view()
    shown.flags.writeable = False
    made = [
        Run.from_pandas(frame),
        Run("a", {"time": TIME, "gyro": shown}),
        Run("a", {"time": TIME, "gyro": 0.0 * TIME}).with_columns(gyro=values),
    ]
    frame.iloc[1, 1] = values[1] = 99.0
    assert [float(run.gyro[1]) for run in made] == [np.sin(1.0)] * 3


def test_a_run_is_in_internal_units() -> None:
    columns = {"time": TIME, "gyro": TIME}
    for of in (columns | {"rate [deg/h]": TIME}, {"time": TIME, "gyro [deg/h]": TIME}):
        with pytest.raises(
            InputError, match=r"it is called '(rate|gyro)', in deg/[sh]; Run.from_pandas takes"
        ):
            Run("a", of)
    with pytest.raises(InputError, match="it is called 'rate', in deg/s"):
        Run("a", columns).with_columns(**{"rate [deg/s]": TIME})
    assert list(Run("a", columns | {"flow [l/min]": TIME}).columns) == ["time", "gyro", "flow [l/min]"]
    with pytest.raises(InputError, match="gyro_unit is 'deg/s'"):
        Run("a", columns, gyro_unit="deg/s")  # type: ignore[arg-type]


def test_what_a_mask_hides_is_missing() -> None:
    hidden = np.zeros(len(TIME), dtype=bool)
    hidden[4] = True
    for name, values in {"gyro": TIME, "T": TIME.astype(int), "time": TIME.astype("m8[s]")}.items():
        columns = {"time": TIME, "gyro": TIME, name: np.ma.masked_array(values, hidden)}
        with pytest.raises(InputError, match=f"column '{name}', sample 5: the value is missing"):
            Run("a", columns)
        columns[name] = np.ma.masked_array(values, ~hidden & hidden)
        assert np.array_equal(Run("a", columns).columns[name], TIME)
    with pytest.raises(InputError, match="not finite"):
        allan_deviation(np.ma.masked_array(TIME, hidden), sample_s=1.0)


def test_a_part_of_a_run_goes_forwards_in_time() -> None:
    whole = run()
    assert np.array_equal(whole[whole.time > 99.5].time, whole[100:].time)
    for part in (slice(None, None, -1), 5, [3, 2, 1], np.array([1, 2])):
        with pytest.raises(InputError, match=r"run\[100:200\]"):
            whole[part]  # type: ignore[index]


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        (
            {"time": [0.0, 1.0], "gyro [furlong]": [1.0, 2.0]},
            "column 'gyro' has unit 'furlong', not accepted",
        ),
        (
            {"time": [0.0, 1.0], "gyro": [1.0, 2.0], "gyro [deg/s]": [1.0, 2.0]},
            "column 'gyro' is there twice",
        ),
        ({"time": [0.0, 1.0], "T": [1.0, 2.0]}, "no column 'gyro'"),
        ({"gyro": [1.0, 2.0]}, "no column 'time', and the index .* may count rows"),
        ({"time": [0.0, 1.0], "gyro": ["a", "b"]}, "gyro"),
        ({"time": [0.0, 0.0], "gyro": [1.0, 2.0]}, "time"),
    ],
)
def test_a_frame_that_is_no_run_is_refused(columns: dict, told: str) -> None:
    with pytest.raises(InputError, match=told):
        Run.from_pandas(pd.DataFrame(columns))


def test_a_frames_column_of_text_is_left_out_as_a_files_is(tmp_path: Path) -> None:
    frame = run().to_pandas().assign(note="x")
    frame.to_parquet(tmp_path / "a.parquet")
    made, read = Run.from_pandas(frame, "a.parquet"), read_run(tmp_path / "a.parquet")
    assert list(made.columns) == list(read.columns) == list(run().columns)
    told = [each.message for each in read.findings if "'note'" in each.message]
    assert told and told == [each.message for each in made.findings if "'note'" in each.message]
    with pytest.raises(InputError, match=r"column .T_in.: holds what is no number"):
        Run.from_pandas(frame.assign(**{"T_in [degC]": "x"}))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (run().to_pandas()[:0], "a: the frame has no rows"),
        (run().to_pandas()["dial"], "a pandas DataFrame is needed, found pandas.Series"),
        ({"time": TIME}, "found builtins.dict"),
    ],
)
def test_what_is_no_frame_of_rows_is_refused(given: Any, told: str) -> None:
    with pytest.raises(InputError, match=told):
        Run.from_pandas(given, "a")


def test_runs_are_equal_by_what_they_hold() -> None:
    assert run() == run() and len({run(), run()}) == 1
    assert run() == pickle.loads(pickle.dumps(run())) == copy.deepcopy(run())
    moved = run().with_columns(gyro=np.r_[1e-12, run().gyro[1:]])
    elsewhere = replace(run(), facts=Facts(unit="F-1", axis="y"))
    assert all(run() != other for other in (moved, elsewhere, replace(run(), name="b.csv"), "a.csv"))


def test_a_pickled_run_is_the_run() -> None:
    first = run()
    assert first.clock is not None and first.temperature().size  # worked out, and not to be kept
    data = pickle.dumps(first)
    back = pickle.loads(data)
    assert back.hash == first.hash and back.facts == first.facts and back.name == first.name
    assert len(data) < 1.2 * 8 * 4 * len(TIME)
    with pytest.raises(ValueError, match="read-only"):
        back.gyro[0] = 1.0
    assert len(pickle.loads(pickle.dumps(first[:100]))) == 100


def test_a_run_shows_itself() -> None:
    named = Run.from_columns("<b>a</b>", time=TIME, gyro=np.sin(TIME), T=TIME / 100.0)
    page = ElementTree.fromstring(named._repr_html_().replace("<br>", "<br/>"))
    assert "<b>a</b>" in "".join(page.itertext())
    assert len(page.findall(".//{http://www.w3.org/2000/svg}svg")) == 2
    figure = named.plot()
    assert [trace.name for trace in figure.data] == ["gyro", "T"]
    assert max(figure.data[1].y) == pytest.approx(5.99)
    assert "<b>" not in figure.layout.title.text
    assert len(run()[:0]._repr_html_()) > 0 and not run()[:0].plot().data
