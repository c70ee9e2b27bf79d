"""Feature text: what it stands for, its canonical form, and errors that point at the place."""

from __future__ import annotations

import string

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.features.atoms import Atom
from fogml.features.features import Features
from fogml.features.grammar import parse_terms
from fogml.features.operators import Window
from fogml.features.own import METHODS
from fogml.features.parse import parse_features
from fogml.features.signal import TIME_ON, Signal
from fogml.features.terms import Term
from fogml.runs.run import Run

SENSORS = ["T", "T_in", "T_out", "T_chamber", "T_case", "T_electronics", "T1", "T2", "T12"]

coefficients = st.sampled_from([1.0, -1.0, 0.5, -2.0, 1e-7, 3e20]) | st.floats(0.01, 100.0)
temperatures = st.dictionaries(st.sampled_from(SENSORS), coefficients, min_size=1, max_size=3).map(Signal.of)
others = st.dictionaries(
    st.sampled_from(["detector", "light_2"]), coefficients, min_size=1, max_size=2
) | st.sampled_from(["power", "supply", "compressor"])
signals = temperatures | others.map(Signal.of)
windows = st.builds(
    Window, st.sampled_from(METHODS), st.sampled_from([64.0, 60.0, 0.5]) | st.floats(1e-3, 1e6)
)
windowed = st.builds(Atom, st.sampled_from(["value", "diff", "d"]), signals, windows)
directions = st.builds(Atom, st.just("sign"), temperatures, windows)
sizes = st.sampled_from([600.0, 0.5]) | st.floats(1e-3, 1e6)
memories = st.builds(Atom, st.sampled_from(["lag", "play"]), signals, st.none(), sizes)
decays = st.builds(Atom, st.just("since_on"), st.just(Signal.of(TIME_ON)), st.none(), sizes)
atoms = windowed | directions | memories | decays
terms = st.lists(st.tuples(atoms, st.integers(1, 4)), min_size=1, max_size=3).map(lambda f: Term(tuple(f)))
features = st.lists(terms, min_size=1, max_size=4, unique=True).map(Features.from_terms)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("T, dT, T*dT", ["T", "dT", "T*dT"]),
        ("T^1..5", ["T", "T^2", "T^3", "T^4", "T^5"]),
        ("dT[slope, 60 s]", ["dT[slope, 60 s]"]),
        ("dT[exp,2min]^1..2", ["dT[exp, 120 s]", "dT[exp, 120 s]^2"]),
        ("dT^2[slope, 60 s]", ["dT[slope, 60 s]^2"]),
        ("dT[block, 64 s], dT_in[block], d(T_out)[64 s]", ["dT", "dT_in", "dT_out"]),
        ("dT[slope]", ["dT[slope, 64 s]"]),
        ("d(T)[500 ms]", ["dT[block, 0.5 s]"]),
        ("T_in-T_out", ["T_in-T_out"]),
        ("-T_out + T_in", ["T_in-T_out"]),
        ("T_in-T_out^1..2", ["T_in-T_out", "(T_in-T_out)^2"]),
        ("(T_in-T_out)^1..2", ["T_in-T_out", "(T_in-T_out)^2"]),
        ("dT*T_in-T_out", ["(T_in-T_out)*dT"]),
        ("d(T_in-T_out)[exp, 120 s]", ["d(T_in-T_out)[exp, 120 s]"]),
        ("diff(T), diff(T)[first]", ["diff(T)", "diff(T)[first]"]),
        ("sign(dT)", ["sign(dT)"]),
        ("sign(d(T1))", ["sign(dT1)"]),
        ("sign(dT[slope, 60 s])*T", ["T*sign(dT[slope, 60 s])"]),
        ("sign(dT)[slope, 60 s]", ["sign(dT[slope, 60 s])"]),
        ("dT*T*T", ["T^2*dT"]),
        ("T^1..2*dT^1..2", ["T*dT", "T*dT^2", "T^2*dT", "T^2*dT^2"]),
        ("T1, T2^2, dT12", ["T1", "T2^2", "dT12"]),
        ("0.5*T1+0.5*T3", ["0.5*T1+0.5*T3"]),
        ("T*0.5*T1+0.5*T3", ["T*(0.5*T1+0.5*T3)"]),
        ("2*T", ["2*T"]),
        (" T ,\n\td ( T_in - T_out ) [ slope ,60s ] ^ 1 .. 2", None),
    ],
)
def test_text_stands_for(text: str, names: list[str] | None) -> None:
    wanted = names or ["T", "d(T_in-T_out)[slope, 60 s]", "d(T_in-T_out)[slope, 60 s]^2"]
    assert parse_features(text).names() == wanted


@settings(max_examples=80, deadline=None)
@given(features)
def test_the_text_of_features_parses_to_the_same_features(made: Features) -> None:
    again = parse_features(made.text)
    assert again == made
    assert again.text == made.text
    assert hash(again) == hash(made)
    assert parse_features(", ".join(made.names())).names() == made.names()
    assert parse_features(made.text.replace(" ", "")) == made


@settings(max_examples=120, deadline=None)
@given(
    st.lists(
        st.sampled_from(
            [*"TdT1259^*,()[]+-. \n", "..", "T_in", "dT", "diff", "sign", "slope", "first", " s", "e"]
        ),
        max_size=14,
    ).map("".join)
    | st.text(string.printable, max_size=12)
)
def test_any_text_parses_or_is_refused_with_a_caret_within_it(text: str) -> None:
    try:
        terms = parse_terms(text)
    except InputError as error:
        _, shown, caret, *_ = str(error).split("\n")
        assert caret.strip() == "^"
        assert len(caret) <= len(shown) + 1 or not text.strip()
    else:
        assert parse_terms(", ".join(term.text for term in terms)) == terms


@pytest.mark.parametrize(
    ("text", "at", "message"),
    [
        ("T, time", 3, "'time' is no input"),
        ("T, dT, T*gyro", 9, "'gyro' is no input"),
        ("T, power+T", 3, "different units can't be added: power [W], T [degC]"),
        ("lag(T)", 5, "',' expected before the time constant"),
        ("lag(T, 0 s)", 7, "more than 0"),
        ("lag(T, 4)", 8, "unit expected"),
        ("play(T, 4)", 9, "unit expected"),
        ("play(T, -4 degC)", 8, "a half width above 0 expected"),
        ("play(power, 4 degC)", 14, "'W' expected"),
        ("play(own, 4 degC)", 12, "no unit expected"),
        ("hysteresis(power)", 0, "not of a temperature"),
        ("beyond(T, 5 degC, 3 degC)", 10, "above the lower"),
        ("beyond(T, 5, 8 degC)", 11, "unit expected"),
        ("beyond(T, -1e999 degC, 8 degC)", 11, "too large"),
        ("beyond(T, 253 K, 333 K)", 14, "'degC' expected"),
        ("transition(T, 313 K, 5 K)", 18, "'degC' expected"),
        ("sine(T, 1e999 degC)", 8, "too large"),
        ("T, beyond(T)", 11, "',' expected before the lower bound"),
        ("T*(hysteresis(T))", 3, "several features"),
        ("sign(d(power))", 5, "direction of a temperature only"),
        ("since_on(T)", 9, "a time constant above 0 expected"),
        ("lag(T, -3 s)", 7, "a time constant above 0 expected, found '-'"),
        ("dTT", 1, "'TT' is not a temperature"),
        ("T,, dT", 2, "found ','"),
        ("T,", 2, "found the end"),
        ("", 0, "found the end"),
        ("dT[median, 64 s]", 3, "known methods: block, slope, exp, first"),
        ("dT[slope, 60]", 12, "known units: s, ms, min, h"),
        ("dT[slope, 60 day]", 13, "unit expected, found 'day'"),
        ("dT[slope 60 s]", 9, "']' expected"),
        ("dT[0 s]", 3, "more than 0"),
        ("dT[first, 5 s]", 8, "takes no window"),
        ("dT[slope, 60 s", 14, "']' expected to close the options, found the end"),
        ("T[slope, 60 s]", 1, "takes no options"),
        ("T^0", 2, "whole power from 1 to 20"),
        ("T^2.5", 2, "whole power"),
        ("T^21", 2, "whole power"),
        ("T^5..2", 5, "backwards"),
        ("dT-dT_in", 2, "d(T_in-T_out)"),
        ("T-dT", 2, "d(T_in-T_out)"),
        ("sign(T)", 5, "write sign(dT)"),
        ("sign(diff(T))", 5, "write sign(dT)"),
        ("diff T", 5, "'(' expected after diff"),
        ("(T_in-T_out", 11, "')' expected"),
        ("T dT", 2, "separated by commas"),
        ("T, T_in, T", 9, "T is there twice"),
        ("T^1..3, T*T", 8, "T^2 is there twice"),
        ("T-T", 0, "they cancel"),
        ("2T", 1, "'*' expected"),
        ("T; dT", 1, "unexpected ';'"),
    ],
)
def test_errors_point_at_the_place(text: str, at: int, message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_features(text)
    lines = str(caught.value).split("\n")
    assert message in str(caught.value)
    assert lines[1] == f"  {text}"
    assert lines[2] == "  " + " " * at + "^"


def test_what_can_be_no_feature_lists_what_is_known() -> None:
    with pytest.raises(
        InputError, match=r"T_in, T_out.*T1, T2.*d\(x\).*sign\(dT\).*lag\(.*block, slope, exp, first"
    ):
        parse_features("time")


@pytest.mark.parametrize(
    ("text", "at", "message", "hint"),
    [
        ("T, tempo", 3, "no column 'tempo'", "the run holds T, power"),
        ("T, d(pwer)", 5, "no column 'pwer'", "did you mean 'power'?"),
        (
            "T*dT_out",
            3,
            "no temperature 'T_out'",
            "the run holds T; call the column that measures it 'T_out [degC]', or let an import profile join "
            "the log that does",
        ),
        (
            "T, since_on(400 s)",
            3,
            "time since power-on is not known",
            "state 'powered_on' [s] in the side file",
        ),
    ],
)
def test_a_column_that_a_run_lacks_is_pointed_at(text: str, at: int, message: str, hint: str) -> None:
    columns = {"time": np.arange(300.0), "gyro": np.zeros(300), "T": np.zeros(300), "power": np.ones(300)}
    features, run = parse_features(text), Run("a.csv", columns)
    for use in (features.atom_values, features.transform):
        with pytest.raises(InputError) as caught:
            use(run)
        lines = str(caught.value).split("\n")
        assert lines[0].startswith("a.csv: ") and message in lines[0]
        assert lines[1:] == [f"  {features.text}", "  " + " " * at + "^", hint]


def test_hysteresis_stands_for_plays() -> None:
    assert parse_features("hysteresis(T_in)^1..2*power").names()[:2] == [
        "power*play(T_in, 4 degC)",
        "power*play(T_in, 4 degC)^2",
    ]


def test_objects_refuse_what_text_cannot_say() -> None:
    with pytest.raises(InputError, match="'gyro' can't be an input"):
        Signal.of("gyro")
    with pytest.raises(InputError, match="a positive number was expected"):
        Atom("lag", Signal.of("T"))
    with pytest.raises(InputError, match="none was expected"):
        Atom("value", Signal.of("T"), memory=4.0)
    with pytest.raises(InputError, match="cancel"):
        Signal((("T", 1.0), ("T", -1.0)))
    with pytest.raises(InputError, match="coefficient"):
        Signal.of({"T": float("nan")})
    with pytest.raises(InputError, match="no method 'median'"):
        Window("median")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="positive number"):
        Window("slope", -1.0)
    with pytest.raises(InputError, match="no operator"):
        Atom("dd", Signal.of("T"))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="whole number from 1"):
        Term(((Atom("value", Signal.of("T")), 0),))
    with pytest.raises(InputError, match="no factor"):
        Term(())
    with pytest.raises(InputError, match="a text such as"):
        Features(["T"])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("(" * 3000 + "T" + ")" * 3000, "more than 10 parentheses within each other"),
        ("(" * 3000, "more than 10 parentheses within each other"),
        ("*".join(["T"] * 1000), "a product of more than 20 factors"),
        ("T1^1..20*T2^1..20*T3^1..20*T4^1..20*T5^1..20*T6^1..20", "more than 1000 terms"),
        (", ".join(f"T{i}" for i in range(1, 1003)), "more than 1000 terms"),
        ("T," * 6000, "12000 characters long"),
        ("T" + " " * 20_000, "20001 characters long"),
        ("1e999*T", "coefficient inf"),
        ("1e308*T+1e308*T", "add up to more"),
        ("T^" + "9" * 5000, "a whole power from 1 to 20"),
        ("T" + "9" * 5000 + ", (", "expected, found the end"),
        ("dT[block, " + "9" * 400 + " s]", "window"),
        ("dT[block, 1e308 h]", "window"),
        ("T^\u0663", "unexpected"),
        ("T\u0661", "unexpected|unknown"),
        ("\u0663*T", "unexpected"),
        ("\x00", "unexpected"),
        ("\ud800", "unexpected"),
    ],
)
def test_text_without_bounds_is_told_with_its_place(text, told):
    with pytest.raises(InputError, match=told) as error:
        parse_features(text)
    message = str(error.value)
    assert len(message) < 1000 and message.count("\n") <= 3
    if len(text) > 100:
        shown, mark = message.split("\n")[1:3]
        assert mark.strip() == "^" and len(shown) < 100


@given(st.text(st.sampled_from("T12_indof()[]*^.,+-d 0"), max_size=60))
@settings(max_examples=120)
def test_any_text_is_features_or_one_message(text):
    try:
        features = parse_features(text)
    except InputError:
        return
    assert parse_features(features.text) == features


def test_beyond_is_what_levelling_within_a_twentieth_lacks_of_levelling_within_half() -> None:
    atom = parse_features("beyond(T, -20 degC, 60 degC)").atoms[0]
    T = np.array([-300.0, -60.0, -20.0, 0.0, 60.0, 60.001, 100.0, 1e6])
    operator = atom.memory_operator(1.0)
    assert operator is not None
    values, settled = operator.push(T, T)
    away = np.array([-280.0, -40.0, 0.0, 0.0, 0.0, 0.001, 40.0, 1e6 - 60.0])
    size = np.abs(away)
    np.testing.assert_allclose(values, np.sign(away) * (40 * size / (40 + size) - 4 * size / (4 + size)))
    assert settled.all() and np.abs(values).max() < 36.0


def test_kelvins_stand_for_degrees_where_no_temperature_is_meant() -> None:
    assert parse_features("play(T, 4 K)") == parse_features("play(T, 4 degC)")
    assert parse_features("beyond(T_in-T_out, 1 K, 2 K)") == parse_features(
        "beyond(T_in-T_out, 1 degC, 2 degC)"
    )
