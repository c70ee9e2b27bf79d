"""Which signatures look alike, against the correlations that the catalogue states."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.registry import effect

# Minutes and set point [degC].
SINGLE_RAMP = [(0, -40), (100, 60)]
PAPER_CYCLE = [(0, 25), (65, -40), (185, -40), (285, 60), (405, 60)]


def recorded(points: list[tuple[int, int]]) -> Inputs:
    """Chamber, case, outer and inner face 600, 300 and 500 s behind one another."""
    minutes, set_point = np.array(points, dtype=float).T
    time = np.arange(0.0, 60.0 * minutes[-1], 10.0)
    memory = Memory()
    case = memory.lag("case", time, np.interp(time / 60.0, minutes, set_point), 600.0)
    outer = memory.lag("outer", time, case, 300.0)
    inner = memory.lag("inner", time, outer, 500.0)
    board = memory.lag("board", time, case, 360.0)
    nodes = {"T_case": case, "T_out": outer, "T_in": inner, "T": inner, "T_electronics": board}
    return Inputs(time, nodes, np.zeros(len(time)), powered_on_s=0.0)


def signature(id: str, given: Inputs, **shape: float) -> FloatArray:
    return effect(id).signature(given.afresh(), **{**effect(id).default_shape(), **shape})


def alike(a: FloatArray, b: FloatArray) -> float:
    return float(abs(np.corrcoef(a, b)[0, 1]))


def warm_up(given: Inputs) -> FloatArray:
    return signature("warmup_bias", given, slow_time_constant=1800.0, slow_ratio=1e3)


def relaxation(given: Inputs) -> FloatArray:
    return signature("stress_relaxation", given, time_constant=3600.0, slow_share=0.0)


@pytest.mark.parametrize("points", [SINGLE_RAMP, PAPER_CYCLE])
def test_mohr_effect_looks_like_the_gradient_under_every_programme(points: list[tuple[int, int]]) -> None:
    given = recorded(points)
    assert alike(signature("shupe_mohr", given), given.gradient) > 0.98


def test_a_single_ramp_tells_hardly_anything_apart() -> None:
    given = recorded(SINGLE_RAMP)
    temperature = given.temperature("T")
    assert alike(warm_up(given), given.gradient) == pytest.approx(0.98, abs=0.01)
    assert alike(given.time, temperature) == pytest.approx(0.994, abs=0.01)
    assert alike(relaxation(given), temperature) == pytest.approx(0.99, abs=0.01)


def test_a_cycle_tells_warm_up_and_ageing_apart() -> None:
    given = recorded(PAPER_CYCLE)
    temperature = given.temperature("T")
    assert alike(warm_up(given), given.gradient) < 0.9
    assert alike(signature("ageing", given, time_constant=36e5), temperature) < 0.9
    assert alike(relaxation(given), temperature) == pytest.approx(0.91, abs=0.05)


def test_crosstalk_and_mismatch_look_alike_until_a_second_heat_input() -> None:
    for points in (SINGLE_RAMP, PAPER_CYCLE):
        given = recorded(points)
        coil, board = signature("proper_frequency_mismatch", given), signature("electronic_crosstalk", given)
        assert alike(coil, board) > 0.99


def test_temperature_times_rate_needs_both_signs_of_u_or_two_ramps() -> None:
    above = recorded([(0, 60), (100, 80)])
    assert alike(signature("shupe_mohr", above), signature("temperature_rate_product", above)) > 0.95
    given = recorded(PAPER_CYCLE)
    assert alike(signature("shupe_mohr", given), signature("temperature_rate_product", given)) < 0.9
