"""Shapes that spectra are fitted by: output filters, and terms as samples show them; and their fit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from fogml.arrays import FloatArray
from fogml.signals.noise_spectrum import spectrum_of
from fogml.signals.output_filters import LOW_PASSES, OutputFilter, SpectrumTerms, term_shapes
from fogml.signals.spectrum_fit import SpectrumModel


@pytest.mark.parametrize("low_pass", LOW_PASSES, ids=str)
def test_half_the_power_passes_at_the_corner(low_pass: OutputFilter) -> None:
    corner = low_pass.corner_cycles(np.log(0.3))
    assert corner is not None
    gain, slope = low_pass.response(np.array([corner]), np.log(0.3))
    assert gain[0] == pytest.approx(0.5)
    more, less = (low_pass.response(np.array([corner]), np.log(0.3) + d)[0][0] for d in (1e-5, -1e-5))
    assert slope[0] == pytest.approx((more - less) / 2e-5, rel=1e-6)


@pytest.mark.parametrize(
    ("order", "corner"), [(2, 0.25), (3, np.arccos((3 / np.sqrt(2) - 1) / 2) / (2 * np.pi))]
)
def test_half_the_power_passes_a_running_mean_at_its_corner(order: int, corner: float) -> None:
    """Of two samples the amplitude is cos(pi x), of three (1 + 2 cos(2 pi x)) / 3."""
    assert OutputFilter("mean", order).corner_cycles(0.0) == pytest.approx(corner)
    # Of many it is that of a continuous mean.
    assert OutputFilter("mean", 100).corner_cycles(0.0) == pytest.approx(0.44295 / 100, rel=1e-4)


@pytest.mark.parametrize("low_pass", LOW_PASSES, ids=str)
def test_a_low_pass_is_named_by_the_slope_of_its_skirt(low_pass: OutputFilter) -> None:
    corner = np.log(1e-6)
    skirt = [low_pass.response(np.array([x]), corner)[0][0] for x in (1e-3, 2e-3)]
    order = round(np.log2(skirt[0] / skirt[1]) / 2)  # power falls by 2 orders of frequency a stage
    assert low_pass.words() == f"low pass of {['no', 'first', 'second'][order]} order"


@pytest.mark.parametrize("sample_s", [0.01, 1.0])
@pytest.mark.parametrize("samples", [0.5, 3.0, 50.0, 1e5])
def test_what_is_correlated_is_the_sum_of_what_folds_back(sample_s: float, samples: float) -> None:
    tau = samples * sample_s
    cycles = np.array([1e-6, 1e-3, 0.03, 0.2, 0.5])
    folds = cycles + np.arange(-2000, 2001)[:, None]
    density = 4.0 * tau / (1.0 + (2.0 * np.pi * folds * samples) ** 2)
    found = term_shapes(cycles / sample_s, sample_s, SpectrumTerms(("G",), correlation_s=tau))[:, 0]
    assert found == pytest.approx((density * np.sinc(folds) ** 2).sum(axis=0), rel=1e-6)


def test_what_the_ends_of_a_smooth_series_add_is_flat_once_differenced_twice() -> None:
    frequency = np.geomspace(1e-3, 0.25, 20)
    shape = term_shapes(frequency, 2.0, SpectrumTerms(("E",)))[:, 0]
    assert shape * np.abs(1.0 - np.exp(-2j * np.pi * frequency * 2.0)) ** 4 == pytest.approx(
        np.full(20, 16.0)
    )


@pytest.mark.parametrize("lengths", [(40,), (40, 30)])
def test_quantisation_is_what_differences_of_white_angles_make_of_a_cosine_transform(
    lengths: tuple[int, ...],
) -> None:
    """The mean of squares over all angles of variance 1, one after the other."""
    sample_s, expected = 0.5, 0.0
    for place, n in enumerate(lengths):
        for rates in np.diff(np.eye(n + 1), axis=0).T / sample_s:
            stretches = [rates if other == place else np.zeros(m) for other, m in enumerate(lengths)]
            spectrum = spectrum_of(stretches, sample_s)
            expected += spectrum.power
    terms, stretch_s = SpectrumTerms(("Q",)), spectrum.stretch_s[:, None]
    shape = term_shapes(spectrum.frequency_hz, sample_s, terms, stretch_s).mean(axis=1)[:, 0]
    assert shape == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_angle_random_walk_below_quantisation_is_not_what_angles_at_the_ends_make(seed: int) -> None:
    """Quantisation of 5 urad over N of 0.002 deg/sqrt(h), equal at 221 s; 128 tests of 2000 s."""
    rng, sample_s, rows = np.random.default_rng(seed), 0.5, 4000
    angles = np.degrees(5e-6) * 3600.0 * rng.standard_normal((128, rows + 1))
    rates = np.diff(angles) / sample_s + 0.12 / np.sqrt(sample_s) * rng.standard_normal((128, rows))
    spectrum = spectrum_of(list(rates), sample_s)
    fit = SpectrumModel(spectrum, SpectrumTerms(("N", "Q"))).fit()
    assert np.sqrt(fit["N"]) == pytest.approx(0.12, rel=0.02)


@pytest.mark.parametrize("seed", [0, 4, 5])
def test_a_fit_beside_columns_is_where_a_simplex_ends(seed: int) -> None:
    """Where constants of columns take most of the lowest rows, what they leave is little to go by."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=2000) + np.cumsum(0.02 * rng.normal(size=2000))
    waves = np.cos(np.pi * (np.arange(2000)[:, None] + 0.5) / 2000.0 * np.arange(1, 11))
    spectrum = spectrum_of([values], 1.0, [waves])
    model = SpectrumModel(spectrum, SpectrumTerms(("N", "B", "K", "Q")))
    shapes = term_shapes(spectrum.frequency_hz, 1.0, model.terms).mean(axis=1)
    low, columns = len(spectrum.values), spectrum.columns

    def loss(coefficients: FloatArray) -> float:
        density = shapes @ coefficients
        over = columns / density[:low, None]
        constants = np.linalg.solve(columns.T @ over, over.T @ spectrum.values)
        rest = spectrum.values - columns @ constants
        restricted = np.log(density[:low]).sum() + np.linalg.slogdet(columns.T @ over)[1]
        ratio = spectrum.power[low:] / density[low:]
        above = spectrum.count[low:] @ (ratio - 1.0 - np.log(ratio))
        return 0.5 * float(restricted + np.sum(rest**2 / density[:low]) + above)

    fit = model.fit()
    begin = np.log(np.maximum(fit.coefficients, 1e-6))
    options = {"xatol": 1e-6, "fatol": 1e-9, "maxiter": 4000, "maxfev": 4000}
    ends = [
        minimize(
            lambda x: loss(np.exp(x)),
            begin + shift,
            method="Nelder-Mead",
            bounds=[(-40.0, 5.0)] * 4,
            options=options,
        )
        for shift in (0.0, [0.0, 1.0, -1.0, 0.0])
    ]
    assert loss(fit.coefficients) < min(end.fun for end in ends) + 1e-5


def test_a_column_that_lies_in_rows_that_are_not_used_has_no_say() -> None:
    """A wave of one row: without that row it tells nothing, and nothing of it is to be told."""
    rng = np.random.default_rng(1)
    values = rng.normal(size=2000) + np.cumsum(0.02 * rng.normal(size=2000))
    wave = np.cos(np.pi * (np.arange(2000) + 0.5) / 2000.0 * 6)[:, None]
    found = []
    for columns in (wave, np.zeros((2000, 1))):
        spectrum = spectrum_of([values], 1.0, [columns])
        used = np.arange(len(spectrum.power)) != 5
        assert len(spectrum.values) > 5
        found.append(SpectrumModel(spectrum, SpectrumTerms(("N", "B", "K")), used=used).fit().coefficients)
    assert found[0] == pytest.approx(found[1], rel=1e-6)


@pytest.mark.parametrize("still", [0.0, 1.0, 1.0 + 1e-15 * np.arange(2000)[:, None] % 3e-15])
def test_columns_that_move_by_rounding_alone_say_nothing(still: float | FloatArray) -> None:
    """A square of readings that are -1 and 1 alone is such a column, beside two that are alike."""
    rng = np.random.default_rng(2)
    values, step = rng.normal(size=2000), np.repeat([-1.0, 1.0], 1000)[:, None]
    alone = spectrum_of([values], 1.0, [step])
    beside = spectrum_of([values], 1.0, [np.hstack([step, step + 0.0 * still, 0.0 * step + still])])
    np.testing.assert_allclose(beside.power, alone.power, rtol=1e-9)
    assert beside.basis[0].shape == alone.basis[0].shape


def test_columns_that_fit_all_values_are_left_out() -> None:
    """Eight samples beside ten columns: noise is told as without them, not as rounding."""
    rng = np.random.default_rng(3)
    values, columns = rng.normal(size=8), rng.normal(size=(8, 10))
    found, plain = (spectrum_of([values], 1.0, [x]) for x in (columns, np.empty((8, 0))))
    np.testing.assert_allclose(found.power, plain.power, rtol=1e-12)
    assert found.basis[0].shape[1] == 0
