"""One reader of JSON: what it takes the standard library takes alike, and what is odd is one message."""

from __future__ import annotations

import json
import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.json_files import MOST_DEPTH, content_hash, json_object, parse_json, read_json

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"])),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text(st.characters(exclude_categories=["Cs"])), inner, max_size=4)
    ),
    max_leaves=20,
)


@given(VALUES, st.booleans())
@settings(max_examples=200)
def test_what_is_written_comes_back(value, ascii):
    assert parse_json(json.dumps(value, ensure_ascii=ascii).encode(), "x", "") == value


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[" * 200_000, "deep"),
        ("[" * 200_000 + "]" * 200_000, "deep"),
        ('{"a":' * 70 + "1" + "}" * 70, "deep"),
        ('{"a": 1, "a": 2}', "'a' is stated twice"),
        ("[NaN]", "NaN"),
        ("[-Infinity]", "-Infinity"),
        ("1e999", "too large"),
        ("-1e400", "too large"),
        ("9" * 10_000, "too large"),
        ("99999999999999999999", "too large"),
        ('"\\ud800"', "UTF-8"),
        (b"\xff\xfe", "UTF-8"),
        ("", "line 1"),
        ("\n\n{", "line 3"),
        ("\ufeff{}", "line 1"),
        ("[1, 2", "line 1"),
        ('"a\nb"', "line 1"),
    ],
)
def test_what_is_odd_is_told(text, told):
    with pytest.raises(InputError, match=f"^here.*{told}.*; do this$"):
        parse_json(text, "here", "do this")


def test_depth_is_counted():
    parse_json("[" * MOST_DEPTH + "]" * MOST_DEPTH, "x", "")
    with pytest.raises(InputError, match=f"more than {MOST_DEPTH} deep"):
        parse_json("[" * (MOST_DEPTH + 1) + "]" * (MOST_DEPTH + 1), "x", "")


def test_files(tmp_path):
    path = tmp_path / "a.json"
    with pytest.raises(InputError, match=r"a\.json: no such file; make it"):
        read_json(path, "make it")
    (tmp_path / "b.csv").write_text("")
    with pytest.raises(InputError, match=r"b\.csv/model\.json: no such file; name the folder"):
        read_json(tmp_path / "b.csv" / "model.json", "name the folder")
    path.write_text("[" + " " * (2 << 20) + "]")
    with pytest.raises(InputError, match="larger than 1 MB"):
        read_json(path, "make it", 1 << 20)
    assert read_json(path, "make it") == []
    with pytest.raises(InputError, match="cannot be read"):
        read_json(tmp_path, "make it")


def test_a_pipe_or_a_device_in_the_place_of_a_file_is_refused(tmp_path):
    """As a folder from a stranger may hold: reading it would wait, or go on, without end."""
    os.mkfifo(tmp_path / "model.json")
    (tmp_path / "outcome.json").symlink_to("/dev/zero")
    for name in ("model.json", "outcome.json"):
        with pytest.raises(InputError, match=rf"{name}: is no ordinary file; train again"):
            read_json(tmp_path / name, "train again")


def test_a_schema_is_asked_for():
    assert json_object({"schema": "a/1"}, "x", "a/1", "") == {"schema": "a/1"}
    for value in ([], None, {}, {"schema": "a/2"}, {"schema": ["a/1"]}):
        with pytest.raises(InputError, match=r"(expected|this one reads) 'a/1'"):
            json_object(value, "x", "a/1", "")


def test_a_hash_is_of_content_alone():
    document = {"b": 1.0, "a": ["é"]}
    one = content_hash(document, {"f": b"12", "g": b""})
    assert one == content_hash({"a": ["é"], "b": 1.0}, {"g": b"", "f": b"12"})
    others = [
        content_hash({"b": 1, "a": ["é"]}, {"f": b"12", "g": b""}),
        content_hash(document, {"f": b"1", "g": b"2"}),
        content_hash(document, {"f": b"12"}),
        content_hash(document, {"f": b"12", "h": b""}),
        content_hash(document),
    ]
    assert one not in others and len(set(others)) == len(others)
