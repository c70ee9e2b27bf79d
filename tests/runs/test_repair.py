"""Any mix of faults is repaired as promised, and every row that is gone is counted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.runs.reading import read_blocks, read_run, read_runs
from tests.runs.files import SUFFIXES, write_table

any_faults = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def counts(run) -> dict[str, int]:
    return {f.code: f.count for f in run.findings if f.code.startswith("repaired")}


def file_of(tmp_path, suffix, time, gyro, temperature=None, unit="s"):
    temperature = np.arange(len(time)) / 4 if temperature is None else temperature
    columns = {f"time [{unit}]": time, "gyro [deg/h]": gyro, "T [degC]": temperature}
    return write_table(tmp_path / f"run{suffix}", columns)


@pytest.mark.parametrize("suffix", SUFFIXES)
@any_faults
@given(
    swapped=st.sets(st.integers(0, 28).map(lambda i: 3 * i), max_size=4),
    again=st.sets(st.integers(0, 28).map(lambda i: 3 * i + 2), max_size=4),
    bad=st.dictionaries(
        st.integers(90, 99),
        st.tuples(st.sampled_from(["time", "gyro", "T"]), st.sampled_from([np.nan, np.inf, -np.inf])),
        max_size=4,
    ),
)
def test_single_rows_at_fault(tmp_path, suffix, swapped, again, bad):
    order = np.arange(100)
    for row in swapped:
        order[[row, row + 1]] = order[[row + 1, row]]
    order = np.insert(order, [row + 1 for row in again], order[list(again)])
    columns = {"time": order * 1.0, "gyro": order + 0.5, "T": order / 4}
    for row, (name, value) in bad.items():
        columns[name][row + len(again)] = value
    path = file_of(tmp_path, suffix, columns["time"], columns["gyro"], columns["T"])
    run = read_run(path, repair=True, most_dropped=0.1)
    kept = [row for row in range(100) if row not in bad]
    assert run.time.tolist() == kept
    assert run.gyro.tolist() == [row + 0.5 for row in kept]
    expected = {"repaired_rows": len(bad), "repaired_order": len(swapped), "repaired_repeats": len(again)}
    found = counts(run)
    if bad and "repaired_rows" in found:
        # Rows without a time go before the order is told, others after.
        found["repaired_rows"] = sum(f.count for f in run.findings if f.code == "repaired_rows")
    assert found == {code: number for code, number in expected.items() if number}
    if found:
        for read in (read_run, lambda p: [*read_blocks(p, block_rows=3)]):
            with pytest.raises(InputError, match=r"run\..*column '(time|gyro|T)', (line|row) \d+"):
                read(path)
    else:
        assert read_run(path).gyro.tolist() == run.gyro.tolist()


def test_repair_drops_no_more_than_it_may(tmp_path):
    gyro = np.arange(200.0)
    gyro[::20] = np.nan
    path = file_of(tmp_path, ".csv", np.arange(200.0), gyro)
    with pytest.raises(InputError, match=r"would drop 10 of 200 rows.*more than 2 %.*--repair-anyway"):
        read_run(path, repair=True)
    assert len(read_run(path, repair=True, most_dropped=1.0)) == 190


TICKS = np.cumsum(np.random.default_rng(3).integers(9_000, 11_000, 4000))


@pytest.mark.parametrize("bits, start", [(16, 0), (32, -TICKS[2000]), (31, -TICKS[100])])
def test_a_wrapped_counter_is_unwrapped(tmp_path, bits, start):
    ticks = TICKS if bits > 16 else np.cumsum(np.full(4000, 700))
    path = file_of(tmp_path, ".parquet", (ticks + start) % 2**bits, np.arange(4000.0), unit="us")
    turns = int(np.ptp((ticks + start) // 2**bits))
    wraps = "wraps once" if turns == 1 else f"wraps {turns} times"
    with pytest.raises(
        InputError, match=rf"counter of {bits} bits of 1e-06 s {wraps};.*--repair unwraps it$"
    ):
        read_run(path)
    run = read_run(path, repair=True)
    assert counts(run) == {"repaired_wrap": turns}
    np.testing.assert_allclose(np.diff(run.time), 1e-6 * np.diff(ticks), rtol=1e-9)
    assert run.gyro.tolist() == list(range(4000))


@pytest.mark.parametrize("stamps_of", [1, 2])
def test_a_record_with_its_newest_rows_first_is_turned_round(tmp_path, stamps_of):
    """Rows of one stamp among them, as of a logger whose clock tells whole seconds."""
    even = np.arange(400) / stamps_of
    path = file_of(tmp_path, ".csv", np.floor(even)[::-1], np.arange(400.0)[::-1])
    with pytest.raises(InputError, match=r"newest first.*correct it, or --repair turns them round"):
        read_run(path)
    run = read_run(path, repair=True)
    assert run.gyro.tolist() == list(range(400)) and counts(run)["repaired_order"] == 400
    np.testing.assert_allclose(run.time, even, atol=1e-6)


def test_a_signed_counter_too(tmp_path):
    ticks = (TICKS - TICKS[2000] + 2**31 + 2**31) % 2**32 - 2**31
    run = read_run(file_of(tmp_path, ".parquet", ticks, np.arange(4000.0), unit="us"), repair=True)
    np.testing.assert_allclose(np.diff(run.time), 1e-6 * np.diff(TICKS), rtol=1e-9)


@pytest.mark.parametrize("first_row", [100, 1300])
def test_an_hour_put_back_in_autumn_is_added(tmp_path, first_row):
    even = 2.0 * np.arange(4000)
    local = np.where(np.arange(4000) < 3000, even, even - 3600.0)[first_row:]
    path = file_of(tmp_path, ".csv", local, np.arange(len(local)) * 1.0)
    with pytest.raises(InputError, match=r"put back by one hour.*--repair adds the hour from there on"):
        read_run(path)
    run = read_run(path, repair=True)
    np.testing.assert_array_equal(run.time, even[first_row:])
    assert counts(run) == {"repaired_hour": 1}
    whole = np.concatenate([block.time for block in read_blocks(path, repair=True, block_rows=700)])
    np.testing.assert_array_equal(whole, run.time)


def test_a_recording_of_an_hour_that_begins_anew_is_two(tmp_path):
    time = np.tile(2.0 * np.arange(1800), 2)
    assert len(read_runs(file_of(tmp_path, ".csv", time, np.arange(3600.0)), repair=True)) == 2


@pytest.mark.parametrize(
    "cycle, unit, told", [(86_400, "s", "time of day"), (604_800, "ms", "time of the week")]
)
def test_a_time_of_day_or_week_goes_on_where_it_begins_anew(tmp_path, cycle, unit, told):
    even = 40_000.0 + 200.0 * np.arange(4000)
    scale = {"s": 1, "ms": 1000}[unit]
    path = file_of(tmp_path, ".csv", scale * (even % cycle), np.arange(4000.0), unit=unit)
    with pytest.raises(InputError, match=rf"the {told} begins anew.*--repair adds the \w+ from there on"):
        read_run(path)
    run = read_run(path, repair=True)
    np.testing.assert_allclose(run.time, even, atol=1e-6)
    assert counts(run) == {"repaired_wrap": int(even[-1] // cycle)}
    # One that was begun at the beginning of a day, each day, is several.
    again = file_of(tmp_path, ".csv", np.tile(np.arange(0.0, 86_400.0, 200.0), 2), np.arange(864.0))
    assert len(read_runs(again, repair=True)) == 2


@pytest.mark.parametrize("second", [0.0, 0.037, -300.0])
def test_a_restarted_clock_makes_legs(tmp_path, second):
    time = np.concatenate([0.1 * np.arange(500) + 400.0, 0.1 * np.arange(700) + 400.0 + second])
    path = file_of(tmp_path, ".csv", time, np.arange(1200.0))
    path.with_suffix(".yaml").write_text("powered_on: 390.0\nstarted: 2026-03-02T08:00:00Z\n")
    with pytest.raises(InputError, match=r"restarts once.*1 to 500, 501 to 1200.*each leg a run of its own"):
        read_run(path)
    with pytest.raises(InputError, match=r"restarts once.*one run is needed"):
        read_run(path, repair=True)
    first, other = read_runs(path, repair=True)
    assert (first.name, other.name) == ("run.csv leg 1", "run.csv leg 2")
    assert (first.gyro.tolist(), other.gyro.tolist()) == (list(range(500)), list(range(500, 1200)))
    np.testing.assert_array_equal(other.time, time[500:])
    assert (first.facts.powered_on, other.facts.powered_on) == (390.0, None)
    assert first.facts.started is not None and other.facts.started is None
    assert counts(first) == {"repaired_restart": 1}


def test_legs_of_coarse_counts_keep_what_they_share_by_chance(tmp_path):
    """A third of the second leg shows the time, the count and the temperature of a row of the first."""
    counts = np.random.default_rng(1).normal(5.0, 0.7, 2000).round()
    columns = {
        "time [s]": np.tile(np.arange(1000.0), 2),
        "gyro [count]": counts,
        "T [degC]": np.full(2000, 25.0),
    }
    assert 0.2 < np.mean(counts[:1000] == counts[1000:]) < 0.5
    first, second = read_runs(write_table(tmp_path / "run.csv", columns), repair=True)
    np.testing.assert_array_equal(np.concatenate([first.gyro, second.gyro]), counts)


def test_rows_that_repeat_a_time_within_a_leg_are_not_out_of_place(tmp_path):
    leg = 0.1 * np.arange(600)
    again = np.where((leg > 10.05) & (leg < 10.35), leg[100], leg)
    path = file_of(tmp_path, ".csv", np.concatenate([leg + 300.0, again]), np.arange(1200.0))
    first, other = read_runs(path, repair=True)
    assert (len(first), len(other)) == (600, 597)
    assert counts(first) == counts(other) == {"repaired_restart": 1, "repaired_repeats": 3}


def test_blocks_of_rows_out_of_place_are_sorted(tmp_path):
    order = np.concatenate([np.arange(300), np.arange(500, 900), np.arange(300, 500), np.arange(900, 1000)])
    run = read_run(file_of(tmp_path, ".csv", 0.5 * order, order * 1.0), repair=True)
    assert run.gyro.tolist() == list(range(1000))


@pytest.mark.parametrize("interval, step", [(0.1, 1.0), (0.097, 0.1), (0.0371, 0.25)])
def test_samples_of_coarse_stamps_are_spread(tmp_path, interval, step):
    true = interval * np.arange(2000) + 5.0
    time = step * np.floor(true / step + 1e-9)
    path = file_of(tmp_path, ".csv", time, np.arange(2000.0))
    with pytest.raises(InputError, match=r"show the time of the row before.*spreads the samples evenly$"):
        read_run(path)
    run = read_run(path, repair=True)
    assert len(run) == 2000
    assert run.sample_s == pytest.approx(interval, rel=1e-4)
    off = run.time - true
    assert np.ptp(off) < 0.1 * step


@pytest.mark.parametrize("time", [np.zeros(50), np.random.default_rng(0).uniform(0, 100, 50)])
def test_no_repair_where_no_order_can_be_told(tmp_path, time):
    path = file_of(tmp_path, ".csv", time, np.arange(50.0))
    for repair in (False, True):
        with pytest.raises(
            InputError, match=r"it (stands still|goes back in so many places).*sample_s"
        ) as told:
            read_run(path, repair=repair)
        assert "--repair" not in str(told.value)


def test_single_precision_is_named_as_the_reason(tmp_path):
    path = file_of(tmp_path, ".parquet", (1.7e9 + np.arange(500)).astype(np.float32), np.arange(500.0))
    with pytest.raises(InputError, match=r"single precision \(float32\).*128 s apart"):
        read_run(path, repair=True)


SPOILED = {
    "text": "{0},fault,1",
    "cut": "{0},1",
    "long": "{0},1,2,3",
    "number of another script": "{0},١,2",
    "underscores": "{0},1_0,2",
    "hexadecimal": "{0},0x10,2",
    "unclosed sign": "{0},1e,2",
}


@any_faults
@given(st.dictionaries(st.integers(1, 30), st.sampled_from(sorted(SPOILED)), min_size=1, max_size=8))
def test_rows_that_cannot_be_read(tmp_path, spoiled):
    rows = [SPOILED[spoiled[i]].format(i) if i in spoiled else f"{i},{i}.25,{i % 9}.5" for i in range(40)]
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [deg/h],T [degC]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    run = read_run(path, repair=True, most_dropped=0.5)
    assert run.time.tolist() == [i for i in range(40) if i not in spoiled]
    (finding,) = [f for f in run.findings if f.code.startswith("repaired")]
    assert (finding.count, finding.row) == (len(spoiled), min(spoiled) + 1)
    assert f"line {min(spoiled) + 2}" in finding.message
    for read in (read_run, lambda p: [*read_blocks(p)]):
        with pytest.raises(InputError, match=rf"run\.csv, line {min(spoiled) + 2}[,:].*--repair"):
            read(path)


def test_a_last_row_cut_short_takes_no_other_along(tmp_path):
    lines = [f"{i},{7.611 + i % 9},{25.1 + i % 7:.2f},26.22" for i in range(60)]
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [deg/h],T [degC],T_case [degC]\n" + "\n".join([*lines, "60,7.6"]))
    run = read_run(path, repair=True)
    assert run.time.tolist() == list(range(60))
    (told,) = [finding.message for finding in run.findings if finding.code == "repaired_rows"]
    assert "line 62: 2 fields" in told


def test_nothing_left_to_repair(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [deg/h]\na,b\nc,d\n")
    with pytest.raises(InputError, match=r"run\.csv, line 2, column 'time'.*no row"):
        read_run(path, repair=True)
