"""YAML: a value is what it looks like, nothing stands for too much, and what is written reads back."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.yaml_text import DEEPEST, MOST_BYTES, parse_yaml, read_yaml, yaml_text

ROOT = Path(__file__).parents[1]


def test_a_file_too_long_in_bytes_is_not_read_in_part(tmp_path):
    path = tmp_path / "a.yaml"
    # A cut after whole characters, and at a line's end, would read as a shorter file.
    line = "- 陀螺陀螺陀\n".encode()
    path.write_bytes(line * (MOST_BYTES // len(line)) + b"\n" * (MOST_BYTES % len(line) + 1) + line)
    with pytest.raises(InputError, match=r"a\.yaml: longer than 4 MB"):
        read_yaml(path)


@pytest.mark.parametrize(("text", "line"), [("a: 1\na: 2\n", 2), ("b: 1\na:\n  c: 1\n  d: 2\n  c: 3\n", 5)])
def test_a_repeated_key_is_told_with_its_line(tmp_path, text, line):
    path = tmp_path / "a.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=rf"a\.yaml, line {line}, .*key '[ac]' is stated twice; keep one"):
        read_yaml(path)


# Examples of the core schema (https://yaml.org/spec/1.2.2/#1032-tag-resolution), and what YAML 1.1 takes
# for something else.
@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("null", None), ("~", None), ("", None), ("NULL", None), ("'~'", "~"),
        ("true", True), ("FALSE", False), ("yes", "yes"), ("No", "No"), ("on", "on"), ("y", "y"),
        ("0", 0), ("-19", -19), ("+7", 7), ("0o7", 7), ("0x3A", 58), ("0b1", "0b1"), ("1_000", "1_000"),
        ("0.", 0.0), ("-0.0", -0.0), (".5", 0.5), ("+12e03", 12000.0), ("-2E+05", -2e5), ("1e3", 1000.0),
        ("1:30", "1:30"), ("2026-03-02", "2026-03-02"), ("2026-03-02T08:00:00Z", "2026-03-02T08:00:00Z"),
        ("0.5", 0.5), ("00", None), ("=", "="), ("1.5.2", "1.5.2"), ("e3", "e3"),
        ("'1e3'", "1e3"), ("١", "١"),
    ],
)  # fmt: skip
def test_scalars(written, read):
    if written == "00":
        with pytest.raises(InputError, match="'00' begins with a zero"):
            parse_yaml(written, "text")
        return
    found = parse_yaml(f"a: {written}", "text")["a"]
    assert (found, type(found)) == (read, type(read))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a: 1\nb: 030", r"line 2, column 4, key 'b': '030' begins with a zero"),
        ("a: -007.5", "'-007.5' begins with a zero"),
        ("a: {b: .inf}", r"key 'a\.b': '\.inf': a finite number"),
        ("a: [.nan]", r"'\.nan': a finite number"),
        ("a: 1e999", "too large"),
        ("a: 9223372036854775808", "too large"),
        (f"a: {'9' * 5000}", r"'9+\.\.\.9+': the number is too large"),
        ("a: 0x10000000000000000", "too large"),
        ("a: !!python/object/apply:os.system [ls]", "tag .*os.system.* is not accepted"),
        ("a: !!float 3", "tag .* is not accepted"),
        ("<<: {a: 1}", "merge keys"),
        (r'a: ["b\0"]', "key 'a': a character of code 0, which no name"),
        ("a: &x [*x]", r"alias '\*x' stands for nothing above it"),
        ("a: *b", r"alias '\*b' stands for nothing above it"),
        ("--- 1\n--- 2", "line 2, column 1: a second document"),
        ("? [1]\n: 2", "a key is a list"),
        ("&a [1]: 2", "a key is a list"),
        ("[" * (DEEPEST + 2), "more than 32 levels"),
        ("- " * 5000, "more than 32 levels"),
        ("a: b: c", "line 1, column 5: not readable as YAML"),
        ("a: 'b", "not readable as YAML"),
        ("a: \x00", "line 1, column 4: a character that is no text"),
        ("x" * (MOST_BYTES + 1), "longer than 4 MB"),
    ],
)
def test_what_is_refused(text, told):
    with pytest.raises(InputError, match=told) as raised:
        parse_yaml(text, "f.yaml")
    assert str(raised.value).startswith("f.yaml")
    assert len(str(raised.value)) < 250


@pytest.mark.parametrize("levels", [6, 8, 30])
def test_a_short_text_stands_for_no_huge_one(levels):
    lists = "[1,1,1,1,1,1,1,1,1]"
    for level in range(levels):
        lists = f"[&a{level} {lists}{f',*a{level}' * 8}]"
    with pytest.raises(InputError, match="more than"):
        parse_yaml(f"latitude: {lists}", "laughs.yaml")


def test_an_alias_is_what_it_stands_for():
    assert parse_yaml("a: &x [1, {b: 2}]\nc: *x\n", "text") == {"a": [1, {"b": 2}], "c": [1, {"b": 2}]}


def test_a_name_stays_as_it_is_written():
    read = parse_yaml(
        "unit: 0417\nother: [{unit: 1e3}, {unit: ~}]\ntrain: [01, 02]", "text", ("unit", "train")
    )
    assert read == {"unit": "0417", "other": [{"unit": "1e3"}, {"unit": None}], "train": ["01", "02"]}


scalars = st.none() | st.booleans() | st.integers(-(1 << 63), (1 << 63) - 1)
scalars |= st.floats(allow_nan=False, allow_infinity=False)
looks = st.sampled_from(
    ["yes", "off", "~", "null", "true", "030", "1e3", "1:30", "0o7", "0x1", "2026-03-02", "<<", "=", ".inf",
     "-", "?", "1_0", "+1", ".5", "5.", "# x", "a: b", "*a", "&a", "!a", "- a", "'", '"', " a ", "a\nb",
     "\t", "\x07", "\udc80"]
)  # fmt: skip
texts = looks | st.text(st.characters(exclude_characters="\0"), max_size=12)
plain = st.recursive(
    scalars | texts,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts, inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=150, deadline=None)
@given(values=plain)
def test_what_is_written_reads_back(values):
    read = parse_yaml(yaml_text(values), "text")
    assert repr(read) == repr(values)


@settings(max_examples=300, deadline=None)
@given(text=st.text(alphabet="ab01-:.,[]{}&*!|>'\"%#? \n\t\x00é", max_size=60))
def test_any_text_reads_or_is_told(text):
    try:
        read = parse_yaml(text, "text")
    except InputError:
        return
    try:
        other = yaml.load(text, Loader=yaml.BaseLoader)
    except yaml.YAMLError:
        return  # it is stricter about tabs
    assert isinstance(read, dict) == isinstance(other, dict)
    assert isinstance(read, list) == isinstance(other, list)
    if isinstance(read, str):
        assert read == other
    if isinstance(read, float):
        assert math.isclose(read, float(other))


def test_every_yaml_file_of_the_repository_is_read():
    paths = [path for home in ("configs", "fogml", "experiments") for path in (ROOT / home).rglob("*.yaml")]
    assert len(paths) > 20
    for path in paths:
        assert read_yaml(path)


@pytest.mark.parametrize("text", ["\x85", "a\x85b", "a\n\x85", "\u2028", "a\u2029 b"])
def test_ends_of_line_of_other_kinds_read_back(text):
    """PyYAML itself writes NEL as it stands, and reads it as a blank."""
    written = yaml_text({"notes": text})
    assert parse_yaml(written, "text") == yaml.safe_load(written) == {"notes": text}


def test_numbers_of_numpy_are_written_as_those_of_python():
    found = {
        "a": np.float64(0.1),
        "b": np.int64(3),
        "c": np.float32(0.25),
        "d": np.arange(2.0),
        "e": np.bool_(True),
    }
    assert parse_yaml(yaml_text(found), "a.yaml") == {"a": 0.1, "b": 3, "c": 0.25, "d": [0.0, 1.0], "e": True}
    with pytest.raises(TypeError, match="no plain value"):
        yaml_text({"a": object()})


@pytest.mark.parametrize("schema", ["fogml.twin/1", "none"])
def test_a_file_of_another_kind_is_told_by_its_schema(tmp_path: Path, schema: str) -> None:
    path = tmp_path / "steps.yaml"
    path.write_text("schema: fogml.programme/1\nname: cold\n")
    with pytest.raises(InputError) as told:
        read_yaml(path, schema=schema)
    assert str(told.value) == f"steps.yaml: schema 'fogml.programme/1', expected '{schema}'"
    assert read_yaml(path, schema="fogml.programme/1") == read_yaml(path)
