"""Forms of effects: strength as measured, hysteresis as it should be, inventions that are no relatives."""

from __future__ import annotations

import zlib
from dataclasses import asdict
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import toeplitz

from fogml.blind.first.effects.coil import SlipEvents
from fogml.blind.first.noise import record_length
from fogml.blind.first.reality import INVENTED, KNOWN, REALITY, WRONG_STRUCTURE, draw_unit
from fogml.blind.frame import nominal
from fogml.blind.frame.form import Form, compatible
from fogml.blind.frame.operators import bouc_wen, lag, play, recurrence
from fogml.blind.frame.strength import Acting, Reckoning, Scales, TooWeak, acting_before, recorded
from fogml.blind.frame.unit import Unit
from fogml.blind.make import recorded_run
from fogml.blind.plan import Plan
from fogml.twin.effect import NoiseEffect
from fogml.twin.nominal import NominalConstants
from fogml.twin.registry import effects
from fogml.twin.replay import replay
from fogml.twin.twin import Twin

PLAN = Plan(1, "one", None, 0, (), 1, False)


def acting(
    form: type[Form], wanted: float = 15.0, runs: int = 2, sample_s: float = 10.0
) -> tuple[Unit, Scales, Acting]:
    """The first unit that shows a form at the wanted strength."""
    for attempt in range(60):
        rng = np.random.default_rng([zlib.crc32(form.__name__.encode()), attempt])
        unit = draw_unit(rng, [form], runs, False, sample_s)
        scales = Scales(unit)
        made = form()
        try:
            shape = {name: float(value) for name, value in made.draw(rng).items()}
            return unit, scales, scales.with_strength(made, shape, 1.0, wanted)
        except TooWeak:
            continue
    raise AssertionError(f"no unit shows {form.__name__}")


def test_known_names_are_candidates_of_the_catalogue_and_inventions_are_not() -> None:
    catalogue = effects()
    for form in KNOWN:
        assert catalogue[form.name].candidate
        assert catalogue[form.name].stage == form.stage
        assert form.unit in ("", catalogue[form.name].amplitude.unit)
    assert not {form.name for form in (*INVENTED, WRONG_STRUCTURE)} & set(catalogue)
    assert len(REALITY.known_names) >= 30


@pytest.mark.parametrize("name", ["thermal_hysteresis", "sensor_lag", "deadband", "bias_polynomial"])
def test_d_prime_is_that_of_dense_covariances(name: str) -> None:
    form = next(form for form in KNOWN if form.name == name)
    unit, _, effect = acting(form, 8.0, sample_s=30.0)
    gram, right, whole = 0.0, 0.0, 0.0
    for run in unit.fit:
        count = len(run.world.time)
        length = record_length(count)
        k = np.arange(1, length // 2 + 1)
        spectrum = np.concatenate([[0.0], np.where(k == length // 2, 0.5, 1.0) / k])
        c = unit.noise
        flicker = c.B**2 / np.pi * 0.5 * length * np.fft.irfft(spectrum, length)[:count]
        i, hours = np.arange(1, count + 1), 30.0 / 3600.0
        dense = toeplitz(flicker) + c.N**2 / hours * np.eye(count) + c.K**2 * hours * np.minimum.outer(i, i)
        keep = slice(unit.skipped, None)
        # Constants in units in which their columns are of one size.
        sizes = {"e0": 1e6, "k1": 1e4, "k2": 1e3, "b1": 0.1, "b2": 1e-3}
        scale = [sizes.get(name, 1.0) for name in unit.constant_names]
        columns = unit.columns(run, recorded(unit, run, (effect,))) * scale
        s = effect.contribution(unit, run)[keep]
        solved = np.linalg.solve(dense[keep, keep], np.concatenate([columns, s[:, None]], axis=1))
        gram = gram + columns.T @ solved[:, :-1]
        right = right + columns.T @ solved[:, -1]
        whole = whole + s @ solved[:, -1]
    d_prime = np.sqrt(whole - right @ np.linalg.lstsq(gram, right, rcond=1e-12)[0])
    assert effect.d_prime == pytest.approx(8.0, rel=0.01)
    assert d_prime == pytest.approx(effect.d_prime, rel=0.02)


def test_contributions_of_effects_on_the_sensors_add_up_to_what_a_replay_lacks() -> None:
    """Steps of a sensor lie elsewhere where another effect moved what it feels."""
    forms = {
        name: next(form for form in KNOWN if form.name == name)
        for name in ("sensor_quantisation", "sensor_lag")
    }
    unit, scales, steps = acting(forms["sensor_quantisation"], 20.0)
    made = forms["sensor_lag"]()
    lag_of = scales.with_strength(made, {"second_share": 0.3}, 1.0, 20.0)
    # In the case's order the reading comes first; in the sensor it comes last.
    both = (steps, lag_of)
    assert acting_before(both, steps) == (lag_of,) and acting_before(both, lag_of) == ()
    run = unit.fit[0]
    found = Reckoning(scales, both).contributions
    replayed = [nominal.output(unit.constants, unit.seen(run, recorded(unit, run, e))) for e in ((), both)]
    added = found[run.name, 0] + found[run.name, 1]
    assert added == pytest.approx(replayed[0] - replayed[1], abs=1e-9)
    alone = steps.contribution(unit, run) + lag_of.contribution(unit, run)
    assert np.std(alone - added) > 0.3 * np.std(added)


def test_what_is_recorded_is_nominal_and_contributions_and_noise() -> None:
    """The twin's replay with the true constants leaves the contribution and the noise."""
    form = next(form for form in KNOWN if form.name == "thermal_hysteresis")
    unit, scales, effect = acting(form)
    twin = Twin(nominal=NominalConstants(**asdict(unit.constants)))
    left, clean = [], []
    for run in unit.fit:
        record = recorded_run(unit, run, (effect,), PLAN)
        earth = 0.0 if record.earth_known else unit.set_up.earth_deg_h
        gap = record.gyro - replay(twin, record) - earth
        left.append((gap - effect.contribution(unit, run) - run.noise)[unit.skipped :])
        clean.append(run.noise[unit.skipped :])
    # Sensors' noise, rounding and lag are all that is left, well within the gyro's noise.
    projected = scales.projected()
    assert projected.length(left) < 0.12 * np.sqrt(sum(map(len, left)))
    assert projected.length(clean) == pytest.approx(np.sqrt(sum(map(len, clean))), rel=0.05)


def worst_cosine(form: type[Form], rng: np.random.Generator) -> tuple[float, str]:
    """The greatest cosine of the catalogue's signatures with a form's contribution, over drawn shapes."""
    unit, scales, effect = acting(form)
    projected = scales.projected((effect,))
    keep = slice(unit.skipped, None)
    runs = [recorded_run(unit, run, (effect,), PLAN) for run in unit.fit]
    twin = Twin(nominal=NominalConstants(**asdict(unit.constants)))
    base = [replay(twin, run) for run in runs]

    def left(series: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
        theta = projected.constants(series)
        return [s - x @ theta for s, x in zip(series, projected.columns)]

    own = left([effect.contribution(unit, run)[keep] for run in unit.fit])
    solved = [w.solve(s[:, None])[:, 0] for s, w in zip(own, scales.whitenings)]
    length = np.sqrt(sum(a @ b for a, b in zip(own, solved)))
    worst = (0.0, "")
    for id, declared in effects().items():
        if not declared.candidate or isinstance(declared, NoiseEffect):
            continue
        for _ in range(3 if declared.shape else 1):
            shape = {q.name: rng.uniform(*q.tactical) for q in declared.shape}
            other = twin.with_effect(id, declared.amplitude.typical("tactical"), **shape)
            series = [(replay(other, run) - b)[keep] for run, b in zip(runs, base)]
            theirs = left(series)
            square = sum(float(a @ w.solve(a[:, None])[:, 0]) for a, w in zip(theirs, scales.whitenings))
            if square > 1e-12 * sum(float(s @ s) for s in series):
                along = sum(a @ b for a, b in zip(theirs, solved)) / np.sqrt(square) / length
                worst = max(worst, (abs(float(along)), id))
    return worst


@pytest.mark.parametrize("form", INVENTED, ids=lambda form: form.name)
def test_no_invention_is_a_relative_of_an_effect(form: type[Form]) -> None:
    cosine, id = worst_cosine(form, np.random.default_rng(0))
    assert cosine < 0.95, id


def test_effects_that_need_different_programmes_are_not_put_together() -> None:
    by_name = {form.name: form for form in KNOWN}
    assert not compatible([by_name["logger_skew"], by_name["sf_asymmetry"]])
    assert not compatible([by_name["deadband"], by_name["magnetic"]])
    assert not compatible([by_name["thermal_hysteresis"], by_name["thermal_hysteresis"]])
    assert compatible([by_name["thermal_hysteresis"], by_name["sf_asymmetry"]])


def test_bouc_wen_solves_its_equation_and_saturates() -> None:
    t = np.linspace(0.0, 30.0, 3000)
    x = 20.0 * np.sin(t) * np.exp(-0.03 * t)
    w = 6.0

    def slope(time: float, z: NDArray[np.float64]) -> NDArray[np.float64]:
        rate = 20.0 * np.exp(-0.03 * time) * (np.cos(time) - 0.03 * np.sin(time))
        return rate / w * (1.0 - z**2 * (z * rate > 0.0))

    solved = solve_ivp(slope, (0.0, 30.0), [0.0], t_eval=t, rtol=1e-8, atol=1e-9, max_step=0.01)
    assert bouc_wen(x, w) == pytest.approx(solved.y[0], abs=5e-3)
    assert bouc_wen(np.linspace(0.0, 100.0, 50), w)[-1] == pytest.approx(1.0)


def test_recurrences_are_those_of_a_loop() -> None:
    rng = np.random.default_rng(0)
    decay, drive = 40.0 * rng.random(500) ** 4, rng.standard_normal(500)
    x, w = np.cumsum(rng.standard_normal(500)), np.array([0.5, 3.0])
    values, value, clips, clip = [], 0.7, [], np.full(2, x[0])
    for k in range(500):
        value = np.exp(-decay[k]) * value + drive[k]
        clip = np.clip(clip, x[k] - w, x[k] + w)
        values.append(value)
        clips.append(clip)
    assert recurrence(decay, drive, 0.7) == pytest.approx(np.array(values), rel=1e-9)
    assert play(x, w) == pytest.approx(np.array(clips).T, abs=1e-12)
    ramp = np.linspace(0.0, 499.0, 500)
    settled = lag(1.0, ramp, 20.0)
    assert settled == pytest.approx(ramp - 20.0 * (1.0 - np.exp(-ramp / 20.0)), abs=1e-9)


@pytest.mark.parametrize("excess_degc_min", [0.01, 1.0])
def test_slips_add_up_to_what_is_travelled_and_each_is_one_that_could_be_seen(excess_degc_min: float) -> None:
    """However little the rate exceeds the threshold, slips are rarer then, not smaller."""
    count, sample_s, threshold = 200_000, 10.0, 4.0
    world = SimpleNamespace(sample_s=sample_s, rates={"T_in": np.full(count, threshold + excess_degc_min)})
    shape = {"threshold": threshold, "time_constant": 1e12}
    sums = SlipEvents().response(world, shape, np.random.default_rng(5))  # type: ignore[arg-type]
    slips = np.diff(sums, prepend=0.0)
    travelled = count * sample_s / 60.0 * excess_degc_min
    assert sums[-1] == pytest.approx(travelled, rel=0.05)
    assert slips[slips > 1e-12].min() > 1e-3
    seldom = 4.0 * sample_s / 60.0 * excess_degc_min
    assert np.mean(slips > 1e-12) == pytest.approx(1.0 - np.exp(-seldom), rel=0.05)
