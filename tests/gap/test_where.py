"""Where a gap lies: what was put in at known places comes out there, and noise alone is nowhere."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap.settings import STANDARD
from fogml.gap.where import GapOnRun, _changes, _temperatures, averages, where
from fogml.runs.regimes import regimes
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel

NOISE = NoiseModel(0.02, 0.03, 0.05)
TIME = 10.0 * np.arange(1000)
TEMPERATURE = np.interp(TIME, [0.0, 0.5 * TIME[-1], TIME[-1]], [0.0, 40.0, 0.0])
RUN = Run.from_columns("a", time=TIME, gyro=np.zeros(1000), T=TEMPERATURE)
ROOT = np.linalg.cholesky(NOISE.covariance(TIME, 10.0, NOISE.ladder(10.0, 30.0 * (TIME[-1] + 10.0))))


class Rows:
    """The run, or what is kept of it, a row a sample."""

    run, row_s = RUN, 10.0

    def __init__(self, kept=slice(None)):
        self.time_s, self.temperature, self.regime = TIME[kept], TEMPERATURE[kept], regimes(RUN).labels[kept]

    def __len__(self):
        return len(self.time_s)


def located(added, seed=0, systematic=None, stages=None):
    gap = added + ROOT @ np.random.default_rng(seed).standard_normal(len(RUN))
    part = GapOnRun(Rows(), gap, added if systematic is None else systematic)
    return where([part], {"bias": 1.0} if stages is None else stages, NOISE)


@pytest.fixture(scope="module")
def bump():
    """0.5 deg/h from 2000 to 4000 s, and for 300 s later on."""
    inside = (TIME >= 2000.0) & (TIME < 4000.0)
    blip = (TIME >= 7000.0) & (TIME < 7300.0)
    return located(0.5 * (inside | blip))


def test_shares_of_each_list_add_to_one(bump):
    for shares in (bump.stage, bump.regime):
        assert sum(s.share for s in shares) == pytest.approx(1.0)
        assert all(0.0 <= s.share <= 1.0 for s in shares)
    for share in bump.regime:
        low, high = share.share_ci90
        assert low <= share.share <= high


def test_stages_share_as_their_energies():
    found = located(np.zeros(len(RUN)), stages={"bias": 3.0, "sensor": 1.0, "rig": 0.0})
    assert [(s.name, s.share) for s in found.stage] == [("bias", 0.75), ("sensor", 0.25)]
    assert located(np.zeros(len(RUN)), stages={}).stage == ()


def test_segments_are_where_it_was_and_not_shorter_than_ten_minutes(bump):
    (segment,) = bump.segments
    assert segment.run == "a"
    assert segment.from_s == pytest.approx(2000.0, abs=100.0)
    assert segment.to_s == pytest.approx(4000.0, abs=100.0)
    assert segment.to_s - segment.from_s >= STANDARD.reported.segment_s
    assert segment.excess_rms == pytest.approx(0.5, abs=0.15)


def test_no_segment_reaches_over_a_gap_of_the_record():
    """What exceeds on both sides of a gap is two segments, and nothing is said of the hours between."""
    kept = (TIME < 2500.0) | (TIME >= 6000.0)
    added = 0.5 * ((TIME >= 1500.0) & (TIME < 7000.0))[kept]
    rows, noise = Rows(kept), (ROOT @ np.random.default_rng(1).standard_normal(len(RUN)))[kept]
    found = where([GapOnRun(rows, added + noise, added)], {}, NOISE).segments
    assert [(s.from_s, s.to_s) for s in found] == [
        pytest.approx((1495.0, 2495.0), abs=100.0),
        pytest.approx((5995.0, 6995.0), abs=100.0),
    ]


def test_changes_are_gradients_within_each_stretch():
    course = np.array([0.0, 1.0, 3.0, 9.0, 8.0, 20.0, 19.0, 17.0])
    expected = np.concatenate([np.gradient(course[:3]), np.gradient(course[3:5]), np.gradient(course[5:])])
    assert _changes(course, np.repeat([0, 1, 2], [3, 2, 3])) == pytest.approx(expected)
    assert _changes(course[:2], np.array([0, 1])) == pytest.approx([0.0, 0.0])


def test_windows_of_stretches_that_are_shorter_are_as_long_as_those():
    kept = (np.arange(1000) % 8 < 5) & (np.arange(1000) < 803)
    rows = Rows(kept)
    windows = averages(rows, 100.0)
    # A hundred stretches of five rows, and a last one of three.
    assert windows.window_s == 50.0 and len(windows.time) == 100
    white = np.random.default_rng(2).standard_normal(len(rows))
    expected = white[:500].reshape(100, 5).mean(axis=1)
    assert windows.of(white) == pytest.approx(expected)
    assert list(windows.stretch) == list(range(100))


def test_temperatures_of_the_gap_are_those_where_it_was():
    warm = RUN.columns["T"] > 30.0
    found = located(0.8 * warm)
    for t in found.temperature:
        expected = 0.8 if t.from_degc >= 30.0 else 0.0
        assert t.excess_rms == pytest.approx(expected, abs=0.2)
        assert t.significant == (expected > 0.0)


def test_up_and_down_are_told_apart():
    rising = np.gradient(RUN.columns["T"]) > 0.0
    found = located(np.where(rising, 0.4, -0.4))
    for t in found.temperature:
        assert t.mean_up == pytest.approx(0.4, abs=0.25) and t.mean_down == pytest.approx(-0.4, abs=0.25)


def test_three_averages_each_way_tell_a_way_and_two_do_not():
    rising = np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0])
    for count, told in ((3, True), (2, False)):
        way = np.concatenate([rising[:count], rising[-count:]])
        held = SimpleNamespace(
            temperature=np.full(len(way), 21.0), gap=0.5 * way, floor=np.full(len(way), 1e-4), rising=way
        )
        (only,) = _temperatures([held], STANDARD.reported)
        assert (only.mean_up, only.mean_down) == ((0.5, -0.5) if told else (None, None))


def test_regimes_of_the_gap_are_those_where_it_was():
    labels = regimes(RUN)
    name = "ramp_down"
    added = 0.6 * (labels.labels == labels.names.index(name))
    found = {s.name: s for s in located(added).regime}
    assert found[name].share > 0.85 and found[name].significant
    assert found[name].excess_rms == pytest.approx(0.6, abs=0.15)


def test_time_scales_of_a_slow_gap_are_the_long_ones():
    slow = located(0.4 * np.sin(2.0 * np.pi * TIME / 9000.0))
    assert [t.tau_s for t in slow.timescale] == [10.0, 30.0, 100.0, 300.0, 1000.0]
    excess = [t.excess for t in slow.timescale]
    assert excess == sorted(excess) and slow.timescale[-1].significant
    # By hand at 10 s: samples of noise and of the wave over samples of noise.
    floor = float(np.mean(np.diag(NOISE.covariance(TIME, 10.0, NOISE.ladder(10.0, TIME[-1] + 10.0)))))
    assert excess[0] == pytest.approx(np.sqrt((0.08 + floor) / floor), rel=0.1)


def test_noise_alone_is_significant_nowhere():
    flagged, told = 0, 0
    for seed in range(6):
        found = located(np.zeros(len(RUN)), seed)
        assert found.segments == ()
        for item in (*found.regime, *found.temperature):
            told += 1
            flagged += item.significant
    # A regime or a temperature is flagged at 2.6 standard deviations.
    assert flagged <= 0.15 * told, f"{flagged} of {told}"


def test_a_soak_at_the_edge_of_a_bin_is_in_one():
    """A thermometer of whole steps stands at 60 degC sharp."""
    temperature, flat = np.repeat([-20.0, 0.0, 60.0, 60.0], 10), np.ones(40)
    held = SimpleNamespace(temperature=temperature, gap=flat, floor=0.1 * flat, rising=0.0 * flat)
    bins = _temperatures([held], STANDARD.reported)
    assert [(one.from_degc, one.to_degc) for one in bins] == [(-20.0, -10.0), (0.0, 10.0), (60.0, 70.0)]
