"""Grids over shapes: dense enough, with what is linear left to columns."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap.shapes import grid
from fogml.twin.quantities import Quantity

TIME = 20.0 * np.arange(400)
TEMPERATURE = np.interp(TIME, [0.0, 0.5 * TIME[-1], TIME[-1]], [0.0, 40.0, 0.0])
SPANS = {"s": float(TIME[-1]), "degC": 40.0, "sample": 20.0}
PLACE = Quantity("centre_temperature", "degC", (10.0, 30.0), (10.0, 30.0), limits=(-50.0, 90.0))
WIDTH = Quantity("width", "degC", (3.0, 12.0), (3.0, 12.0), limits=(0.1, 50.0))
SHARE = Quantity("share", "1", (0.0, 1.0), (0.0, 1.0), limits=(0.0, 1.0))
PERIOD = Quantity("period", "s", (200.0, 4000.0), (200.0, 4000.0), limits=(1.0, 1e5))
PHASE = Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), limits=(-720.0, 720.0))


def bend(shape):
    return np.tanh((TEMPERATURE - shape["centre_temperature"]) / shape["width"])


def mixture(shape):
    return TEMPERATURE + shape["share"] * TEMPERATURE**2 / 40.0


def line(shape):
    return np.sin(2.0 * np.pi * TIME / shape["period"] + np.radians(shape["phase"]))


def rippled(shape):
    return 1.0 + line(shape)


SHAPES = {bend: (PLACE, WIDTH), mixture: (SHARE,), line: (PERIOD, PHASE), rippled: (PERIOD, PHASE)}


def declared(*shape):
    """What a grid asks of an effect."""
    usual = {q.name: q.typical("tactical") for q in shape}
    return SimpleNamespace(shape=shape, amplitudes=(), default_shape=lambda grade: usual)


def grid_of(response, spans=SPANS):
    return grid(declared(*SHAPES[response]), "tactical", response, spans)


def cosine(a, b):
    a, b = a - a.mean(), b - b.mean()
    return abs(a @ b) / np.linalg.norm(a) / np.linalg.norm(b)


def test_any_shape_within_its_range_is_near_a_node():
    nodes = [bend(n.shape) for n in grid_of(bend)]
    rng = np.random.default_rng(0)
    for _ in range(40):
        off = {"centre_temperature": rng.uniform(10.0, 30.0), "width": rng.uniform(3.0, 12.0)}
        assert max(cosine(bend(off), node) for node in nodes) > 0.97


def test_a_narrow_range_has_soft_ends():
    """A rule of thumb does not end at a sharp value; what no unit can have does."""

    def reached(low, high, lowest):
        tau = Quantity("time_constant", "s", (low, high), (low, high), limits=(lowest, 1e6))
        nodes = grid(declared(tau), "tactical", lambda s: np.exp(-TIME / s["time_constant"]), SPANS)
        values = np.sort([n.shape["time_constant"] for n in nodes])
        return values[0], values[-1], np.diff(values).max()

    assert reached(1200.0, 3600.0, 1.0)[:2] == pytest.approx((1200.0 / 1.3, 3600.0 * 1.3))
    assert reached(1200.0, 3600.0, 1.0)[2] < 400.0
    assert reached(1200.0, 3600.0, 1100.0)[:2] == pytest.approx((1100.0, 4680.0))
    assert reached(1200.0, 36000.0, 1.0)[:2] == pytest.approx((1200.0, 36000.0))


def test_a_line_of_any_period_and_phase_is_near_a_node():
    nodes = grid_of(line)
    rng = np.random.default_rng(1)
    for _ in range(25):
        true = line({"period": 1.0 / rng.uniform(1 / 4000, 1 / 200), "phase": rng.uniform(0.0, 360.0)})
        best = 0.0
        for node in nodes:
            span = np.column_stack([line(shape) for shape in node.draws])
            left = true - span @ np.linalg.lstsq(span, true, rcond=None)[0]
            best = max(best, 1.0 - (left @ left) / (true @ true))
        assert best > 0.9
    periods = np.array([n.shape["period"] for n in nodes])
    assert periods.max() == pytest.approx(4000.0) and periods.min() == pytest.approx(200.0)


def test_what_is_linear_needs_one_node_with_the_moments_of_its_prior():
    (node,) = grid_of(mixture)
    columns = np.array([[1.0, draw["share"]] for draw in node.draws]).T @ node.mix
    # Of a share evenly spread over 0 to 1: mean, mean square.
    np.testing.assert_allclose(columns @ columns.T, [[1.0, 0.5], [0.5, 1.0 / 3.0]])


@pytest.mark.parametrize("response, stays", [(line, 0.0), (rippled, 1.0)])
def test_an_angle_has_the_moments_of_all_directions(response, stays):
    node = grid_of(response)[0]
    turned = np.radians([draw["phase"] for draw in node.draws])
    columns = np.array([np.full(len(turned), stays), np.cos(turned), np.sin(turned)]) @ node.mix
    # Of a direction evenly spread all round: what stays does not go with it.
    np.testing.assert_allclose(columns @ columns.T, np.diag([stays, 0.5, 0.5]), atol=1e-12)


def test_no_line_is_faster_than_the_rows_can_show():
    nodes = grid_of(line, {**SPANS, "sample": 200.0})
    assert min(n.shape["period"] for n in nodes) >= 400.0
