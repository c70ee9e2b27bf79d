"""Any mix of faults is repaired as promised, and every row that is gone is counted."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.runs.reading import read_blocks, read_run
from tests.runs.files import SUFFIXES, write_table

any_faults = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def counts(run) -> dict[str, int]:
    return {f.code: f.count for f in run.findings if f.code.startswith("repaired")}


@pytest.mark.parametrize("suffix", SUFFIXES)
@any_faults
@given(
    time=st.lists(st.integers(0, 30), min_size=4, max_size=40),
    bad=st.dictionaries(
        st.integers(0, 39),
        st.tuples(st.sampled_from(["time", "gyro", "T"]), st.sampled_from([np.nan, np.inf, -np.inf])),
        max_size=4,
    ),
)
def test_values_and_order(tmp_path, suffix, time, bad):
    count = len(time)
    columns = {"time": np.array(time, float), "gyro": np.arange(count) + 0.5, "T": np.arange(count) / 4}
    bad = {row: how for row, how in bad.items() if row < count}
    for row, (name, value) in bad.items():
        columns[name][row] = value
    kept = [row for row in range(count) if row not in bad]
    # The first row of each time stays; sorting keeps rows of one time in the file's order.
    first = {t: row for row, t in reversed([(row, time[row]) for row in kept])}
    rows = [first[t] for t in sorted(first)]
    back = sum(time[b] < time[a] for a, b in pairwise(kept))
    units = {"time": "time [s]", "gyro": "gyro [deg/h]", "T": "T [degC]"}
    path = write_table(tmp_path / f"run{suffix}", {units[name]: v for name, v in columns.items()})
    if len(rows) < 2:
        with pytest.raises(InputError, match=r"run\..*at least 2"):
            read_run(path, repair=True)
        return
    run = read_run(path, repair=True)
    assert run.time.tolist() == [time[row] for row in rows]
    assert run.gyro.tolist() == [row + 0.5 for row in rows]
    expected = {
        "repaired_rows": len(bad),
        "repaired_order": back,
        "repaired_repeats": len(kept) - len(rows),
    }
    assert counts(run) == {code: number for code, number in expected.items() if number}
    if counts(run):
        for read in (read_run, lambda p: [*read_blocks(p, block_rows=3)]):
            with pytest.raises(InputError, match=r"run\..*column '(time|gyro|T)', (line|row) \d+.*--repair"):
                read(path)
    else:
        assert read_run(path).gyro.tolist() == run.gyro.tolist()


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
    run = read_run(path, repair=True)
    assert run.time.tolist() == [i for i in range(40) if i not in spoiled]
    (finding,) = [f for f in run.findings if f.code.startswith("repaired")]
    assert (finding.count, finding.row) == (len(spoiled), min(spoiled) + 1)
    assert f"line {min(spoiled) + 2}" in finding.message
    for read in (read_run, lambda p: [*read_blocks(p)]):
        with pytest.raises(InputError, match=rf"run\.csv, line {min(spoiled) + 2}[,:].*--repair"):
            read(path)


def test_nothing_left_to_repair(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [deg/h]\na,b\nc,d\n")
    with pytest.raises(InputError, match=r"run\.csv, line 2, column 'time'.*no row"):
        read_run(path, repair=True)
