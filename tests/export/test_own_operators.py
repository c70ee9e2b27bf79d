"""Operators and windows of one's own are declared once: batch, streaming, C and messages follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.export.c_program import CProgram, compiled_output, write_files
from fogml.export.c_source import c_source
from fogml.export.fixed_bound import fixed_point_error, fixed_point_lines
from fogml.export.plan import Plan
from fogml.export.points import History
from fogml.features import own
from fogml.features.operators import LAG, PLAY
from fogml.features.own import Function, Recursion, RecursionOperator, declare
from fogml.features.parse import parse_features
from fogml.features.traced import forgotten, larger, smaller, where
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.signals.clock import Clock
from fogml.signals.kernel_windows import Kernel, KernelStream, kernel_rate
from fogml.signals.windows import slope
from fogml.testing import check_feature
from tests.export.conftest import training_run
from tests.export.test_c_code import QUICK, SANITIZERS, WITH_SHADOW, disturbed, fast_run, needs_cc, outputs
from tests.export.test_project_files import hold_misra, needs

LINE = Kernel("line", (1.0, 0.0))
"""Weights that fall with age in a straight line: those of the least-squares slope."""
HANN = Kernel("hann", tuple(np.cos(np.linspace(0.0, np.pi, 33))))
BELL = Kernel("bell", tuple(np.cos(np.linspace(0.0, 0.5 * np.pi, 20)) ** 4))
BEND = Function(name="bend", parameters=("x", "1"), function=lambda x, w, k: k * w * np.tanh(x / w))
FOLD = Function(name="fold", parameters=("x",), function=lambda x, a: where(x < a, 0.5 * (a - x), abs(a - x)))
CREEP = Recursion(
    name="creep",
    parameters=("s",),
    start=lambda x, tau: (0.0,),
    step=lambda s, x, last, dt, tau: ((s[0] + x - last) / (1.0 + dt / tau),),
    value=lambda s, x, tau: x - s[0],
    time_constant=0,
    gain=1.0,
)
PEAK = Recursion(
    name="peak",
    start=lambda x: (x, x),
    step=lambda s, x, last, dt: (larger(s[0], x), smaller(s[1], x)),
    value=lambda s, x: s[0],
    settled=lambda s, x: s[0] - s[1] > 5.0,
    gain=1.0,
)
TWO_TIMES = Recursion(
    name="two_times",
    parameters=("s", "s"),
    start=lambda x, slow, fast: (x, x),
    step=lambda s, x, last, dt, slow, fast: (
        s[0] + forgotten(dt / slow) * (x - s[0]),
        s[1] + forgotten(dt / fast) * (x - s[1]),
    ),
    value=lambda s, x, slow, fast: s[0] - s[1],
    time_constant=0,
    gain=2.0,
)
COMPARED = Recursion(
    name="compared",
    parameters=("x",),
    start=lambda x, a: (0.0, x),
    step=lambda s, x, last, dt, a: (
        where(x == last, smaller(s[0] + dt, 20.0), 0.0),
        where((x != last) & (x >= a) | (x <= -a), 40.0 / (2.0 + abs(x)), s[1]),
    ),
    value=lambda s, x, a: s[0] + s[1],
    gain=10.0,
)
OPERATORS = "T_in, bend(T_in, 30 degC, 2), fold(T_out, 15 degC), creep(T_in-T_out, 300 s), peak(T_out)"
TEXT = f"{OPERATORS}, dT_in[hann, 60 s], diff(T_out)[line, 40 s]"


@pytest.fixture(autouse=True, scope="module")
def declared():
    held = dict(own._declared)
    for operator in (LINE, HANN, BELL, BEND, FOLD, CREEP, PEAK):
        declare(operator)
    yield
    own._declared.clear()
    own._declared.update(held)


def test_they_keep_the_contract_of_features():
    check_feature("T, dT[hann, 64 s], bend(T, 20 degC, 0.5)")
    check_feature("T, creep(T, 300 s), peak(T)^2")
    assert parse_features(TEXT).text == TEXT


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_a_kernel_that_falls_in_a_line_is_the_least_squares_slope(jitter):
    rng = np.random.default_rng(1)
    time = 2.0 * np.arange(400) + jitter * rng.uniform(-1.0, 1.0, 400)
    time[200:] += 50.0
    x = 20.0 + np.cumsum(rng.normal(0.0, 0.1, 400))
    found = kernel_rate(Clock(time, 2.0), x, 60.0, LINE, 60.0)
    expected = slope(Clock(time, 2.0), x, 60.0, unit_s=60.0)
    np.testing.assert_array_equal(found.full, expected.full)
    np.testing.assert_array_equal(found.counts, expected.counts)
    np.testing.assert_allclose(found.values, expected.values, atol=1e-9)


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_windows_of_many_samples_are_those_sample_by_sample(jitter):
    rng = np.random.default_rng(2)
    time = 0.2 * np.arange(1500) + 0.2 * jitter * rng.uniform(-1.0, 1.0, 1500)
    time[700:] += 4.0  # that the window spans
    time[1000:] += 50.0
    x, bell = 20.0 + np.cumsum(rng.normal(0.0, 0.02, 1500)), Kernel("falling", (1.0, 0.6, 0.5, -0.2))
    found = kernel_rate(Clock(time, 0.2), x, 30.0, bell, 60.0)
    stream = KernelStream(30.0, 0.2, 60.0, bell)
    values, full, counts = zip(*(stream.step(*sample) for sample in zip(time.tolist(), x.tolist())))
    np.testing.assert_allclose(found.values, values, atol=1e-8)
    np.testing.assert_array_equal(found.full, full)
    np.testing.assert_array_equal(found.counts, counts)


@needs_cc
@pytest.mark.parametrize(
    ("text", "dtype", "bound"),
    [(TEXT, "float64", 2e-6), (TEXT, "float32", 2e-3), (TEXT, "q31", 2e-3), (TEXT, "q15", 1e-2)],
)
def test_their_c_gives_what_compensate_gives(tmp_path, text, dtype, bound):
    model = make_model("polynomial", features=text).fit(training_run())
    source = c_source(Plan.of(model), dtype, [])
    run = disturbed(5, jitter=0.3)
    out, flag = outputs(CProgram(source, tmp_path, flags=SANITIZERS, running=WITH_SHADOW), source, run)
    expected = model.compensate(run)
    np.testing.assert_allclose(out, expected.compensated, atol=bound)
    assert np.count_nonzero(flag[1:] != expected.flag[1:]) <= (0 if dtype == "float64" else 2)
    assert set(flag.tolist()) == {1, 2}  # never as slow as in training


@needs_cc
@pytest.mark.parametrize(("dtype", "bound"), [("float64", 1e-9), ("float32", 1e-4), ("q31", 2e-3)])
def test_every_comparison_is_the_same_in_c(tmp_path, dtype, bound):
    """Of readings in steps of a quarter of a degree, which all formats hold, some of them the same again."""
    declare(COMPARED)
    time = np.arange(0.0, 4000.0, 2.0)
    T = np.round(4.0 * (5.0 + 20.0 * np.sin(time / 500.0) + 3.0 * np.sin(time / 60.0))) / 4.0
    run = Run("steps", {"time": time, "gyro": 0.1 * np.sin(time), "T_in": T, "T_out": T})
    model = make_model("polynomial", features="T_in, compared(T_in, 12 degC)").fit(run)
    source = c_source(Plan.of(model), dtype, [])
    out, _ = outputs(CProgram(source, tmp_path, flags=QUICK), source, run)
    columns = parse_features("compared(T_in, 12 degC)").transform(run)[:, 0]
    assert np.any((T[1:] == T[:-1]) & (columns[1:] > 5.0)) and np.ptp(columns) > 10.0
    np.testing.assert_allclose(out, model.compensate(run).compensated, atol=bound)


@needs_cc
@pytest.mark.parametrize(("dtype", "bound"), [("float64", 1e-9), ("float32", 1e-5), ("q31", 1e-3)])
def test_a_gap_may_be_many_of_an_operators_shorter_times(tmp_path, dtype, bound):
    """Gaps of 22, 40 and 67 times 3 s, none of which the longer time ends."""
    declare(TWO_TIMES)
    model = make_model("polynomial", features="T_in, two_times(T_in, 900 s, 3 s)").fit(training_run())
    source = c_source(Plan.of(model), dtype, [])
    time = np.arange(0.0, 6000.0, 2.0)
    keep = (np.abs(time - 4500.0) > 33.0) & (np.abs(time - 5000.0) > 60.0) & (np.abs(time - 5500.0) > 100.0)
    T = 20.0 + 15.0 * np.sin(time / 900.0)
    run = Run("gaps", {"time": time, "gyro": np.zeros(len(T)), "T_in": T, "T_out": T})[keep]
    out, flag = outputs(CProgram(source, tmp_path, flags=QUICK), source, run)
    expected = model.compensate(run)
    assert set(flag[run.time > 4000.0].tolist()) <= {0, 1}
    np.testing.assert_allclose(out, expected.compensated, atol=bound)


@needs_cc
@pytest.mark.parametrize("dtype", ["float32", "q31"])
def test_their_c_keeps_the_rules_of_misra(tmp_path, dtype):
    needs("cppcheck")
    model = make_model("polynomial", features=TEXT).fit(training_run())
    write_files(c_source(Plan.of(model, 0.1), dtype, []).files, tmp_path)
    hold_misra(tmp_path)


@needs_cc
@pytest.mark.parametrize("sample_s", [0.1, 2.0])
def test_bins_and_fixed_point_hold_a_window_of_ones_own(tmp_path, sample_s):
    text = "T_in, dT_in[hann, 64 s], diff(T_out)[bell, 40 s]"
    model = make_model("polynomial", features=text).fit(training_run())
    plan, run, found = Plan.of(model, sample_s), fast_run(sample_s), {}
    expected = model.compensate(run)
    for dtype in ("float64", "q31", "q15"):
        source = c_source(plan, dtype, [])
        assert source.layout.binned == (sample_s < 1.0)
        out, flag = outputs(CProgram(source, tmp_path, flags=QUICK), source, run)
        assert np.count_nonzero(flag != expected.flag) <= 2
        found[dtype] = out[expected.flag == 0]
    assert len(out) > len(found["q31"]) > 100
    assert np.abs(found["float64"] - expected.compensated[expected.flag == 0]).max() < 1e-4
    for dtype in ("q31", "q15"):
        off = np.abs(found[dtype] - found["float64"]).max()
        proven = fixed_point_error(plan, source.layout, dtype)
        assert off <= proven < 30.0 * off
        first, more, *_ = fixed_point_lines(proven, plan, source.layout)
        assert f"at most {proven:.3g} deg/h" in first and "are full" in more


@needs_cc
@pytest.mark.parametrize(("lost", "bound"), [("apart", 1e-4), ("often", 5e-3)])
def test_lost_samples_hardly_move_windows_in_bins(tmp_path, lost, bound):
    text = "T_in, dT_in[hann, 64 s], dT_in[slope, 90 s], diff(T_out)[block, 40 s]"
    model = make_model("polynomial", features=text).fit(training_run())
    time = 0.1 * np.arange(6000)
    place = np.arange(6000) % 400
    keep = (place < 103) | (place > 105)
    if lost == "often":
        keep = np.random.default_rng(4).random(6000) > 0.2
    T = 10.0 + np.cumsum(0.002 * np.sign(np.sin(time / 70.0)))
    plan, past = Plan.of(model, 0.1), History(time[keep], np.column_stack([T, T - 1.0])[keep], time[keep])
    source = c_source(plan, "float64", [])
    assert source.layout.binned and plan.sensors == ("T_in", "T_out")
    out, flag = CProgram(source, tmp_path, flags=QUICK).steps(past.time, past.temperatures, past.gyro)
    expected, told = plan.compensated(past.atoms(plan), past.gyro)
    off = np.abs(out - expected)[told != 2]
    assert len(off) > 3000 and off.max() < bound
    assert np.count_nonzero(flag != told) <= 2


def test_what_no_rate_is_told_of_has_no_proven_bound():
    late = declare(Kernel("late", (1.0, 1.0, 1.0, 0.0)))
    model = make_model("polynomial", features=f"T_in, dT_in[{late.name}, 4 s]").fit(training_run())
    plan = Plan.of(model)
    windows = c_source(plan, "q31", []).layout
    assert fixed_point_error(plan, windows, "q31") is None
    assert "not proven" in fixed_point_lines(None, plan, windows)[0]


def test_what_can_not_be_written_is_named():
    branching = replace(CREEP, name="branching", step=lambda s, x, last, dt, tau: (max(s[0], x),))
    step = Function(name="step", function=lambda x: np.where(x > 20.0, 1.0, 0.0))
    declare(branching), declare(step)
    for text, dtype, told in (
        ("T_in, branching(T_in, 300 s)", "float64", r"branching\(T_in, 300 s\).*larger\(a, b\)"),
        ("T_in, step(T_in)", "float64", r"step\(T_in\).*corners"),
        ("T_in, bend(T_in-T_out, 2 degC, 1)", "float64", "range of T_in-T_out"),
        ("T_in, creep(T_in, 1e9 s)", "q31", r"is 1e\+09.*float32"),
    ):
        model = make_model("polynomial", features=text).fit(training_run())
        with pytest.raises(InputError, match=told):
            c_source(Plan.of(model), dtype, [])
    with pytest.raises(InputError, match="fall from now"):
        Kernel("flat", (1.0, 1.0))
    with pytest.raises(InputError, match="taken"):
        declare(replace(PEAK, name="bend"))
    for name in ("d", "lag", "hysteresis", "beyond"):
        with pytest.raises(InputError, match="feature text's own"):
            declare(replace(PEAK, name=name))
    with pytest.raises(InputError, match="feature text's own"):
        declare(Kernel("slope", (1.0, 0.0)))
    with pytest.raises(InputError, match="a parameter of bend"):
        parse_features("bend(T)")


def test_columns_may_be_named_like_an_operator():
    run = Run("r", {"time": np.arange(9.0), "gyro": np.zeros(9), "peak": np.arange(9.0)})
    np.testing.assert_array_equal(parse_features("peak").transform(run)[:, 0], np.arange(9.0))


@pytest.mark.parametrize(("declared", "given"), [(LAG, (300.0,)), (PLAY, (6.0,))])
def test_the_quicker_way_is_the_declaration(declared, given):
    run = disturbed(5, jitter=0.3)
    x = run.columns["T_in"]
    quick, settled = declared.operator(given, 2.0).push(run.time, x)
    found, told = RecursionOperator(declared, given, 2.0).push(run.time, x)
    np.testing.assert_allclose(found, quick, atol=1e-10)
    np.testing.assert_array_equal(told, settled)


def test_products_and_quotients_of_fixed_point_are_those_of_whole_numbers(tmp_path):
    model = make_model("polynomial", features="T_in, lag(T_in, 300 s)").fit(training_run())
    code = c_source(Plan.of(model), "q31", []).files
    main = """#include "fogml_model.c"
#include <stdio.h>
int main(void)
{
    int64_t pair[2];
    while (fread(pair, sizeof pair, 1, stdin) == 1) {
        const int64_t made[2] = { times(pair[0], pair[1]), divided(pair[0], pair[1]) };
        fwrite(made, sizeof made, 1, stdout);
    }
    return 0;
}
"""
    rng = np.random.default_rng(1)
    sizes = 2.0 ** rng.uniform(0.0, 57.9, (500, 2))
    pairs = (sizes * rng.choice([-1.0, 1.0], sizes.shape)).astype(np.int64)
    pairs[:3] = [(0, 5), (5, 0), (-5, 0)]
    told = compiled_output({**code, "main.c": main}, "main.c", tmp_path, pairs.tobytes())
    most = 1 << 58
    for (a, b), (product, quotient) in zip(pairs.tolist(), np.frombuffer(told, dtype="<i8").reshape(-1, 2)):
        assert abs(product - max(-most, min(most, a * b / 2**32))) <= 1.0 + abs(product) * 1e-15
        exact = (a << 32) / b if b else most if a > 0 else -most if a < 0 else product + most
        assert b == 0 or abs(quotient - max(-most, min(most, exact))) <= 1.0 + abs(quotient) * 1e-15
