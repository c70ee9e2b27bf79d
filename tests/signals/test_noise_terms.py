from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.signals.allan import AllanResult, allan_deviation
from fogml.signals.noise_terms import TERM_NAMES, NoiseTerms, noise_terms

SAMPLE_S = 0.1
HOUR = 3600.0
TAUS = np.unique(np.outer([1, 1.5, 2, 3, 4, 5, 6, 8], 10.0 ** np.arange(-1, 4)))


def gyro(rng: np.random.Generator, n: int, **terms: float) -> np.ndarray:
    """Rate [deg/h] at 0.1 s with the terms asked for, each from its definition in the time domain."""
    hours = SAMPLE_S / HOUR
    rate = terms.get("N", 0.0) / np.sqrt(hours) * rng.normal(size=n)
    if "B" in terms:
        # One-sided density B^2/(pi f): each spectral line of width 1/(2nT) with its random phase.
        frequency = np.fft.rfftfreq(2 * n, SAMPLE_S)
        frequency[0] = np.inf
        lines = rng.normal(size=len(frequency)) + 1j * rng.normal(size=len(frequency))
        amplitude = np.sqrt(terms["B"] ** 2 / (np.pi * frequency) / (2 * n * SAMPLE_S)) / np.sqrt(2)
        rate += np.fft.irfft(lines * amplitude, 2 * n)[:n] * n * np.sqrt(2)
    rate += terms.get("K", 0.0) * np.sqrt(hours) * np.cumsum(rng.normal(size=n))
    rate += terms.get("R", 0.0) * hours * np.arange(n)
    if "Q" in terms:
        # Angles read on a counter of step sqrt(12) Q, at a rate fast enough that every reading
        # falls anywhere within the step.
        step = np.sqrt(12) * np.rad2deg(terms["Q"] * 1e-6)
        rate += np.diff(rng.uniform(-0.5 * step, 0.5 * step, size=n + 1)) / hours
    return rate


def fits(seed: int, repeats: int, n: int, **terms: float) -> list[NoiseTerms]:
    rng = np.random.default_rng(seed)
    return [noise_terms(allan_deviation(gyro(rng, n, **terms), SAMPLE_S, TAUS)) for _ in range(repeats)]


def check_coverage(results: list[NoiseTerms], truth: dict[str, float], least: float) -> None:
    for name in TERM_NAMES:
        inside = [r.terms[name].lower <= truth.get(name, 0.0) <= r.terms[name].upper for r in results]
        assert np.mean(inside) >= least, (name, np.mean(inside))


def exact(sample_s: float = SAMPLE_S, **sigma: np.ndarray) -> AllanResult:
    """A curve without scatter."""
    taus = TAUS[TAUS <= 2000]
    adev = np.sqrt(sum(f(taus) ** 2 for f in sigma.values()))
    factors = np.round(taus / sample_s).astype(np.int64)
    edf = 1e7 / factors
    return AllanResult(taus, adev, adev, adev, factors, factors, edf, 0 * factors, 0.9, True)


def test_each_term_in_its_unit():
    urad = np.deg2rad(1 / HOUR) * 1e6  # one deg/h for a second
    got = noise_terms(
        exact(
            q=lambda t: np.sqrt(3) * (0.5 / urad) / t,
            n=lambda t: 0.01 / np.sqrt(t / HOUR),
            b=lambda t: 0.6643 * 0.05 + 0 * t,
            k=lambda t: 0.3 * np.sqrt(t / HOUR / 3),
            r=lambda t: 0.8 * (t / HOUR) / np.sqrt(2),
        )
    )
    fitted = {name: term.fitted for name, term in got.terms.items()}
    assert fitted == pytest.approx({"Q": 0.5, "N": 0.01, "B": 0.05, "K": 0.3, "R": 0.8}, rel=2e-3)
    assert [term.unit for term in got.terms.values()] == [
        "urad",
        "deg/sqrt(h)",
        "deg/h",
        "deg/h/sqrt(h)",
        "deg/h/h",
    ]
    assert got.misfit == pytest.approx(0.0, abs=1e-3)
    # N in deg/sqrt(h) is a sixtieth of the deviation at one second.
    white = noise_terms(exact(n=lambda t: 3.0 / np.sqrt(t)))
    assert white.terms["N"].value == pytest.approx(3.0 / 60, rel=1e-6)


def test_bias_instability_is_the_minimum_over_its_factor():
    curve = exact(n=lambda t: 0.01 / np.sqrt(t / HOUR), k=lambda t: 2.0 * np.sqrt(t / HOUR / 3))
    got = noise_terms(curve)
    assert got.minimum_adev == curve.adev.min()
    assert got.minimum_tau_s == curve.taus_s[np.argmin(curve.adev)]
    flicker = noise_terms(
        exact(n=lambda t: 0.002 / np.sqrt(t / HOUR), b=lambda t: 0.05 + 0 * t, k=lambda t: t / 1e5)
    )
    assert flicker.terms["B"].value == pytest.approx(flicker.minimum_adev / 0.6643, rel=1e-3)
    assert flicker.terms["B"].lower <= flicker.terms["B"].fitted < flicker.terms["B"].value


def test_terms_are_recovered_within_their_intervals():
    truth = {"Q": 2.0, "N": 0.01, "B": 0.1, "K": 3.0}
    results = fits(1, 60, 40_000, **truth)
    # 0.90 less three binomial standard errors, and a little for the chi-square approximations.
    check_coverage(results, truth, 0.77)
    for name in ("Q", "N"):
        assert np.median([r.terms[name].fitted for r in results]) == pytest.approx(truth[name], rel=0.02)
        assert all(r.terms[name].lower > 0 for r in results)
    assert np.median([r.terms["K"].fitted for r in results]) == pytest.approx(3.0, rel=0.15)
    widths = [(r.terms["N"].upper - r.terms["N"].lower) / truth["N"] for r in results]
    assert np.median(widths) < 0.15


def test_flicker_and_ramp_are_recovered():
    truth = {"N": 0.002, "B": 0.05, "R": 1.5}
    results = fits(2, 40, 40_000, **truth)
    check_coverage(results, truth, 0.75)
    assert np.median([r.terms["B"].fitted for r in results]) == pytest.approx(0.05, rel=0.1)
    assert np.median([r.terms["R"].fitted for r in results]) == pytest.approx(1.5, rel=0.1)


def test_what_the_data_do_not_hold_is_bounded_not_invented():
    results = fits(3, 40, 20_000, N=0.01)
    check_coverage(results, {"N": 0.01}, 0.75)
    for name in ("B", "K", "R"):
        assert np.mean([r.terms[name].lower == 0 for r in results]) >= 0.9
    assert sum(r.terms["B"].value is None for r in results) > 20
    assert sum(r.terms["K"].value is None for r in results) > 20
    assert all(r.terms["K"].upper > 0 for r in results)


def test_noise_of_another_kind_shows_as_misfit_and_widens_the_intervals():
    rng = np.random.default_rng(4)
    rate = gyro(rng, 40_000, N=0.01)
    line = rate + 15.0 * np.sin(2 * np.pi * np.arange(40_000) * SAMPLE_S / 3.0)
    clean = noise_terms(allan_deviation(rate, SAMPLE_S, TAUS))
    hum = noise_terms(allan_deviation(line, SAMPLE_S, TAUS))
    assert hum.misfit > 0.1 > 10 * clean.misfit
    clean_width = clean.terms["N"].upper - clean.terms["N"].lower
    assert hum.terms["N"].upper - hum.terms["N"].lower > 3 * clean_width


def test_the_fitted_curve_is_the_sum_of_its_terms():
    got = fits(5, 1, 20_000, N=0.01, K=3.0)[0]
    taus = np.array([0.2, 5.0, 300.0])
    terms = {name: term.fitted for name, term in got.terms.items()}
    q = np.rad2deg(terms["Q"] * 1e-6) * HOUR
    want = (
        3 * (q / taus) ** 2
        + terms["N"] ** 2 * HOUR / taus
        + 2 * np.log(2) / np.pi * terms["B"] ** 2
        + terms["K"] ** 2 * taus / HOUR / 3
        + (terms["R"] * taus / HOUR) ** 2 / 2
    )
    np.testing.assert_allclose(got.deviation(taus), np.sqrt(want), rtol=1e-9)


def test_no_noise_at_all_and_few_points():
    still = noise_terms(allan_deviation(np.full(1000, 15.0), SAMPLE_S))
    assert all(term.value is None and term.upper == 0 for term in still.terms.values())
    few = noise_terms(allan_deviation(np.array([1.0, 2.0, 0.5, 1.7]), SAMPLE_S))
    assert all(np.isfinite(term.upper) for term in few.terms.values())


def test_windows_must_overlap():
    with pytest.raises(InputError, match="overlapping"):
        noise_terms(allan_deviation(np.arange(100.0) % 7, SAMPLE_S, overlapping=False))
