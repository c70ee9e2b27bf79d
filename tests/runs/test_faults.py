"""Each fault of a run file is named with its file, column and place, or repaired and counted."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from fogml.errors import InputError
from fogml.runs.facts import side_file
from fogml.runs.reading import read_blocks, read_run

HEADER = "time [s],gyro [deg/h],T [degC]"
ROWS = [f"{i}.0,{i % 7}.25,{20 + i % 3}.5" for i in range(40)]


def text_of(*rows: str, header: str = HEADER) -> str:
    return "\n".join([header, *rows]) + "\n"


def spoiled(row: str) -> str:
    """Line 32 of the file (data row 31) replaced."""
    return text_of(*ROWS[:30], row, *ROWS[31:])


FAULTS = {
    "no header": (text_of(*ROWS[1:], header=ROWS[0]), ["line 1", "header", "time [s]"]),
    "no time": (text_of(*ROWS, header="clock [s],gyro [deg/h],T [degC]"), ["'time'", "time [s]", "clock"]),
    "no gyro": (text_of(*ROWS, header="time [s],out [deg/h],T [degC]"), ["'gyro'", "gyro [deg/h]", "out"]),
    "no unit": (text_of(*ROWS, header="time [s],gyro [deg/h],T"), ["'T'", "T [degC]", "degC, K"]),
    "unknown unit": (text_of(*ROWS, header="time [s],gyro [deg/h],T [Hz]"), ["'T'", "'Hz'", "degC, K"]),
    "a column twice": (text_of(*ROWS, header="time [s],gyro [deg/h],gyro [deg/s]"), ["'gyro'", "twice"]),
    "time back": (spoiled("3.5,1.25,20.5"), ["'time'", "line 32", "goes back"]),
    "time repeats": (spoiled("29.0,1.25,20.5"), ["'time'", "line 32", "repeats"]),
    "nan": (spoiled("30.0,NaN,20.5"), ["'gyro'", "line 32"]),
    "an empty cell": (spoiled("30.0,1.25,"), ["'T'", "line 32"]),
    "infinite": (spoiled("30.0,1.25,-inf"), ["'T'", "line 32"]),
    "beyond float64": (spoiled("30.0,1e999,20.5"), ["'gyro'", "line 32"]),
    "text": (spoiled("30.0,1.25,warm"), ["'T'", "line 32", "'warm'"]),
    "a number with text": (spoiled("30.0,1_000,20.5"), ["'gyro'", "line 32", "'1_000'"]),
    "cut short": (spoiled("30.0,1.25"), ["line 32", "cut short", "2 fields"]),
    "too long": (
        spoiled("30.0,1.25,20.5,7"),
        ["line 32", "4 fields", "has a column no name?", "decimal mark"],
    ),
    "the last line cut short": (text_of(*ROWS)[:-7], ["line 41"]),
    "the last number cut": (text_of(*ROWS)[:-3], ["last line", "middle of a number"]),
    "header only": (HEADER + "\n", ["no samples"]),
    "one row": (text_of(ROWS[0]), ["at least 2"]),
    "empty": ("", ["empty"]),
    "blank": ("\n\n  \n", ["empty"]),
}
REPAIRS = {
    "time back": ("repaired_order", 40),
    "time repeats": ("repaired_repeats", 39),
    "nan": ("repaired_rows", 39),
    "an empty cell": ("repaired_rows", 39),
    "infinite": ("repaired_rows", 39),
    "beyond float64": ("repaired_rows", 39),
    "text": ("repaired_rows", 39),
    "a number with text": ("repaired_rows", 39),
    "cut short": ("repaired_rows", 39),
    "too long": ("repaired_rows", 39),
    "the last line cut short": ("repaired_rows", 39),
    "the last number cut": ("repaired_rows", 39),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_is_named_with_its_place(tmp_path, fault):
    text, told = FAULTS[fault]
    path = tmp_path / "bad.csv"
    path.write_text(text)
    for read in (read_run, lambda p: list(read_blocks(p)), lambda p: list(read_blocks(p, block_rows=7))):
        with pytest.raises(InputError) as caught:
            read(path)
        message = str(caught.value)
        assert "bad.csv" in message
        assert "\n" not in message
        for part in told:
            assert part in message


@pytest.mark.parametrize("fault", REPAIRS)
def test_is_repaired_and_counted(tmp_path, fault):
    code, rows = REPAIRS[fault]
    path = tmp_path / "bad.csv"
    path.write_text(FAULTS[fault][0])
    run = read_run(path, repair=True)
    (finding,) = (finding for finding in run.findings if finding.code.startswith("repaired"))
    assert (finding.code, finding.count) == (code, 1)
    assert len(run) == rows
    assert np.all(np.diff(run.time) > 0.0)
    assert finding.row == (40 if "last" in fault else 31)


def test_repairs_of_every_kind_at_once(tmp_path):
    rows = list(ROWS)
    rows[3] = "3.0,x,1"
    rows[5] = "5.0"
    rows[10], rows[11] = rows[11], rows[10]
    rows[20] = rows[19]
    path = tmp_path / "bad.csv"
    path.write_text(text_of(*rows))
    with pytest.raises(InputError, match=r"would drop 3 of 40 rows.*--repair-anyway"):
        read_run(path, repair=True)
    run = read_run(path, repair=True, most_dropped=0.1)
    counts = {f.code: f.count for f in run.findings if f.code.startswith("repaired")}
    assert counts == {"repaired_rows": 2, "repaired_order": 1, "repaired_repeats": 1}
    kept = [i for i in range(40) if i not in (3, 5, 20)]
    np.testing.assert_array_equal(run.time, kept)
    np.testing.assert_array_equal(run.gyro, [i % 7 + 0.25 for i in kept])


def test_lines_count_blank_ones(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("\n\n" + HEADER + "\n\n" + "\n".join(ROWS[:5]) + "\n\n\n7.0,nan,20.0\n")
    with pytest.raises(InputError, match="line 12"):
        read_run(path)


def test_a_repeat_across_blocks(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text(text_of(*ROWS[:20], *ROWS[19:]))
    blocks = read_blocks(path, block_rows=20)
    assert len(next(blocks)) == 20
    with pytest.raises(InputError, match=r"line 22.*repeats"):
        next(blocks)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (np.random.default_rng(0).bytes(5000), "text"),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "text"),
        (b"PK\x03\x04" + bytes(100), "zip"),
        (b"\x1f\x8b" + bytes(100), "gzip"),
        (HEADER.encode("utf-16"), "no samples"),
    ],
    ids=["noise", "picture", "zip", "gzip", "utf-16"],
)
def test_binary_as_csv(tmp_path, content, told):
    path = tmp_path / "bad.csv"
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"bad\.csv.*{told}"):
        read_run(path)


def good_parquet(path):
    time = np.arange(1000.0)
    pq.write_table(pa.table({"time [s]": time, "gyro [deg/h]": np.sin(time), "T [degC]": time}), path)


def good_hdf5(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name in ("time [s]", "gyro [deg/h]", "T [degC]"):
            file[name] = np.arange(1000.0)


def good_mat(path):
    from scipy.io import savemat

    columns = {name: np.arange(1000.0) for name in ("time", "gyro", "T")}
    savemat(path, {**columns, "units": {"time": "s", "gyro": "deg/h", "T": "degC"}})


GOOD = {".parquet": good_parquet, ".h5": good_hdf5, ".mat": good_mat}


@pytest.mark.parametrize("suffix", GOOD)
@pytest.mark.parametrize("share", [0.3, 0.9, 0.999])
def test_cut_binary_files(tmp_path, suffix, share):
    path = tmp_path / f"bad{suffix}"
    GOOD[suffix](path)
    assert len(read_run(path)) == 1000
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    for read in (read_run, lambda p: list(read_blocks(p))):
        with pytest.raises(InputError, match=r"bad\."):
            read(path)


@pytest.mark.parametrize("suffix", GOOD)
def test_a_suffix_that_does_not_fit(tmp_path, suffix):
    path = tmp_path / "bad.csv"
    GOOD[suffix](path)
    with pytest.raises(InputError, match=rf"rename it to 'bad\{suffix}'"):
        read_run(path)
    path = tmp_path / f"bad{suffix}"
    path.write_text(text_of(*ROWS))
    with pytest.raises(InputError, match=r"bad\."):
        read_run(path)


@pytest.mark.parametrize("suffix", [".parquet", ".h5"])
def test_rows_of_binary_files(tmp_path, suffix):
    time = np.arange(100.0)
    gyro = np.zeros(100)
    gyro[30] = np.inf
    path = tmp_path / f"bad{suffix}"
    columns = {"time [s]": time, "gyro [deg/h]": gyro}
    if suffix == ".parquet":
        pq.write_table(pa.table(columns), path)
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            for name, values in columns.items():
                file[name] = values
    with pytest.raises(InputError, match=r"'gyro', row 31"):
        read_run(path)
    with pytest.raises(InputError, match=r"'gyro', row 31"):
        list(read_blocks(path, block_rows=8))
    assert len(read_run(path, repair=True)) == 99


def test_text_in_parquet(tmp_path):
    path = tmp_path / "bad.parquet"
    pq.write_table(pa.table({"time [s]": [0.0, 1.0], "gyro [deg/h]": ["1", "2"]}), path)
    with pytest.raises(InputError, match=r"bad\.parquet.*'gyro'.*number"):
        read_run(path)


def test_no_file_and_a_folder(tmp_path):
    with pytest.raises(InputError, match=r"shipped_run\('ring-laser-z'\)"):
        read_run("shipped:ring-laser-z")
    with pytest.raises(InputError, match=r"none\.csv: no such file"):
        read_run(tmp_path / "none.csv")
    for folder in (tmp_path, "/"):
        with pytest.raises(InputError, match="folder"):
            read_run(folder)
    assert side_file(Path("/")) is None


def test_no_permission(tmp_path):
    path = tmp_path / "secret.csv"
    path.write_text(text_of(*ROWS))
    path.chmod(0)
    tmp_path.chmod(0o755)
    user = os.geteuid()
    if user == 0:
        os.seteuid(65534)
    try:
        with pytest.raises(InputError, match=r"secret\.csv.*(permission|cannot be read)"):
            read_run(path)
    finally:
        os.seteuid(user)


def test_hdf5_without_h5py(tmp_path, monkeypatch):
    import sys

    path = tmp_path / "run.h5"
    good_hdf5(path)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match=r"package h5py: pip install '\.\[hdf5\]'"):
        read_run(path)


def test_a_column_that_is_not_there(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(text_of(*ROWS))
    with pytest.raises(InputError, match=r"run\.csv.*'T_out'"):
        list(read_blocks(path, columns=["T_out"]))


@pytest.mark.parametrize("repair", [False, True])
@pytest.mark.parametrize(("column", "cure"), [("T", "leave the column out"), ("gyro", "correct them")])
def test_a_column_without_any_value(tmp_path, column, cure, repair):
    path = tmp_path / "run.csv"
    cells = [row.split(",") for row in ROWS]
    place = HEADER.split(",").index(f"{column} [{'degC' if column == 'T' else 'deg/h'}]")
    path.write_text(text_of(*(",".join([*row[:place], "nan", *row[place + 1 :]]) for row in cells)))
    with pytest.raises(InputError, match=f"column '{column}', line 2: .* 40 such .* no other; {cure}"):
        read_run(path, repair=repair)
