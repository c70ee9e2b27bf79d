"""Manifests: CSV and YAML say the same; the first fault is told with its place."""

from __future__ import annotations

import os

import pytest
import yaml

from fogml.errors import InputError
from fogml.fleet.manifest import folder_names, read_manifest

HEAD = "unit,job,train,test,axis\n"


@pytest.fixture
def folder(tmp_path):
    for name in ("a.csv", "b.csv", "c.csv"):
        (tmp_path / name).write_text("")
    return tmp_path


def manifest(folder, text, name="m.csv"):
    path = folder / name
    path.write_text(text)
    return path


def test_csv_and_yaml_say_the_same(folder):
    by_row = read_manifest(
        manifest(folder, "# fleet\n" + HEAD + "F-1, train, a.csv;b.csv , c.csv, x\nF-2,diagnose,a.csv,,\n")
    )
    rows = [
        {"unit": "F-1", "train": ["a.csv", "b.csv"], "test": "c.csv", "axis": "x"},
        {"unit": "F-2", "job": "diagnose", "train": "a.csv"},
    ]
    for values in (rows, {"schema": "fogml.manifest/1", "units": rows}):
        assert read_manifest(manifest(folder, yaml.safe_dump(values), "m.yaml")) == by_row
    first, second = by_row
    assert first.train == (str(folder / "a.csv"), str(folder / "b.csv"))
    assert first.label == "F-1 x"
    assert second.test == ()
    assert first.folder != second.folder


@pytest.mark.parametrize(
    ("separator", "encoding"), [(";", "utf-8-sig"), (";", "latin-1"), ("\t", "utf-16"), (",", "gb18030")]
)
def test_as_a_spreadsheet_program_of_another_language_saves_it(folder, separator, encoding):
    name = "单元 1" if encoding == "gb18030" else "Kreisel Süd"
    rows = [["unit", "job", "train", "test", "axis"], [name, "train", '"a.csv;b.csv"', "c.csv", "x"]]
    path = folder / "m.csv"
    path.write_bytes("\r\n".join(separator.join(row) for row in rows).encode(encoding))
    (unit,) = read_manifest(path)
    assert unit.name == name and unit.axis == "x"
    assert unit.train == (str(folder / "a.csv"), str(folder / "b.csv"))


def test_a_folder_is_no_manifest(folder):
    with pytest.raises(InputError, match="is a folder; a manifest was expected"):
        read_manifest(folder)


def test_folders_are_safe_and_unlike_each_other(folder):
    given = ("a/b", "a:b", "..", "A_B", "../../etc", "x" * 300, "x" * 301, "fleet.json", "Batch.XLSX")
    lines = "".join(f'"{name}",train,a.csv,b.csv,\n' for name in given)
    units = read_manifest(manifest(folder, HEAD + lines))
    names = [unit.folder.lower() for unit in units]
    assert len(set(names)) == len(names)
    assert not any("/" in name or name.startswith(".") or len(name) > 110 for name in names)
    assert not {"fleet.json", "batch.xlsx"} & set(names)  # files of the fleet's own


def test_folders_have_the_units_own_names_in_any_script(folder, monkeypatch):
    given = ["陀螺仪-07", "陀螺仪-08", "Kreisel 8/ä", "Kreisel 8/a\u0308", "STRASSE", "straße", "光" * 80]
    names = folder_names(given)
    assert names[:4] == ["陀螺仪-07", "陀螺仪-08", "Kreisel_8_ä", "Kreisel_8_ä-2"]
    assert names[5:] == ["straße-2", "光" * 33]  # 100 bytes hold 33 of them
    for name in names:
        (folder / name).mkdir()

    def latin(name: str) -> bytes:
        return name.encode("latin-1")

    monkeypatch.setattr(os, "fsencode", latin)
    assert folder_names(given[:3]) == ["_-07", "_-08", "Kreisel_8_ä"]


def test_a_list_is_no_name(folder):
    rows = [{"unit": "F-1", "train": "a.csv", "test": "b.csv", "axis": ["x", "y"]}]
    with pytest.raises(InputError, match=r"column 'axis': .*one name was expected"):
        read_manifest(manifest(folder, yaml.safe_dump(rows), "m.yaml"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + "F-1,trian,a.csv,b.csv,x\n", "'trian'; train, compare, diagnose, acceptance"),
        (HEAD + ",train,a.csv,b.csv,x\n", "row 2: column 'unit' is empty"),
        (
            HEAD + "# made by hand\n\nF-1,train,a.csv,b.csv,x\n\n,,,,\n,train,a.csv,b.csv,x\n",
            "row 7: column 'unit'",
        ),
        ("\n" + HEAD + ",train,a.csv,b.csv,x\n", "row 3: column 'unit' is empty"),
        ("unit,train,train,test\nF-1,a.csv,c.csv,b.csv\n", "column 'train' stands 2 times"),
        (HEAD + "F-1,train,a.csv,,x\n", "column 'test' names no run"),
        (HEAD + "F-1,train,,b.csv,x\n", "column 'train' names no run"),
        (HEAD + "F-1,train,a.csv,b.csv,x,more\n", "more cells than the header"),
        (
            HEAD + "F-1,train,a.csv,b.csv,x\nF-1,train,c.csv,b.csv,x\n",
            "unit F-1 axis x has the job 'train' 2",
        ),
        (HEAD, "holds no unit"),
        (HEAD + 'F-1,train,a.csv,"b.csv,x\nF-2,train,c.csv,b.csv,x\n', "is a quotation mark not closed?"),
        (HEAD + 'F-1,train,a.csv,"b.csv"x,x\n', "is a quotation mark not closed?"),
        ("unit,job,trian\n", "unknown column 'trian'; did you mean 'train'"),
        ("unit,job\n", "column 'train' is missing"),
    ],
)
def test_faults(folder, text, message):
    with pytest.raises(InputError) as told:
        read_manifest(manifest(folder, text))
    assert message in str(told.value)
    assert str(told.value).startswith("m.csv: ")


@pytest.mark.parametrize(
    ("runs", "fault"),
    [
        ("a.csv,missing.csv", "m.csv: row 2: column 'test': missing.csv: no such file"),
        (
            r".\sub\..\a.csv,b.csv",
            r"m.csv: row 2: column 'train': .\sub\..\a.csv: no such file, here or beside the manifest; "
            "did you mean ./sub/../a.csv?",
        ),
        ("shipped:nothing,b.csv", "m.csv: row 2: column 'train': shipped:nothing: no such recording ships"),
    ],
)
def test_a_run_that_is_not_there_is_its_unit_s_fault(folder, runs, fault):
    (folder / "sub").mkdir()
    text = HEAD + f"F-1,train,{runs},x\nF-2,train,a.csv,b.csv,x\n"
    first, second = read_manifest(manifest(folder, text))
    assert first.fault.startswith(fault)
    assert not second.fault


@pytest.mark.parametrize("text", ["a: 1\n", "[1, 2]\n", "schema: fogml.other/1\nunits: []\n"])
def test_yaml_that_is_no_manifest(folder, text):
    with pytest.raises(InputError, match=r"m\.yaml"):
        read_manifest(manifest(folder, text, "m.yaml"))
    with pytest.raises(InputError, match="no such file"):
        read_manifest(folder / "nothing.csv")
