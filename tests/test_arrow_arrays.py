"""Values of Arrow's columns are those of its own conversion, without pandas."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as arrow
import pytest

from fogml.arrow_arrays import table_of, values_of
from tests.cli.conftest import csv_text


@pytest.mark.parametrize("kind", ["float64", "float32", "int64", "int32"])
@pytest.mark.parametrize("present", [1.0, 0.7])
def test_values_are_those_of_arrows_own_conversion(kind: str, present: float) -> None:
    random = np.random.default_rng(3)
    numbers = [int(x) if random.uniform() < present else None for x in random.integers(-(10**6), 10**6, 57)]
    whole = arrow.chunked_array([arrow.array(part, kind) for part in (numbers[:20], [], numbers[20:])])
    for column in (
        whole,
        whole.slice(3, 30),
        whole.slice(21, 11),
        whole.slice(0, 0),
        arrow.chunked_array([], kind),
    ):
        np.testing.assert_array_equal(values_of(column), column.to_numpy())


@pytest.mark.parametrize("kind", ["f8", "i8", "f4", "bool", "U3"])
def test_a_table_is_that_of_arrows_own_conversion(kind: str) -> None:
    values = np.array([0, 1, 0, 2]).astype(kind)
    table = table_of({"a": values, "b": values[::2].repeat(2)})
    assert table.column_names == ["a", "b"]
    assert (
        table["a"].to_pylist() == values.tolist() and table["b"].to_pylist() == values[::2].repeat(2).tolist()
    )
    if kind != ">f8":
        assert table.schema.field("a").type == arrow.array(values).type


def test_a_run_is_read_and_a_shipped_one_without_pandas(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(csv_text(0, rows=100))
    code = (
        "import sys; from fogml.runs.reading import read_run; from fogml.runs.shipped import shipped_run\n"
        "print(len(read_run('a.csv')), len(shipped_run('thermal-cycle-1-x')) > 0, 'pandas' in sys.modules)"
    )
    command = [sys.executable, "-c", code]
    found = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert found.stdout == "100 True False\n"


def test_a_small_file_is_read_without_threads_that_outlive_it(tmp_path):
    """Arrow's threads that end with the process abort it at times: 7 of 250 reads ended with status 134."""
    (tmp_path / "a.csv").write_text("time [s],gyro [deg/h]\n" + "".join(f"{i},{i % 7}\n" for i in range(50)))
    code = (
        "import os\nfrom fogml import read_run\n"
        f"before = len(read_run({str(tmp_path / 'a.csv')!r}))\n"
        "names = [open(f'/proc/self/task/{t}/comm').read() for t in os.listdir('/proc/self/task')]\n"
        "print(sum('jemalloc' not in name for name in names))"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(told.stdout) <= 2  # the program's own, and the one that Arrow's files are read by
