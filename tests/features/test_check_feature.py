"""The contract check passes the shipped features and catches builders that break it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.features import own
from fogml.features.features import Features
from fogml.features.own import Function, Recursion, declare
from fogml.features.parse import parse_features
from fogml.features.traced import larger
from fogml.signals.kernel_windows import Kernel
from fogml.testing import check_feature
from fogml.testing.features import synthetic_runs


@pytest.mark.parametrize(
    "text",
    [
        "T",
        "T, dT, T*dT",
        "T^1..5, dT^1..3",
        "T1^1..5, T2^1..5, T3^1..2, dT1^1..3, dT2^1..3",
        "T_in-T_out, d(T_in-T_out), sign(dT_in), T_in*sign(dT_in)",
        "dT[slope, 60 s], dT[exp, 120 s], dT[block, 30 s], diff(T), diff(T)[first]",
        "dT[first], diff(T)[slope, 20 s], diff(T)[exp, 30 s], sign(dT[exp, 200 s])",
        "d(0.5*T1+0.5*T3)*T2",
        "T, lag(T, 600 s), lag(T_in-T_out, 100 s)*T",
        "hysteresis(T), play(T, 0.5 degC)*dT",
        "since_on(400 s), T*since_on(1 h), lag(T, 60 s)",
        "T, beyond(T, -3 degC, 30.5 degC), T*beyond(power, 0, 20)",
        "power, d(power), supply^2, own_name*T, play(own_name, 2), lag(supply, 50 s)",
    ],
)
def test_shipped_features_keep_the_contract(text: str) -> None:
    check_feature(text)


class Ahead(Features):
    """Looks one sample ahead."""

    def atom_values(self, run, sample_s=None, **state):  # type: ignore[no-untyped-def]
        found = super().atom_values(run, sample_s, **state)
        return found._replace(values=np.roll(found.values, -1, axis=0))


class Leaky(Features):
    """Learns from what it transforms."""

    def transform(self, run, *, limited=False):  # type: ignore[no-untyped-def]
        columns = super().transform(run, limited=limited)
        if limited:
            self.fit([run])
        return columns


class Hard(Features):
    """Clips at the box's edge."""

    def limit(self, atom_values, full=None, *, linear=False):  # type: ignore[no-untyped-def]
        bounds = np.array(list(self.box.values()))
        _, outside = super().limit(atom_values, full)
        return np.clip(atom_values, bounds[:, 0], bounds[:, 1]), outside


class Frozen(Features):
    """Keeps stale values where windows are not full."""

    def atom_values(self, run, sample_s=None, **state):  # type: ignore[no-untyped-def]
        found = super().atom_values(run, sample_s, **state)
        found.values[~found.full] += 1.0
        return found


class Forgetful(Features):
    """Begins its memories anew with each block."""

    def atom_values(self, run, sample_s=None, memories=None, skip=0):  # type: ignore[no-untyped-def]
        return super().atom_values(run, sample_s, skip=skip)


@pytest.mark.parametrize(
    ("broken", "message"),
    [(Ahead, "later samples"), (Leaky, "changed the box"), (Hard, "corner"), (Frozen, "streaming")],
)
def test_broken_builders_are_caught(broken: type[Features], message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_feature(broken("T, dT"))


def test_a_memory_that_ends_with_a_block_is_caught() -> None:
    with pytest.raises(AssertionError, match="blocks"):
        check_feature(Forgetful("T, lag(T, 600 s)"))


def test_it_takes_features_and_text_alike() -> None:
    check_feature(parse_features("dT"))


def begun(x: float) -> tuple[float, ...]:
    return (x,)


def first(state: tuple[float, ...], x: float) -> float:
    return state[0]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"start": lambda x: [x]}, r"start gives \[20.0\], no tuple"),
        ({"step": lambda s, x, last, dt: (s[0], x)}, "no tuple of 1 numbers"),
        ({"step": lambda s, x, last, dt: (max(s[0], x),)}, r"step: .*larger\(a, b\)"),
    ],
)
def test_recursions_that_no_c_follows_from_are_caught(
    changed: dict[str, Any], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: dict[str, Any] = {"start": begun, "step": lambda s, x, last, dt: (larger(s[0], x),), "value": first}
    monkeypatch.setattr(own, "_declared", {})
    declare(Recursion(name="most", **made))
    check_feature("most(T)")
    monkeypatch.setattr(own, "_declared", {})
    declare(Recursion(name="most", **{**made, **changed}))
    with pytest.raises(AssertionError, match=message):
        check_feature("most(T)")


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda x: np.concatenate([x, x]), r"shape \(\d+,\) were expected of its function, not shape"),
        (lambda x: 1j * x, "not complex numbers"),
        (lambda x: x.nothing, "most.T. can't be worked out: AttributeError"),
        (lambda x: "a", "could not convert"),
    ],
)
def test_functions_that_make_no_numbers_are_named(
    function: Any, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(own, "_declared", {})
    declare(Function(name="most", function=function))
    with pytest.raises(InputError, match=message):
        check_feature("most(T)")


def test_functions_of_another_number_of_values_are_refused_where_they_are_declared() -> None:
    with pytest.raises(InputError, match=r"fewer: function takes \(x, w\); it gets 1 value and 0 parameters"):
        Function(name="fewer", function=lambda x, w: x)
    with pytest.raises(InputError, match=r"step takes .*; it gets 4 values and 1 parameter"):
        Recursion(
            name="fewer",
            parameters=("s",),
            start=lambda x, tau: (x,),
            step=lambda s, x, last, dt: (x,),
            value=lambda s, x, tau: x,
        )
    with pytest.raises(InputError, match="function is 3, not a function"):
        Function(name="fewer", function=3)  # type: ignore[arg-type]
    for weights in ((1.0, float("nan")), (1e308, 1e308, 1.0), ("a", 1.0)):
        with pytest.raises(InputError, match="window fewer"):
            Kernel("fewer", weights)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="there is no operator 'plai'"):
        parse_features("plai(T, 3 degC)")


def test_a_declaration_takes_anothers_place_where_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own, "_declared", {})
    declare(Function(name="most", function=lambda x: x))
    features, run = parse_features("most(T)"), synthetic_runs(parse_features("T"))[0]
    np.testing.assert_array_equal(features.transform(run)[:, 0], run.columns["T"])
    with pytest.raises(InputError, match="again=True"):
        declare(Function(name="most", function=lambda x: 2.0 * x))
    declare(Function(name="most", function=lambda x: 2.0 * x), again=True)
    np.testing.assert_array_equal(features.transform(run)[:, 0], 2.0 * run.columns["T"])
    with pytest.raises(InputError, match="a Function, a Recursion or a Kernel is declared, found function"):
        declare(lambda x: x)  # type: ignore[arg-type]
