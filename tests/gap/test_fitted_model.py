"""The model that a diagnosis writes replays as the diagnosis says that it does."""

import numpy as np
import pytest

from fogml.gap import diagnose
from fogml.gap.model import TwinModel
from fogml.gap.reading import rows_of
from fogml.signals.averages import block_averages
from fogml.twin.draws import moved, parameter_values
from fogml.twin.programme import load_programme
from fogml.twin.replay import replay
from fogml.twin.simulate import simulate
from fogml.twin.twin_file import load_twin

PROGRAMME = load_programme(
    [
        "soak at 20 degC for 1 h",
        *(
            step
            for degc in (60, -20, 20)
            for step in (
                f"ramp to {degc} degC at 1 degC/min",
                {
                    f"soak at {degc} degC for 1 h": [
                        "turn at 30 deg/s for 60 s, then -50 deg/s for 60 s, then 100 deg/s for 60 s, "
                        "then -100 deg/s for 60 s, from minute 30"
                    ]
                },
            )
        ),
    ]
)


@pytest.mark.parametrize(
    ("id", "amplitude"),
    [("input_axis_misalignment", 10.0), ("sf_hysteresis", 300.0), ("bias_polynomial", 0.5)],
)
def test_the_twin_that_is_written_replays_as_well_as_is_said(tmp_path, id, amplitude):
    """A misalignment loses scale factor with its square, which a signature in proportion does not hold."""
    twin = load_twin("nominal")
    made = [simulate(PROGRAMME, twin.with_effect(id, amplitude), sample_s=20.0, seed=s).run for s in range(3)]
    found = diagnose(twin, made[:2], made[2:], plan=False)
    assert found.named[0].effect == id
    found.write_model(TwinModel(twin), tmp_path / "twin.yaml")
    written = load_twin(tmp_path / "twin.yaml")
    told = found.how_far[0]
    left = block_averages(
        made[2].time, made[2].gyro_deg_h - replay(written, made[2]), window_s=told.averaging_s
    )
    rms = float(np.sqrt(np.mean(left.values[0] ** 2)))
    assert rms == pytest.approx(told.after, rel=0.15)
    truth = parameter_values(twin.with_effect(id, amplitude))
    for constant in found.constants:
        assert abs(constant.value - truth[f"nominal.{constant.name}"]) < 4.0 * constant.se
    # Draws about the twin replay what the runs leave open, and the error of its form.
    rng, moves = np.random.default_rng(1), []
    for _ in range(9):
        drawn = written
        for name, by in written.uncertainty.drawn(rng).items():
            drawn = moved(drawn, name, by)
        apart = replay(drawn, made[2]) - replay(written, made[2])
        values = block_averages(made[2].time, apart, window_s=told.averaging_s).values[0]
        moves.append(float(np.sqrt(np.mean(values**2))))
    assert np.median(moves) < told.after + 0.05 * told.before


@pytest.mark.parametrize(("modelled", "skew", "runs"), [(0.0, 28.0, 2), (5.0, 20.0, 1), (0.0, -50.0, 1)])
def test_a_clock_that_is_far_out_is_told_as_far_out(tmp_path, modelled, skew, runs):
    """Edges that are late by more are no multiple of edges late by less, and look like lost scale factor."""
    twin = load_twin("nominal")
    made = [
        simulate(PROGRAMME, twin.with_effect("logger_skew", skew), sample_s=20.0, seed=s).run
        for s in range(runs + 1)
    ]
    had = twin.with_effect("logger_skew", modelled) if modelled else twin
    found = diagnose(had, made[:runs], made[runs:], plan=False)
    assert found.verdict == "explained"
    named = found.named[0]
    assert named.effect == "logger_skew"
    assert named.amplitude.value == pytest.approx(skew - modelled, abs=0.5)
    assert found.effects[0].amplitude == pytest.approx(skew, abs=0.05)
    found.write_model(TwinModel(twin), tmp_path / "twin.yaml")
    left = made[runs].gyro_deg_h - replay(load_twin(tmp_path / "twin.yaml"), made[runs])
    told = found.how_far[0]
    assert told.after < 2e-3 * told.before
    assert np.sqrt(np.mean(left**2)) < 2e-3 * np.sqrt(
        np.mean((made[runs].gyro_deg_h - replay(twin, made[runs])) ** 2)
    )


def test_what_a_large_cause_hides_is_asked_for_and_found_against_the_twin_that_is_written(tmp_path):
    """Beside a skew a hysteresis a thousand times smaller is noise, and shows on the held-out run."""
    twin = load_twin("nominal")
    acting = twin.with_effect("logger_skew", 2.0).with_effect("thermal_hysteresis", 2.0)
    made = [simulate(PROGRAMME, acting, sample_s=20.0, seed=s).run for s in range(3)]
    found = diagnose(twin, made[:2], made[2:], plan=False)
    assert [f.effect for f in found.named] == ["logger_skew"]
    assert "more may be named" in found.how_far[0].note
    found.write_model(TwinModel(twin), tmp_path / "twin.yaml")
    again = diagnose(load_twin(tmp_path / "twin.yaml"), made[:2], made[2:], plan=False)
    hysteresis = next(f for f in again.named if f.effect == "thermal_hysteresis")
    assert hysteresis.amplitude.value == pytest.approx(2.0, abs=0.1)
    assert "more may be named" not in again.how_far[0].note


def test_a_gap_to_a_twin_is_that_of_the_rows():
    twin = load_twin("tactical")
    run = simulate(PROGRAMME, twin, sample_s=20.0, seed=1).run
    rows = rows_of(run, twin, 400)
    np.testing.assert_allclose(rows.gap_of(twin), rows.gap, atol=1e-9)
