"""Programmes: sentences, steps, files, what ships, and errors that point at the place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.twin.programme import (
    PROGRAMME_FOLDER,
    Programme,
    load_programme,
    programme_from,
    programme_names,
)
from fogml.twin.sentences import parse_action, parse_step
from fogml.twin.simulate import default_facts
from fogml.twin.steps import Hold, Ramp, Repeat, Setting, Soak, Turn, TurnTo
from fogml.twin.timeline import Timeline


@pytest.mark.parametrize(
    ("text", "step"),
    [
        ("soak at -40 degC for 1 h", Soak(-40.0, 3600.0)),
        ("Soak at \N{MINUS SIGN}40 °C for 1 h 30 min", Soak(-40.0, 5400.0)),
        ("soak at 300 K for 90 s", Soak(300.0 - 273.15, 90.0)),
        ("hold for 30 min", Hold(1800.0)),
        ("ramp to 60 degC at 1 degC/min", Ramp(60.0, 1.0)),
        ("ramp to 40degC at 10 °C/h", Ramp(40.0, 10.0 / 60.0)),
        ("repeat 3 times", Repeat(3, ())),
    ],
)
def test_steps_are_understood(text: str, step: Any) -> None:
    assert parse_step(text) == step


@pytest.mark.parametrize(
    ("text", "action"),
    [
        (
            "turn at 10 deg/s for 60 s, then -10 deg/s for 60 s, from minute 20",
            Turn(((10.0, 60.0), (-10.0, 60.0)), 1200.0),
        ),
        ("turn at 10 deg/s", Turn(((10.0, None),))),
        ("turn to 90 deg at 10 deg/s from 1 min 5 s", TurnTo(90.0, 10.0, 65.0)),
        ("turn by -720 deg at 20 deg/s", TurnTo(-720.0, 20.0, relative=True)),
        ("power on at minute 10", Setting("power", 1.0, 600.0)),
        ("power off for 10 min from minute 30", Setting("power", 0.0, 1800.0, 600.0)),
        ("fan off for 10 min, from minute 5", Setting("fan", 0.0, 300.0, 600.0)),
        ("fan at 50 % after the start", Setting("fan", 0.5)),
        ("compressor automatic from hour 1", Setting("compressor", None, 3600.0)),
        ("heater on", Setting("heater", 1.0)),
        ("yaw to 180 deg", Setting("yaw", 180.0)),
        ("humidity 20 % for 2 h", Setting("humidity", 20.0, 0.0, 7200.0)),
    ],
)
def test_actions_are_understood(text: str, action: Any) -> None:
    assert parse_action(text) == action


numbers = st.floats(-50.0, 100.0).map(lambda x: round(x, 3))
times = st.floats(1.0, 1e5).map(lambda x: round(x, 2))
starts = st.one_of(st.just(0.0), times)
turns = st.builds(Turn, st.lists(st.tuples(numbers, times), min_size=1, max_size=4).map(tuple), starts)
moves = st.builds(TurnTo, numbers, times.map(lambda t: t / 100.0), starts, st.booleans())
duties = st.sampled_from([0.0, 1.0, 0.25, 0.5])
switches = st.one_of(
    st.builds(Setting, st.just("power"), st.sampled_from([0.0, 1.0]), starts, st.none() | times),
    st.builds(Setting, st.just("fan"), duties, starts, st.none() | times),
    st.builds(
        Setting, st.sampled_from(["compressor", "heater"]), st.none() | duties, starts, st.none() | times
    ),
    st.builds(Setting, st.just("humidity"), st.none() | st.floats(0, 100), starts, st.none() | times),
    st.builds(Setting, st.just("yaw"), numbers, starts, st.none() | times),
    st.builds(Setting, st.just("radiation"), st.floats(0, 100), starts, st.none() | times),
)


@settings(max_examples=200, deadline=None)
@given(st.one_of(turns, moves, switches))
def test_an_action_reads_back_from_its_sentence(action: Any) -> None:
    assert parse_action(str(action)) == action


@settings(max_examples=100, deadline=None)
@given(
    st.one_of(
        st.builds(Soak, numbers, times),
        st.builds(Hold, times),
        st.builds(Ramp, numbers, times.map(lambda t: t / 1e4 + 0.01)),
    )
)
def test_a_step_reads_back_from_its_sentence(step: Any) -> None:
    assert parse_step(str(step)) == step


@pytest.mark.parametrize(
    ("steps", "message", "pointed_at"),
    [
        (["soak at -40 for 1 h"], "a temperature needs a unit", "for 1 h"),
        (["soak at -40 degC for 1"], "a time needs a unit", ""),
        (["soak -40 degC for 1 h"], "'at' was expected here", "-40"),
        (["soak at cold for 1 h"], "a temperature such as '-40 degC' was expected", "cold"),
        (["wait 3 h"], "'soak', 'hold', 'ramp' or 'repeat' was expected here", "wait"),
        (["ramp to 60 degC at -1 degC/min"], "stated above 0", "-1 degC/min"),
        (["ramp to 60 degC at 1 deg/s"], "'deg/s' is not one", "deg/s"),
        (["fan off for 10 min"], "'fan' is an action", "fan"),
        (["hold for 1 h soon"], "was not understood", "soon"),
        (["hold for -1 h"], "a time above 0", "-1 h"),
        (["hold for 1 h -30 min"], "a sign between them", "-30 min"),
        ([{"hold for 1 h": ["fan off from 1 h -30 min"]}], "a sign between them", "-30 min"),
        ([{"repeat 2.5 times": ["hold for 1 h"]}], "a whole number", "2.5"),
        ([{"hold for 1 h": ["hold for 1 h"]}], "'hold' is a step", "hold"),
        ([{"hold for 1 h": ["turn at 10 deg for 1 min"]}], "a table rate needs a unit", "deg for"),
        ([{"hold for 1 h": ["turn at 1 deg/s, then 2 deg/s"]}], "only the last rate", "2 deg/s"),
        ([{"hold for 1 h": ["turn to 90 deg at -3 deg/s"]}], "stated above 0", "-3"),
        ([{"hold for 1 h": ["fan at 150 %"]}], "between 0 and 100 %", "150"),
        ([{"hold for 1 h": ["power at 50 %"]}], "'on' or 'off' was expected", "at 50"),
        ([{"hold for 1 h": ["yaw to 180 deg from minute -3"]}], "counts from the beginning", "minute"),
    ],
)
def test_what_is_not_understood_is_pointed_at(steps: list[Any], message: str, pointed_at: str) -> None:
    with pytest.raises(InputError) as error:
        load_programme(["hold for 1 h", *steps])
    first, sentence, caret = str(error.value).split("\n")
    assert first.startswith("programme, step 2")
    assert message in first
    assert sentence[caret.index("^") :].startswith(pointed_at)


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        (["ramp to 25 degC at 1 degC/min"], r"step 1, 'ramp .*': the chamber is at 25 degC already"),
        (["ramp to 60 degC at 9 degC/min"], r"step 1, .* fastest rate is 5 degC/min"),
        (["soak at 400 degC for 1 h"], r"step 1: soak: temperature \[degC\] is 400"),
        (
            [
                "hold for 1 h",
                {"repeat 2 times": ["hold for 1 min", {"hold for 2 min": ["fan off from 3 min"]}]},
            ],
            r"step 2.2, 'hold for 2 min', action 'fan off from 3 min': this reaches to 3 min .* lasts 2 min",
        ),
        ([{"hold for 9 min": ["turn at 1 deg/s for 10 min"]}], r"reaches to 10 min"),
        ([{"hold for 1 min": ["turn to 170 deg at 1 deg/s"]}], r"reaches to 170.02 s"),
        (
            [{"hold for 1 h": ["turn at 10 deg/s for 60 s", "turn at 5 deg/s for 60 s from second 30"]}],
            r"action 'turn at 5 deg/s for 1 min, from 30 s': the turn before is not over",
        ),
        ([{"hold for 1 h": ["turn at 100 deg/s for 1 s"]}], r"needs 2 s to reach 100 deg/s"),
        (
            [{"hold for 1 h": ["turn at 90 deg/s for 60 s", "turn to 0 deg at 5 deg/s from minute 1"]}],
            r"still slows down",
        ),
        (
            [{"hold for 1 h": ["power off for 10 min", "power on at minute 5"]}],
            r"another setting of 'power' lasts until after",
        ),
        ([], r"a list of steps is needed"),
        ([{"repeat 2 times": None}], r"programme, step 1: a list of steps is needed"),
        ([3], r"step 1: a sentence was expected, found 3"),
    ],
)
def test_what_cannot_be_done_names_the_step(steps: list[Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_programme(steps)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"steps": ["hold for 1 h"], "speed": 3}, "unknown key 'speed'; known keys are schema, name"),
        ({"steps": ["hold for 1 h"], "schema": "fogml.twin/1"}, "schema 'fogml.twin/1', expected"),
        (
            {"steps": ["hold for 1 h"], "fastest_rate": "3 degC"},
            "key 'fastest_rate': a temperature rate needs",
        ),
        (
            {"steps": ["hold for 1 h"], "fastest_rate": 3},
            "key 'fastest_rate': a sentence was expected, found 3",
        ),
        ({"steps": ["hold for 1 h"], "start_temperature": "900 degC"}, "'start_temperature' is 900 degC"),
        ({"steps": ["hold for 1 h"], "power": "maybe"}, "'power' is 'maybe'"),
        ("hold for 1 h", "a programme is a list of steps"),
    ],
)
def test_faults_of_a_file_name_the_key(values: Any, message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        programme_from(values, "my.yaml")
    assert str(error.value).startswith("my.yaml")


def test_a_programme_reads_back_from_its_file(tmp_path: Path) -> None:
    for name in programme_names():
        programme = load_programme(name)
        path = tmp_path / f"{name}.yaml"
        path.write_text(programme.as_yaml(), encoding="utf-8")
        again = load_programme(path)
        assert again.steps == programme.steps
        assert again.as_dict() == programme.as_dict()


def test_python_and_yaml_say_the_same() -> None:
    turn = Turn(((-10.0, 60.0), (10.0, 60.0)), 1200.0)
    made = Programme([Repeat(2, [Soak(30.0, 1800.0, [turn]), Ramp(40.0, 1.0)])], fastest_rate=2.0)
    sentence = "turn at -10 deg/s for 60 s, then 10 deg/s for 60 s, from minute 20"
    inner = [{"soak at 30 degC for 30 min": sentence}, "ramp to 40 degC at 1 degC/min"]
    read = load_programme({"fastest_rate": "120 degC/h", "steps": [{"repeat 2 times": inner}]})
    assert made.as_dict() == read.as_dict()
    # Two soaks with the way there at 2 degC/min, two ramps.
    assert made.total_s == 60.0 * (2.5 + 30.0 + 10.0 + 5.0 + 30.0 + 10.0)


def test_an_unknown_name_lists_what_ships() -> None:
    with pytest.raises(InputError, match=r"no such programme; .* joint-staircase"):
        load_programme("nonsense")


def test_configs_show_the_same_files() -> None:
    link = Path(__file__).parents[2] / "configs" / "programmes"
    assert link.is_symlink() and link.resolve() == PROGRAMME_FOLDER.resolve()


def test_joint_staircase_is_that_of_the_patent() -> None:
    programme = load_programme("joint-staircase")
    assert programme.total_hours == pytest.approx(9.9, abs=0.05)
    block = Timeline(programme, 1.0).whole
    soaks = {}
    for number, name in enumerate(Timeline(programme, 1.0).step_names):
        part = block.step == number
        if name.startswith("soak"):
            (degrees,) = np.unique(block.set_point[part])
            soaks[float(degrees)] = (part.sum(), np.flatnonzero(block.table_rate[part]))
        else:
            assert np.abs(block.set_rate[part]) == pytest.approx(1.0)
    assert sorted(soaks) == [*np.arange(-40.0, 30.0, 10.0), 25.0, *np.arange(30.0, 80.0, 10.0)]
    assert soaks[25.0][0] == 1800 and len(soaks[25.0][1]) == 0
    for degrees, (seconds, turning) in soaks.items():
        if degrees != 25.0:
            first = 3000 if degrees == -40.0 else 1200
            assert seconds == (3600 if degrees == -40.0 else 1800)
            assert first < turning[0] <= first + 1 and turning[-1] == first + 120
    # 10 deg/s, clockwise first, 24 minutes in all.
    assert np.count_nonzero(block.table_rate) / 60.0 == pytest.approx(24.0, abs=0.1)
    assert block.table_rate[np.flatnonzero(block.table_rate)[10]] == -10.0


def test_cycles_are_those_of_the_papers() -> None:
    block = Timeline(load_programme("multi-point-cycle"), 60.0).whole
    assert block.set_point[[0, 65, 185, 285, 404]] == pytest.approx([25.0, -40.0, -40.0, 60.0, 60.0])
    for name, start, stop in (("up", -10.0, 40.0), ("down", 40.0, -10.0)):
        slow = Timeline(load_programme(f"ten-degrees-per-hour-{name}"), 60.0).whole
        assert slow.set_point[[0, 60, 360, 419]] == pytest.approx([start, start, stop, stop])
        assert np.abs(slow.set_rate).max() == pytest.approx(1.0 / 6.0)


def test_four_positions_go_clockwise_by_right_angles() -> None:
    line = Timeline(load_programme("four-positions"), 0.5)
    dwell = line.whole.table_rate == 0.0
    places = [np.unique(line.whole.angle[dwell & (line.whole.step == i)].round(9))[-1] for i in range(4)]
    ends = [line.whole.angle[line.whole.step == i][-1] for i in range(4)]
    assert ends == pytest.approx([0.0, -90.0, -180.0, -270.0], abs=1e-9)
    assert places[0] == 0.0
    assert line.power_windows == ((0.0, np.inf),)


def test_separating_has_all_that_separates() -> None:
    programme = load_programme("separating")
    assert programme.total_hours == pytest.approx(22.0, abs=0.5)
    line = Timeline(programme, 1.0)
    block = line.whole
    rates = np.unique(block.set_rate.round(6))
    assert {-2.0, -0.5, 0.5, 2.0} <= set(rates)
    assert len(line.power_windows) == 3
    for value in (0.0, 180.0):
        turned = np.unique(block.table_rate[block.yaw == value])
        assert {-100.0, -10.0, -1.0, -0.01, 0.01, 1.0, 10.0, 100.0} <= set(turned)
    assert (block.fan == 0.0).sum() >= 3600 and block.fan.max() == 1.0
    # Five soaks on both branches are turned in.
    turned_at = {line.step_names[i] for i in np.unique(block.step[np.abs(block.table_rate) == 100.0])}
    assert len(turned_at) >= 5


def test_a_programme_may_state_how_the_gyro_is_mounted() -> None:
    programme = programme_from({"input_axis": {"heading": 30.0}, "steps": ["hold for 60 s"]})
    assert programme.input_axis.heading == 30.0
    assert programme_from(programme.as_dict()).input_axis == programme.input_axis
    assert default_facts(programme).earth_rate_deg_h == pytest.approx(
        15.041067 * np.cos(np.radians(39.9)) * np.cos(np.radians(30.0))
    )
    assert default_facts(load_programme("multi-point-cycle")).input_axis == "up"
    with pytest.raises(InputError, match="input_axis"):
        programme_from({"input_axis": "sideways", "steps": ["hold for 60 s"]})


def test_a_programme_that_repeats_without_end_is_refused_at_once() -> None:
    with pytest.raises(InputError, match="whole number of at least 1"):
        parse_step("repeat 1e999 times")
    steps: list[Any] = ["hold for 1 s"]
    for _ in range(3):
        steps = [{"repeat 1000 times": steps}]
    with pytest.raises(InputError, match="1000000000 steps"):
        programme_from(steps)
