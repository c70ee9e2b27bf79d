from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import idct
from scipy.signal import butter, firwin, lfilter

from fogml.errors import InputError
from fogml.signals.allan import AllanResult, allan_deviation
from fogml.signals.noise_spectrum import Spectrum, spectrum_of
from fogml.signals.noise_terms import TERM_NAMES, NoiseTerms, noise_terms, noise_terms_of
from fogml.signals.random_noise import gauss_markov

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
    return [noise_terms_of(gyro(rng, n, **terms), SAMPLE_S) for _ in range(repeats)]


def check_coverage(results: list[NoiseTerms], truth: dict[str, float], least: float) -> None:
    for name in TERM_NAMES:
        inside = [r.terms[name].lower <= truth.get(name, 0.0) <= r.terms[name].upper for r in results]
        assert np.mean(inside) >= least, (name, np.mean(inside))


def exact(**terms: float) -> tuple[Spectrum, AllanResult]:
    """A spectrum and a curve of means over 0.1 s without scatter, from the densities of IEEE Std 952.

    What folds back about half the sampling rate is summed term by term.
    """
    n = 200_000
    frequency = np.arange(1, n) / (2 * n * SAMPLE_S)
    density = np.zeros(n - 1)
    hours = 1 / HOUR
    for fold in range(-60, 61):
        f = np.abs(frequency + fold / SAMPLE_S)
        passed = np.sinc(f * SAMPLE_S) ** 2
        density += passed * (
            2 * terms.get("N", 0.0) ** 2 / hours
            + terms.get("B", 0.0) ** 2 / (np.pi * f)
            + terms.get("K", 0.0) ** 2 * hours / (2 * np.pi**2 * f**2)
        )
    q = np.rad2deg(terms.get("Q", 0.0) * 1e-6) * HOUR
    density += 8 * q**2 / SAMPLE_S * np.sin(np.pi * frequency * SAMPLE_S) ** 2
    coefficients = np.sqrt(density / (2 * SAMPLE_S)) * np.random.default_rng(0).choice([-1, 1], n - 1)
    series = idct(np.concatenate(([0.0], coefficients)), norm="ortho")
    ramp = SAMPLE_S * np.arange(n)[:, None]
    slope = terms.get("R", 0.0) / HOUR
    taus = TAUS[TAUS <= 2000]
    adev = np.sqrt(
        terms.get("N", 0.0) ** 2 * HOUR / taus
        + (0.6643 * terms.get("B", 0.0)) ** 2
        + terms.get("K", 0.0) ** 2 * taus / HOUR / 3
        + (slope * taus) ** 2 / 2
        + 3 * (q / taus) ** 2
    )
    factors = np.round(taus / SAMPLE_S).astype(np.int64)
    allan = AllanResult(taus, adev, adev, adev, factors, factors, 1e7 / factors, 0 * factors, 0.9, True)
    return spectrum_of([series + slope * ramp[:, 0]], SAMPLE_S, [ramp]), allan


def test_each_term_in_its_unit():
    truth = {"Q": 0.5, "N": 0.01, "B": 0.05, "K": 0.3}
    got = noise_terms(*exact(**truth))
    fitted = {name: term.fitted for name, term in got.terms.items()}
    # A ramp is fitted beside them, which takes a little of the slowest noise.
    assert {name: fitted[name] for name in truth} == pytest.approx(truth, rel=0.04)
    assert [term.unit for term in got.terms.values()] == [
        "urad",
        "deg/sqrt(h)",
        "deg/h",
        "deg/h/sqrt(h)",
        "deg/h/h",
    ]
    assert got.misfit == 0.0 and got.fit_p_value > 0.9
    ramp = noise_terms(*exact(N=0.001, R=0.8))
    assert ramp.terms["R"].fitted == pytest.approx(0.8, rel=0.02)
    # N in deg/sqrt(h) is a sixtieth of the deviation at one second.
    white = noise_terms(*exact(N=3.0 / 60))
    assert white.terms["N"].value == pytest.approx(3.0 / 60, rel=1e-3)
    assert float(white.deviation([1.0])[0]) == pytest.approx(3.0, rel=2e-3)


def test_bias_instability_is_the_minimum_over_its_factor():
    spectrum, curve = exact(N=0.01, K=2.0)
    got = noise_terms(spectrum, curve)
    assert got.minimum_adev == curve.adev.min()
    assert got.minimum_tau_s == curve.taus_s[np.argmin(curve.adev)]
    flicker = noise_terms(*exact(N=0.002, B=0.075, K=0.05))
    assert flicker.terms["B"].value == pytest.approx(flicker.minimum_adev / 0.6643, rel=1e-3)
    assert flicker.terms["B"].lower <= flicker.terms["B"].fitted < flicker.terms["B"].value


def test_terms_are_recovered_within_their_intervals():
    truth = {"Q": 2.0, "N": 0.01, "B": 0.1, "K": 3.0}
    results = fits(1, 12, 40_000, **truth)
    # 0.90 less two binomial standard errors; two hundred runs of each kind: experiments/real_files.
    check_coverage(results, truth, 0.66)
    for name in ("Q", "N"):
        assert np.median([r.terms[name].fitted for r in results]) == pytest.approx(truth[name], rel=0.02)
        assert all(r.terms[name].lower > 0 for r in results)
    assert np.median([r.terms["K"].fitted for r in results]) == pytest.approx(3.0, rel=0.15)
    widths = [(r.terms["N"].upper - r.terms["N"].lower) / truth["N"] for r in results]
    assert np.median(widths) < 0.15


def test_flicker_and_ramp_are_recovered():
    truth = {"N": 0.002, "B": 0.05, "R": 1.5}
    results = fits(2, 10, 40_000, **truth)
    check_coverage(results, truth, 0.65)
    assert np.median([r.terms["B"].fitted for r in results]) == pytest.approx(0.05, rel=0.1)
    assert np.median([r.terms["R"].fitted for r in results]) == pytest.approx(1.5, rel=0.1)


def test_what_the_data_do_not_hold_is_bounded_not_invented():
    results = fits(3, 12, 20_000, N=0.01)
    check_coverage(results, {"N": 0.01}, 0.65)
    for name in ("B", "K", "R"):
        assert np.mean([r.terms[name].lower == 0 for r in results]) >= 0.7
    assert sum(r.terms["B"].value is None for r in results) >= 4
    assert sum(r.terms["K"].value is None for r in results) >= 4
    assert all(r.terms["K"].upper > 0 for r in results)


def test_a_random_walk_that_hardly_shows_is_no_ramp():
    """No line is told better than by generalised least squares under the true noise."""
    count, white, step = 2000, 1.2, 0.005
    index = np.arange(1.0, count + 1.0)
    covariance = white**2 * np.eye(count) + step**2 * np.minimum.outer(index, index)
    line = np.column_stack([np.ones(count), index])
    error = HOUR * np.sqrt(np.linalg.inv(line.T @ np.linalg.solve(covariance, line))[1, 1])
    for seed in range(6):
        rng = np.random.default_rng(seed)
        rate = white * rng.normal(size=count) + step * np.cumsum(rng.normal(size=count))
        told = noise_terms_of(rate, 1.0).terms["R"]
        assert told.upper - 0.5 * (told.upper + told.lower) * (told.lower > 0.0) > 0.8 * 1.645 * error


@pytest.mark.parametrize("ramp", [0.0, 0.02])
def test_ramps_of_many_runs_are_not_their_errors(ramp: float):
    """The root mean square of estimates exceeds that of the ramps by what errors add."""
    runs, count = 20, 400
    hits = []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        turns = ramp * rng.choice([-1.0, 1.0], runs)
        parts = [rng.normal(size=count) + turn * np.arange(count) for turn in turns]
        lines = [np.outer(np.arange(count), np.arange(runs) == i) for i in range(runs)]
        segments = [(i * count, (i + 1) * count) for i in range(runs)]
        allan = allan_deviation(np.concatenate(parts), 1.0, segments=segments)
        told = noise_terms(spectrum_of(parts, 1.0, lines), allan, ramps=runs).terms["R"]
        hits.append(told.lower <= HOUR * ramp <= told.upper and (told.value is None) == (ramp == 0.0))
    assert all(hits)


def test_noise_beside_a_process_of_any_correlation_time_is_told():
    """Whose correlation is exponential: no filter is made of it, nor is its time one of a few."""
    for seed, tau in enumerate((3.0, 6.0, 20.0, 45.0)):
        rng = np.random.default_rng(seed)
        rate = rng.normal(size=40_000) + gauss_markov(rng, 40_000, 1.0, 1.0, tau)
        told = noise_terms_of(rate, 1.0)
        best, white = told.search.best, told.terms["N"]
        assert best.filter.kind == "none"
        assert (best.terms.correlation_s, best["G"]) == pytest.approx((tau, 1.0), rel=0.15)
        assert white.lower < 1.0 / 60 < white.upper < 1.05 / 60
        assert white.lower > 0.85 / 60


def test_a_sinusoid_is_told_apart_and_noise_of_another_kind_widens_the_intervals():
    rng = np.random.default_rng(4)
    rate = gyro(rng, 40_000, N=0.01)
    clean = noise_terms_of(rate, SAMPLE_S)
    line = noise_terms_of(rate + 15.0 * np.sin(2 * np.pi * np.arange(40_000) * SAMPLE_S / 3.0), SAMPLE_S)
    assert clean.misfit == 0.0
    (found,) = line.search.spectrum.lines
    assert (found.frequency_hz, found.amplitude) == pytest.approx((1 / 3, 15.0), rel=0.02)
    assert line.terms["N"].value == pytest.approx(clean.terms["N"].value, rel=0.02)
    # A resonance in the middle of the band, which is no low pass and no line.
    bump = noise_terms_of(rate + lfilter([1.0], [1.0, -1.93, 0.95], 0.5 * rng.normal(size=40_000)), SAMPLE_S)
    assert bump.fit_p_value < 1e-3 or bump.holds_from_s > 10 * SAMPLE_S
    widths = [t.terms["N"].upper - t.terms["N"].lower for t in (clean, bump)]
    assert widths[1] > 2 * widths[0]


def test_a_sinusoid_in_several_stretches_is_one():
    rng, time = np.random.default_rng(9), np.arange(20_000)
    rate = (
        rng.normal(size=20_000) + np.sin(2 * np.pi * 0.1234567 * time) + 0.5 * np.sin(2 * np.pi * 0.2 * time)
    )
    lines = spectrum_of([rate[:8000], rate[8100:14_000], rate[14_500:]], 1.0).lines
    assert [line.frequency_hz for line in lines] == pytest.approx([0.1234567, 0.2], abs=5e-5)
    assert [line.amplitude for line in lines] == pytest.approx([1.0, 0.5], rel=0.05)


def test_noise_is_hardly_ever_taken_for_a_line():
    """By chance one of a thousand runs; as if medians of a few squares were known it were ten."""
    rng = np.random.default_rng(8)
    found = [len(spectrum_of([rng.normal(size=2000)], 1.0).lines) for _ in range(1500)]
    assert sum(map(bool, found)) <= 5


def test_the_fitted_curve_is_the_sum_of_its_terms():
    got = fits(5, 1, 20_000, N=0.01, K=3.0)[0]
    taus = np.array([0.4, 5.0, 300.0])
    terms = {name: term.fitted for name, term in got.terms.items()}
    q = np.rad2deg(terms["Q"] * 1e-6) * HOUR
    want = (
        3 * (q / taus) ** 2
        + terms["N"] ** 2 * HOUR / taus
        + 2 * np.log(2) / np.pi * terms["B"] ** 2
        + terms["K"] ** 2 * taus / HOUR / 3
        + (terms["R"] * taus / HOUR) ** 2 / 2
    )
    np.testing.assert_allclose(got.deviation(taus), np.sqrt(want), rtol=0.02)


@pytest.mark.parametrize("name", ["second order", "first order", "running mean", "fourth order", "finite"])
def test_noise_ahead_of_an_output_filter(name: str):
    rng = np.random.default_rng(6)
    rate = gyro(rng, 60_000, N=0.01)
    rate = {
        "second order": lambda: lfilter(*butter(2, 0.06), rate),
        "first order": lambda: lfilter([0.1], [1.0, -0.9], rate),
        "running mean": lambda: np.convolve(rate, np.full(10, 0.1), "valid"),
        # Of no form that is known: the rows above some frequency are left out.
        "fourth order": lambda: lfilter(*butter(4, 0.1), rate),
        "finite": lambda: lfilter(firwin(31, 0.2), 1.0, rate),
    }[name]()
    got = noise_terms_of(rate, SAMPLE_S)
    assert got.terms["N"].lower <= 0.01 <= got.terms["N"].upper
    assert got.terms["N"].value == pytest.approx(0.01, rel=0.03)
    assert got.fit_p_value > 1e-3
    assert 5 * SAMPLE_S < got.holds_from_s < 1000 * SAMPLE_S
    assert got.minimum_tau_s >= got.holds_from_s
    kinds = {
        "first order": ("butterworth", 1),
        "second order": ("butterworth", 2),
        "running mean": ("mean", 10),
    }
    best = got.search.best.filter
    assert (best.kind, best.order) == kinds.get(name, ("none", 0))


def test_no_noise_at_all_and_few_points():
    still = noise_terms_of(np.full(1000, 15.0), SAMPLE_S)
    assert all(term.value is None and term.upper == 0 for term in still.terms.values())
    few = noise_terms_of(np.array([1.0, 2.0, 0.5, 1.7]), SAMPLE_S)
    assert all(np.isfinite(term.upper) for term in few.terms.values())


def test_what_a_filter_may_hide_is_bounded_by_what_is_there():
    """A series as smooth as a filter's output has no more white noise than the slowest filter allows."""
    rng = np.random.default_rng(4)
    values = np.cumsum(lfilter(*butter(2, 0.02), rng.normal(size=400)))
    terms = noise_terms_of(values, 4.0).terms
    # Behind a corner at the lowest frequency, half of a line's width 1/(2nT), the density 2 N^2 is all there.
    largest = np.sqrt(np.mean((values - values.mean()) ** 2) * len(values) * 4.0) / 60.0
    assert terms["N"].upper < 10.0 * largest
    assert all(np.isfinite(term.upper) and term.upper < 1e4 * largest for term in terms.values())


def test_windows_must_overlap():
    series = np.arange(100.0) % 7
    with pytest.raises(InputError, match="overlapping"):
        noise_terms(spectrum_of([series], SAMPLE_S), allan_deviation(series, SAMPLE_S, overlapping=False))


def test_behind_a_form_that_is_not_known_the_curve_is_the_measured_one():
    """Angle noise that ends far below half the sampling rate: its terms alone would leave far more."""
    rng = np.random.default_rng(3)
    y = lfilter(*butter(4, 0.1), np.diff(5.0 * rng.normal(size=20_001))) + 0.05 * rng.normal(size=20_000)
    terms = noise_terms_of(y, 1.0)
    seen = allan_deviation(y, 1.0, [1.0, 4.0, 16.0, 64.0])
    assert terms.deviation(seen.taus_s) == pytest.approx(seen.adev, rel=0.07)
    assert np.all(terms.deviation(seen.taus_s, filtered=False) > 2.0 * seen.adev)
    assert terms.holds_from_s > 64.0
