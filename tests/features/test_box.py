"""The trained box: learned from full training rows alone, and the smooth limit beyond it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.features.box import Box
from fogml.features.parse import parse_features
from fogml.runs.run import Run


def ramp(rate: float, start: float = 20.0, count: int = 600) -> Run:
    time = np.arange(float(count))
    return Run.from_columns(time=time, gyro=np.zeros(count), T=start + rate * time / 60.0)


def test_the_box_is_that_of_rows_that_count() -> None:
    up, down = ramp(1.0), ramp(-2.0)
    box = parse_features("T, dT, T*dT").fit([up, down]).box
    assert set(box) == {"T", "dT"}
    # Row 16 is the first that counts, with half of the rate; neither the start's temperature nor rate 0 do.
    assert box["T"] == pytest.approx((20.0 - 2.0 * 599 / 60.0, 20.0 + 599 / 60.0))
    assert box["dT"] == pytest.approx((-2.0, 1.0))
    only_up = parse_features("T, dT").fit(up).box
    assert only_up["T"] == pytest.approx((20.0 + 16 / 60.0, 20.0 + 599 / 60.0))
    assert only_up["dT"] == pytest.approx((0.5, 1.0), abs=0.02)


def test_a_fit_sees_only_the_training_runs() -> None:
    train = ramp(1.0)
    features = parse_features("T, dT").fit([train])
    before = dict(features.box)
    for test in (ramp(5.0, -80.0), ramp(-5.0, 200.0)):
        features.transform(test, limited=True)
        features.limit(*features.atom_values(test)[:2])
        assert dict(features.box) == before
        assert dict(parse_features("T, dT").fit([train]).box) == before


def test_a_fit_needs_a_window_that_counts() -> None:
    with pytest.raises(InputError, match="an eighth of a feature window"):
        parse_features("dT").fit([ramp(1.0, count=16)])
    with pytest.raises(InputError, match="fit them to training runs first"):
        parse_features("T").transform(ramp(1.0), limited=True)
    with pytest.raises(InputError, match="fit them to training runs first"):
        parse_features("T").stream(1.0, limited=True)


def test_a_box_can_be_taken_over() -> None:
    fitted = parse_features("T, dT").fit([ramp(1.0), ramp(-1.0)])
    taken = parse_features("dT, T").set_box(fitted.box)
    assert dict(taken.box) == dict(fitted.box)
    with pytest.raises(InputError, match="no bounds of T_in"):
        parse_features("T, T_in").set_box(fitted.box)
    with pytest.raises(InputError, match="low not above high"):
        parse_features("T").set_box({"T": (2.0, 1.0)})


@settings(max_examples=200, deadline=None)
@given(st.floats(-50.0, 50.0), st.floats(1e-3, 100.0), st.floats(-1e4, 1e4))
def test_the_limit_is_the_identity_inside_and_levels_off_beyond(
    low: float, span: float, value: float
) -> None:
    box = Box(np.array([low]), np.array([low + span]))
    high, width = float(box.high[0]), float(box.span[0])
    limited, outside = box.limit(np.array([[value]]), [None])
    got = limited[0, 0]
    if low <= value <= high:
        assert got == value and not outside[0]
    beyond = max(low - value, value - high, 0.0)
    assert outside[0] == (beyond > 0.01 * width)
    assert low - 0.05 * width <= got <= high + 0.05 * width
    assert abs(got - value) <= beyond
    # Slope 1 at the edge: the loss grows with the square of the distance.
    step = 1e-4 * width
    near = box.limit(np.array([[high + step], [high + 2 * step]]), [None])[0][:, 0]
    loss = high + np.array([1.0, 2.0]) * step - near
    np.testing.assert_allclose(
        loss, (np.array([1.0, 2.0]) * step) ** 2 / (0.05 * width), rtol=0.02, atol=1e-10
    )


def test_rows_before_a_window_holds_anything_keep_the_static_part() -> None:
    features = parse_features("T, dT").fit([ramp(1.0)])
    test = ramp(1.0, start=100.0)
    values, full, _ = features.atom_values(test)
    limited, outside = features.limit(values, full)
    assert limited[0, 1] == 0.0 and limited[1:, 1].all()
    high, span = features.box["T"][1], features.box["T"][1] - features.box["T"][0]
    assert outside.all()
    assert (limited[:, 0] <= high + 0.05 * span).all()
    _, elsewhere = parse_features("dT").set_box({"dT": (1.0, 2.0)}).limit(np.zeros((2, 1)), [True, False])
    assert elsewhere.tolist() == [True, False]


def test_nothing_is_copied_or_changed_inside_the_box() -> None:
    features = parse_features("T, dT").fit([ramp(1.0)])
    values, full, _ = features.atom_values(ramp(1.0))
    trained = values[full]
    assert features.limit(trained)[0] is trained
    far = np.full((3, 2), 1e6)
    features.limit(far)
    assert (far == 1e6).all()


def test_an_atom_that_never_moved_is_outside_at_any_other_value() -> None:
    features = parse_features("T").fit([ramp(0.0)])
    limited, outside = features.limit(np.array([[20.0], [20.1], [19.0]]))
    assert outside.tolist() == [False, True, True]
    np.testing.assert_allclose(limited[:, 0], 20.0, atol=1e-8)


def test_streams_tell_and_limit_what_is_outside() -> None:
    features = parse_features("T, dT, T*dT").fit([ramp(1.0)])
    test = ramp(3.0)
    values, full, _ = features.atom_values(test)
    _, outside = features.limit(values, full)
    stream = features.stream(1.0, limited=True)
    steps = [stream.step(t, {"T": v}) for t, v in zip(test.time.tolist(), test.columns["T"].tolist())]
    assert [step.outside for step in steps] == outside.tolist()
    assert outside.any() and not outside.all()
    np.testing.assert_allclose([s.values for s in steps], features.transform(test, limited=True), rtol=1e-9)
    np.testing.assert_allclose([s.atoms for s in steps], values, rtol=1e-9)
    assert not parse_features("T").stream(1.0).step(0.0, {"T": 1e9}).outside


def test_streams_refuse_wrong_input() -> None:
    stream = parse_features("T_in-T_out, dT_in").stream(1.0)
    columns = {"T1": 20.0, "T2": 21.0, "T3": 22.0}
    assert stream.step(0.0, columns).values[0] == pytest.approx(0.0)
    with pytest.raises(InputError, match="it must go up"):
        stream.step(0.0, columns)
    with pytest.raises(InputError, match="no column 'T3'"):
        stream.step(1.0, {"T1": 20.0, "T2": 21.0})
    with pytest.raises(InputError, match="no temperature 'T_out'"):
        parse_features("T_out").stream(1.0).step(0.0, {"T1": 20.0})
    with pytest.raises(InputError, match="widen"):
        parse_features("dT").stream(100.0)
