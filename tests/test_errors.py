"""What messages quote is short and fit to be printed."""

from __future__ import annotations

from pathlib import Path

import pytest

import fogml
from fogml.errors import (
    LONGEST_MESSAGE,
    LONGEST_QUOTED,
    InputError,
    did_you_mean,
    in_one_line,
    install_words,
    listed,
    other_schema,
    quoted,
)
from fogml.export.noise_parameters import noise_text
from fogml.runs.columns import conversion
from fogml.runs.facts import facts_from
from fogml.runs.profile_schema import load_profile
from fogml.runs.shipped import shipped_run
from fogml.twin.programme import load_programme
from fogml.twin.twin_file import load_twin
from fogml.validation.limits import check_limits

NESTED: list = [1]
for _ in range(50):
    NESTED = [NESTED] * 9


@pytest.mark.parametrize(
    "value",
    [
        "x" * 10**6,
        "\x1b[2J\x00\u202e",
        "a\nb",
        "\udc80",
        NESTED,
        {"a" * 999: "b" * 999},
        10**4000,
        b"\x00" * 999,
    ],
)
def test_a_quoted_value_is_short_and_printable(value):
    text = quoted(value)
    assert len(text) <= LONGEST_QUOTED + 2
    assert text.isprintable()


def test_short_ones_are_quoted_as_they_are():
    assert quoted("a b") == "'a b'"
    assert quoted({"a": [1, None]}) == "{'a': [1, None]}"
    assert listed(["a", 1]) == "a, 1"
    assert listed(map(str, range(100))) == "0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 88 more"


@pytest.mark.parametrize(
    ("found", "newer"),
    [
        ("fogml.model/3", True),
        ("fogml.model/10", True),
        ("fogml.model/" + "9" * 9999, True),
        ("fogml.model/1", False),
        ("fogml.gap/3", False),
        ("fogml.model/x", False),
        (["fogml.model/3"], False),
        (10**4000, False),
        (None, False),
    ],
)
def test_a_file_of_a_newer_fogml_says_so(found, newer):
    told = other_schema(found, "fogml.model/2", "train again")
    assert ("update fogml" in told) == newer == ("train again" not in told)


def test_no_message_writes_on_the_terminal_or_fills_it():
    text = str(InputError("a\x1b[2J\n  ^" + "b" * 10**6))
    assert text.startswith("a\N{REPLACEMENT CHARACTER}[2J\n  ^b")
    assert len(text) <= LONGEST_MESSAGE


@pytest.mark.parametrize(
    ("name", "most", "told"),
    [
        ("trian", 1, "did you mean 'train'? "),
        ("train-run", 2, "did you mean 'train-runs' or 'train'? "),
        ("xyzzy", 3, ""),
        ("", 3, ""),
    ],
)
def test_names_that_look_alike_are_offered(name: str, most: int, told: str) -> None:
    assert did_you_mean(name, ["inspect", "train", "train-runs"], most) == told


@pytest.mark.parametrize(
    ("ask", "name", "meant"),
    [
        (lambda name: check_limits({name: 1.0}), "bias_stabilty", "bias_stability"),
        (lambda name: facts_from({name: 40.0}, "a.yaml"), "latitud", "latitude"),
        (load_profile, "thermal-cycle-mem", "thermal-cycle-mems"),
        (lambda name: conversion("gyro", name, "a.csv"), "dge/h", "deg/h"),
        (lambda name: noise_text({}, name), "kalib", "kalibr"),
        (load_programme, "four-position", "four-positions"),
        (load_twin, "tactcal", "tactical"),
        (shipped_run, "ring-laser-zz", "ring-laser-z"),
    ],
)
def test_what_ships_is_offered_where_a_name_looks_like_it(ask, name: str, meant: str) -> None:
    with pytest.raises(InputError, match=f"{name}.* did you mean '{meant}'"):
        ask(name)


def test_a_message_that_points_into_a_text_has_one_line_without_it() -> None:
    told = "a.csv: no temperature 'T_in'\n  T, T_in-T_out, T^2\n     ^\nthe run holds T"
    assert in_one_line(told) == "a.csv: no temperature 'T_in'; the run holds T"
    assert in_one_line("a.csv: T^2 is cold") == "a.csv: T^2 is cold"


def test_how_to_install_an_extra_is_said_at_one_place():
    """It is on no package index, and an editable install is for who works on it."""
    home = Path(fogml.__file__).parent
    said = [path.name for path in home.rglob("*.py") if "pip install '" in path.read_text("utf-8")]
    assert said == ["errors.py"] and "pip install '.[xlsx]'" in install_words("xlsx")
