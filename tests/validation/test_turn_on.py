"""Turn-on time, against the closed form of an exponential transient."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.validation.judge import judge
from fogml.validation.metrics import RunMetrics, turn_on_time
from fogml.validation.report_json import judgement_json
from tests.validation.known_drift import KnownDrift

pytestmark = pytest.mark.usefixtures("without_noise_terms")

AVERAGING_S = 20.0


def warming(tau_s: float = 600.0, start: float = 0.5, powered_on: float | None = 0.0) -> Run:
    time = np.arange(7200.0)
    drift = 3.0 + start * np.exp(-(time - (powered_on or 0.0)) / tau_s)
    return Run.from_columns("cold.csv", Facts(powered_on=powered_on), time=time, gyro=drift, T=time)


def told(run: Run, band: float | None) -> float | None:
    metrics = RunMetrics(run, np.ones(len(run), dtype=bool), AVERAGING_S, turn_on_band=band)
    return metrics.figures(run.gyro).turn_on_time


@pytest.mark.parametrize("powered_on", [0.0, -300.0, 40.0])
@pytest.mark.parametrize("band", [0.05, 0.01])
def test_an_exponential_enters_the_band_when_it_should(powered_on, band):
    run = warming(powered_on=powered_on)
    # The last quarter's own mean is a little above the limit, by less than 1e-4 deg/h.
    assert told(run, band) == pytest.approx(600.0 * np.log(0.5 / band), abs=6.0)


def test_falling_and_rising_transients_are_alike():
    assert told(warming(start=-0.5), 0.05) == pytest.approx(told(warming(start=0.5), 0.05), rel=1e-9)


def test_a_late_excursion_counts():
    run = warming()
    bump = np.where((run.time > 3000.0) & (run.time < 3100.0), 0.2, 0.0)
    assert told(run.with_columns(gyro=run.gyro + bump), 0.05) == pytest.approx(3100.0, abs=AVERAGING_S)


def test_a_run_that_does_not_settle_misses_any_limit():
    run = warming(tau_s=1e5, start=20.0)
    assert told(run, 0.01) == np.inf
    model = KnownDrift().fit(run)
    limits = {"turn_on_time": 1e6}
    judgement = judge(model, run, [run, warming()], averaging_s=20.0, limits=limits, turn_on_band=0.01)
    assert not judgement.met
    assert judgement_json(judgement)["test"][0]["after"]["turn_on_time"] is None


def test_what_a_run_does_not_tell_is_not_told():
    assert told(warming(), None) is None
    assert told(warming(powered_on=None), 0.05) is None
    # Settled long before the recording began: the time is not in it.
    late = warming(start=0.0, powered_on=-86400.0)
    assert told(late, 0.05) is None
    assert told(warming(start=0.0), 0.05) == pytest.approx(0.5 * AVERAGING_S, abs=1.0)
    assert turn_on_time(np.arange(5.0), np.zeros(5), 0.0, 1.0, 1.0) is None


@pytest.mark.parametrize("band", [0.0, -1.0, np.nan, np.inf])
def test_a_band_must_be_positive(band):
    with pytest.raises(InputError, match="turn-on band"):
        told(warming(), band)


def test_a_band_that_no_run_answers_is_told():
    unknown = warming(powered_on=None)
    with pytest.raises(InputError, match="no run states when the gyro was switched on"):
        judge(KnownDrift().fit(unknown), unknown, unknown, turn_on_band=0.05)


def test_an_average_at_power_on_counts():
    """Of 8 averages, the first right at power-on, the second is settled: half of the way is in the band."""
    time, values = 10.0 * np.arange(8), np.array([1.0, *np.zeros(7)])
    assert turn_on_time(time, values, 0.0, 0.5, 10.0) == pytest.approx(5.0)
    assert turn_on_time(time, values, 1.0, 0.5, 10.0) is None


def test_a_bias_that_is_settled_where_its_last_quarter_begins_has_a_time():
    time, values = 10.0 * np.arange(16), np.repeat([2.0, 0.0], [12, 4])
    # From 2 down to the band of 0.5 between two averages: three quarters of the way.
    assert turn_on_time(time, values, 0.0, 0.5, 10.0) == pytest.approx(117.5)
    values[12] = 2.0
    assert turn_on_time(time, values, 0.0, 0.5, 10.0) == np.inf
