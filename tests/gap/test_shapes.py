"""Grids over shapes: dense enough, with what is linear left to columns; lines found by the periodogram."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import logsumexp

from fogml.gap.candidate_columns import candidate_columns
from fogml.gap.model import EffectValue
from fogml.gap.priors import LENGTH_WEIGHTS, LENGTHS, plausible_lengths
from fogml.gap.screening import Screening
from fogml.gap.shapes import AT_AMPLITUDE, Node, finer, grid
from fogml.twin.quantities import Quantity
from tests.gap.small_model import (
    KINDS,
    MEANS,
    SIZE,
    Kind,
    OnRun,
    SmallModel,
    framed,
    noise_of,
    ramps,
    recorded,
)

MODEL = SmallModel()
RUN = ramps("a", count=400, step=20.0)
SPANS = {"s": RUN.span_s, "degC": 40.0, "sample": 20.0}


def response_of(id):
    on = MODEL.on(RUN)
    return lambda shape: on.response(id, shape, MEANS)


def grid_of(id):
    return grid(KINDS[id], "tactical", response_of(id), SPANS)


def cosine(a, b):
    a, b = a - a.mean(), b - b.mean()
    return abs(a @ b) / np.linalg.norm(a) / np.linalg.norm(b)


def test_any_shape_within_its_range_is_near_a_node():
    response = response_of("bend")
    nodes = [response(n.shape) for n in grid_of("bend")]
    rng = np.random.default_rng(0)
    for _ in range(40):
        off = {"centre_temperature": rng.uniform(10.0, 30.0), "width": rng.uniform(3.0, 12.0)}
        assert max(cosine(response(off), node) for node in nodes) > 0.97


def test_a_narrow_range_has_soft_ends():
    """A rule of thumb does not end at a sharp value; what no unit can have does."""
    time = np.arange(0.0, 2e4, 20.0)

    def reached(low, high, lowest):
        tau = Quantity("time_constant", "s", (low, high), (low, high), limits=(lowest, 1e6))
        nodes = grid(
            Kind("tail", SIZE, (tau,)), "tactical", lambda s: np.exp(-time / s["time_constant"]), SPANS
        )
        values = np.sort([n.shape["time_constant"] for n in nodes])
        return values[0], values[-1], np.diff(values).max()

    assert reached(1200.0, 3600.0, 1.0)[:2] == pytest.approx((1200.0 / 1.3, 3600.0 * 1.3))
    assert reached(1200.0, 3600.0, 1.0)[2] < 400.0
    assert reached(1200.0, 3600.0, 1100.0)[:2] == pytest.approx((1100.0, 4680.0))
    assert reached(1200.0, 36000.0, 1.0)[:2] == pytest.approx((1200.0, 36000.0))


def test_a_line_of_any_period_and_phase_is_near_a_node():
    response = response_of("line")
    nodes = grid_of("line")
    rng = np.random.default_rng(1)
    for _ in range(25):
        true = response({"period": 1.0 / rng.uniform(1 / 4000, 1 / 200), "phase": rng.uniform(0.0, 360.0)})
        best = 0.0
        for node in nodes:
            span = np.column_stack([response(shape) for shape in node.draws])
            left = true - span @ np.linalg.lstsq(span, true, rcond=None)[0]
            best = max(best, 1.0 - (left @ left) / (true @ true))
        assert best > 0.9
    frequencies = np.array([n.frequency_hz for n in nodes])
    np.testing.assert_allclose([1.0 / n.shape["period"] for n in nodes], frequencies)
    assert frequencies.min() == pytest.approx(1 / 4000) and frequencies.max() == pytest.approx(1 / 200)


def test_what_is_linear_needs_one_node_with_the_moments_of_its_prior():
    (node,) = grid_of("mixture")
    columns = np.array([[1.0, draw["share"]] for draw in node.draws]).T @ node.mix
    # Of a share evenly spread over 0 to 1: mean, mean square.
    np.testing.assert_allclose(columns @ columns.T, [[1.0, 0.5], [0.5, 1.0 / 3.0]])
    assert grid_of("cube")[0].draws == ({},)


@pytest.mark.parametrize("id, stays", [("line", 0.0), ("rippled", 1.0)])
def test_an_angle_has_the_moments_of_all_directions(id, stays):
    node = grid_of(id)[0]
    turned = np.radians([draw["phase"] for draw in node.draws])
    columns = np.array([np.full(len(turned), stays), np.cos(turned), np.sin(turned)]) @ node.mix
    # Of a direction evenly spread all round: what stays does not go with it.
    np.testing.assert_allclose(columns @ columns.T, np.diag([stays, 0.5, 0.5]), atol=1e-12)


def test_no_line_is_faster_than_the_rows_can_show():
    slow = {**SPANS, "sample": 200.0}
    nodes = grid(KINDS["line"], "tactical", response_of("line"), slow)
    assert min(n.shape["period"] for n in nodes) >= 400.0


def with_line(period):
    line = EffectValue("line", 0.5, {"period": period, "phase": 70.0})
    rng = np.random.default_rng(int(period))
    made = recorded(RUN, MODEL, {"offset": 1.0, "slope": 0.4}, (line,), noise_of(RUN, rng))
    return framed([made], MODEL)


@pytest.mark.parametrize("size", [1.0, 3.0, 7.0, 11.0, 300.0])
def test_what_is_a_constant_but_for_round_off_gains_nothing(size):
    """Of a node inside the constants only round-off is left, which may be singular or below zero."""
    time = np.arange(400.0)
    line = np.sin(time / 7.0)[:, None]
    constant = np.random.default_rng(0).normal(size=(400, 1))
    frame = SimpleNamespace(
        runs=[slice(0, 400)],
        observations=[SimpleNamespace(row_s=20.0)],
        residual=line,
        fixed=1e8 * constant,
    )
    same = size * constant
    columns = np.concatenate([same, same, line, np.cos(time / 7.0)[:, None]], axis=1)
    inside, real = Screening(frame, []).gains(columns, [0, 2])[0]
    assert real == pytest.approx(0.5 * np.sum(line**2), rel=0.02)
    assert abs(inside) < 1e-6 * real


@pytest.mark.parametrize("period", [263.0, 771.0, 1900.0])
def test_the_true_line_is_kept_of_many(period):
    frame = with_line(period)
    screening = Screening(frame, [])
    nodes = grid_of("line")
    kept, middle = screening.lines(nodes)
    assert len(kept) < len(nodes) / 2 and middle not in kept
    nearest = min(range(len(nodes)), key=lambda i: abs(nodes[i].frequency_hz - 1.0 / period))
    assert nearest in kept
    found = candidate_columns(KINDS["line"], frame, "tactical", screening)
    assert min(abs(n.node.frequency_hz - 1.0 / period) for n, _ in found) < 0.5 / RUN.span_s
    # Of what is kept the true line fits best, by plain least squares as well.
    gains = []
    for _, columns in found:
        held = np.concatenate([frame.fixed, columns], axis=1)
        left = frame.residual - held @ np.linalg.lstsq(held, frame.residual, rcond=None)[0]
        gains.append(-float(np.sum(left**2)))
    best = found[int(np.argmax(gains))][0]
    assert abs(best.node.frequency_hz - 1.0 / period) < 0.5 / RUN.span_s


def test_a_weak_line_is_kept_beside_a_strong_one_that_was_found():
    weak, strong = 1900.0, 330.0
    lines = [
        EffectValue("line", size, {"period": period, "phase": 70.0})
        for size, period in ((0.3, weak), (30.0, strong))
    ]
    noise = noise_of(RUN, np.random.default_rng(2))
    frame = framed([recorded(RUN, MODEL, {}, tuple(lines), noise)], MODEL)
    nodes = grid_of("line")
    nearest = min(range(len(nodes)), key=lambda i: abs(nodes[i].frequency_hz - 1.0 / weak))
    found = frame.responses("line", [{"period": strong, "phase": phase} for phase in (0.0, 90.0)])
    assert nearest not in Screening(frame, []).lines(nodes)[0]
    assert nearest in Screening(frame, [], found).lines(nodes)[0]


class OnRunOfB(OnRun):
    """The model on a run, whose bend acts on the run named b alone."""

    def response(self, id, shape, constants):
        own = super().response(id, shape, constants)
        return own if self.run.name == "b" or id != "bend" else 0.0 * own


class ActsOnB(SmallModel):
    """The small model with a bend that acts on the run named b alone."""

    def on(self, run):
        return OnRunOfB(run)


def test_a_grid_follows_the_run_on_which_a_candidate_acts():
    # Where it does nothing, nothing depends on its shape.
    runs = [ramps("a", count=200, low=-10.0, high=50.0), ramps("b", count=200)]
    model = ActsOnB()
    frame = framed([recorded(run, model, {}) for run in runs], model)
    found = candidate_columns(KINDS["bend"], frame, "tactical", Screening(frame, []))
    for name in ("centre_temperature", "width"):
        assert len({n.node.shape[name] for n, _ in found}) > 3


def test_a_node_parts_within_what_it_stands_for():
    nodes = grid_of("line")
    frequencies = np.array([n.frequency_hz for n in nodes])
    spacing = np.diff(frequencies).min()
    parts = finer(KINDS["line"], nodes, nodes[7])
    found = np.array(sorted(n.frequency_hz for n in parts))
    np.testing.assert_allclose(
        found - frequencies[7], spacing * np.array([-0.4, -0.2, 0.0, 0.2, 0.4]), atol=1e-9
    )
    np.testing.assert_allclose([1.0 / n.draws[0]["period"] for n in parts], [n.frequency_hz for n in parts])
    # Along two axes, and none beyond the ends of either.
    nodes = grid_of("bend")
    ranges = {q.name: q.tactical for q in KINDS["bend"].shape}
    inner = next(n for n in nodes if all(n.shape[name] not in ranges[name] for name in ranges))
    assert len(finer(KINDS["bend"], nodes, inner)) == 9
    for node in nodes:
        for part in finer(KINDS["bend"], nodes, node):
            assert all(low - 1e-9 <= part.shape[name] <= high + 1e-9 for name, (low, high) in ranges.items())


def test_what_is_whole_is_not_parted_and_what_has_a_sign_keeps_it():
    harmonic = Quantity("harmonic", "1", (1.0, 8.0), (1.0, 8.0), "of the table")
    nodes = [Node({"harmonic": float(k)}, ({"harmonic": float(k)},)) for k in range(1, 9)]
    assert finer(SimpleNamespace(shape=(harmonic,)), nodes, nodes[3]) == (nodes[3],)
    about = [Node({AT_AMPLITUDE: a}, ({AT_AMPLITUDE: a},)) for a in (-60.0, -10.0, 0.1, 10.0, 60.0)]
    parts = finer(SimpleNamespace(shape=()), about, about[1])
    np.testing.assert_allclose([n.draws[0][AT_AMPLITUDE] for n in parts], [-10 - 50 / 3, -10, -10 + 10.1 / 3])


def test_a_long_line_between_two_nodes_loses_nothing_to_the_grid():
    nodes = grid_of("line")
    middle = np.mean([nodes[30].frequency_hz, nodes[31].frequency_hz])
    frame = with_line(1.0 / middle)

    def held(columns):
        columns = frame.without_constants(columns)
        left = true - columns @ np.linalg.lstsq(columns, true, rcond=None)[0]
        return 1.0 - float(left @ left) / float(true @ true)

    shape = {"period": 1.0 / middle, "phase": 70.0}
    true = frame.without_constants(frame.responses("line", [shape]))[:, 0]
    plain = max(held(frame.responses("line", node.draws)) for node in nodes)
    found = candidate_columns(KINDS["line"], frame, "tactical", Screening(frame, []))
    assert max(held(columns) for _, columns in found) > 1.0 - 0.2 * (1.0 - plain) and plain < 0.99


@pytest.mark.parametrize("id", ["line", "bend", "rippled", "cube"])
def test_whatever_is_parted_or_left_out_all_nodes_together_weigh_one(id):
    frame = with_line(771.0)
    found = candidate_columns(KINDS[id], frame, "tactical", Screening(frame, []))
    shares = [np.exp(n.log_weights - plausible_lengths(KINDS[id], n.size)) for n, _ in found]
    np.testing.assert_allclose(np.sum(shares, axis=0), 1.0, rtol=1e-9)


def test_nodes_that_are_left_out_count_through_the_middle_one(monkeypatch):
    # A cube with a ripple on top that is next to nothing: all frequencies do as well.
    frame = framed([recorded(RUN, MODEL, {}, (EffectValue("cube", 0.4),))], MODEL)

    def evidence():
        found = candidate_columns(KINDS["rippled"], frame, "tactical", Screening(frame, []))
        (left,) = frame.beside(np.concatenate([frame.residual, *(c for _, c in found)], axis=1))[:1]
        gains, first = [], 1
        for node, columns in found:
            gram = frame.beside(columns)
            fit = left[first : first + columns.shape[1]]
            inner = np.eye(len(fit)) + 400.0 * gram
            gain = 200.0 * fit @ np.linalg.solve(inner, fit) - 0.5 * np.linalg.slogdet(inner)[1]
            gains.append(gain + node.log_weights[2])
            first += columns.shape[1]
        return float(logsumexp(gains)), len(found)

    some, count = evidence()
    monkeypatch.setattr("fogml.gap.screening.MOST_LINES_TRIED", 10**6)
    monkeypatch.setattr("fogml.gap.candidate_columns.SEARCHED_FROM", 10**6)
    every, whole = evidence()
    assert count < whole / 3
    assert some == pytest.approx(every, abs=0.3)


def test_gains_of_screening_are_what_least_squares_gains():
    frame = with_line(771.0)
    screening = Screening(frame, [])
    nodes = grid_of("line")[::40]
    columns = frame.responses("line", [shape for node in nodes for shape in node.draws])
    starts = list(range(0, columns.shape[1], 2))
    for gain, node, a in zip(screening.gains(columns, starts)[0], nodes, starts):
        prior = np.zeros((2, 1))
        target = np.concatenate([frame.residual, prior])[:, 0]
        fixed = np.concatenate([frame.fixed, np.eye(2)])
        both = np.concatenate([fixed, np.concatenate([columns[:, a : a + 2], np.zeros((2, 2))])], axis=1)
        left = [target - c @ np.linalg.lstsq(c, target, rcond=None)[0] for c in (fixed, both)]
        expected = 0.5 * float(left[0] @ left[0] - left[1] @ left[1])
        assert gain == pytest.approx(expected, rel=1e-3, abs=1e-3), node.shape


def test_lengths_that_no_gyro_of_any_grade_has_weigh_less():
    inside = plausible_lengths(KINDS["cube"], 0.1)
    np.testing.assert_allclose(inside[:4], np.log(LENGTH_WEIGHTS[:4]))
    # 1000 times 0.1 deg/h is ten times the range's end.
    assert inside[-1] < np.log(LENGTH_WEIGHTS[-1]) - 1.0
    tiny = plausible_lengths(KINDS["cube"], 1e-5)
    assert tiny[0] < inside[0] - 3.0 and tiny[-1] > tiny[0]
    assert LENGTH_WEIGHTS.sum() == pytest.approx(1.0) and (np.diff(LENGTHS) > 0.0).all()
