"""How far a gap closes: the figures by hand, the floor by drawing noise, intervals that hold."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.gap.fitting import fit_model
from fogml.gap.how_far import averages, how_far
from fogml.gap.model import EffectValue
from fogml.gap.noise import Noise
from fogml.gap.observation import observe
from fogml.signals.noise_fit import NoiseFit, NoisePrior
from tests.gap.small_model import NOISE, SmallModel, dense, framed, noise_of, ramps, recorded

MODEL = SmallModel()
TRUE = {"offset": 1.0, "slope": -0.5}
BEND = EffectValue("bend", 1.0, {"centre_temperature": 18.0, "width": 6.0})
# As after a static run: N within a per cent, B and K not quite.
KNOWN = Noise(NOISE, NoiseFit(NOISE, np.diag([1e-4, 1e-3, 1e-2]), NoisePrior(NOISE), 0.0, 1), "known")


def case(seed, effects=(BEND,), fitted=(BEND,)):
    """Held-out observation with the fits of a run before it, without and with effects."""
    rng = np.random.default_rng(seed)
    first, held = ramps("a", count=240), ramps("h", count=300, turns=3, low=5.0)
    made = recorded(first, MODEL, TRUE, effects, noise_of(first, rng))
    frame = framed([made], MODEL)
    before = fit_model(frame.observations, frame.whiteners, MODEL.constants)
    after = before
    if fitted:
        after = fit_model(
            frame.observations,
            frame.whiteners,
            MODEL.constants,
            list(fitted),
            MODEL.candidates(),
            MODEL.grade,
            before.constants,
        )
    o = observe(recorded(held, MODEL, TRUE, effects, noise_of(held, rng)), MODEL)
    return o, before, after


def judge(o, before, after, seed=0):
    return how_far(o, MODEL.constants, before, after, KNOWN, np.random.default_rng(seed))


def test_every_figure_is_what_plain_averages_give():
    o, before, after = case(1)
    far = judge(o, before, after)
    assert far.averaging_s == 100.0 and far.unit == "deg/h" and far.run == "h"

    def rms(constants, effects=()):
        gap = o.run.gyro - o.model.output(constants, effects)
        return float(np.sqrt(np.mean(gap[: 5 * (len(gap) // 5)].reshape(-1, 5).mean(axis=1) ** 2)))

    assert far.before == pytest.approx(rms({"offset": 0.0, "slope": 0.0}))
    assert far.recalibrated == pytest.approx(rms(before.constants))
    assert far.after == pytest.approx(rms(after.constants, after.effects))
    formula = (far.recalibrated**2 - far.after**2) / (far.recalibrated**2 - far.floor**2)
    assert far.closed == pytest.approx(formula)
    assert far.closed_ci90[0] < far.closed < far.closed_ci90[1]


def test_the_floor_is_the_mean_square_of_drawn_noise():
    o, before, after = case(2)
    far = judge(o, before, after)
    root = np.linalg.cholesky(dense(o.time, o.row_s))
    drawn = root @ np.random.default_rng(3).standard_normal((len(o), 3000))
    means = drawn.reshape(-1, 5, 3000).mean(axis=1)
    # Flicker slower than a few run lengths may count with the constants: between without and with it.
    within = np.mean(means**2) - np.mean(means.mean(axis=0) ** 2)
    assert 0.97 * within < far.floor**2 < 1.03 * np.mean(means**2)


def test_with_nothing_to_close_closed_is_not_told():
    o, before, after = case(4, effects=(), fitted=())
    far = judge(o, before, after)
    assert far.closed is None and far.closed_ci90 is None and "floor" in far.note
    assert far.after == far.recalibrated


def test_a_wrong_effect_that_does_harm_is_told_by_a_negative_figure():
    o, before, after = case(5)
    wrong = EffectValue("bend", -1.0, dict(BEND.shape))
    bad = type(after)(after.constants, (wrong,), after.names, after.covariance, after.square, after.rows)
    far = judge(o, before, bad)
    assert far.closed < 0.0 and far.after > far.recalibrated


def test_intervals_hold_what_the_truth_closes():
    inside = 0
    for seed in range(16):
        o, before, after = case(200 + seed)
        far = judge(o, before, after, seed)
        low, high = far.closed_ci90
        inside += low <= 1.0 <= high
    # 90 % of 16 is 14.4 with a deviation of 1.2.
    assert inside >= 10


def test_windows_keep_off_gaps_and_are_whole():
    run = ramps("g", count=400)
    kept = np.concatenate([np.arange(0, 103), np.arange(160, 400)])
    parted = type(run)("g", {name: values[kept] for name, values in run.columns.items()}, run.facts)
    windows = averages(observe(parted, MODEL))
    rows = np.where(parted.time < 3000.0, 0.0, 1.0)
    assert set(windows.of(rows)) == {0.0, 1.0}
    assert len(windows.time) == 103 // 5 + 240 // 5
    assert windows.window_s == 100.0
    coarse = averages(observe(parted, MODEL), averaging_s=5.0)
    assert coarse.window_s == 20.0 and len(coarse.time) == len(parted)
