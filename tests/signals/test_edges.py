"""Short, constant and broken series: each function answers, or says what it needs, and warns of nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.signals.allan import allan_deviation
from fogml.signals.floor import floor_model
from fogml.signals.noise_fit import fit_noise
from fogml.signals.noise_search import search_noise
from fogml.signals.noise_spectrum import spectrum_of
from fogml.signals.noise_terms import noise_terms_of
from fogml.signals.restricted import next_value, random_effects
from fogml.signals.whiteness import stationarity, whiteness

Of = Callable[[FloatArray], Any]
ONE = np.zeros(1, dtype=np.int64)


def _times(x: FloatArray) -> FloatArray:
    return np.arange(len(x), dtype=np.float64)


OF: dict[str, Of] = {
    "allan_deviation": lambda x: allan_deviation(x, 1.0),
    "spectrum_of": lambda x: spectrum_of([x], 1.0),
    "spectrum_of with a column": lambda x: spectrum_of([x], 1.0, [_times(x)[:, None]]),
    "search_noise": lambda x: search_noise(spectrum_of([x], 1.0)),
    "noise_terms_of": lambda x: noise_terms_of(x, 1.0),
    "fit_noise": lambda x: fit_noise([_times(x)], [x]),
    "floor_model": lambda x: floor_model(x, 1.0, 10.0, ONE, ONE + len(x)),
    "whiteness": whiteness,
    "stationarity": lambda x: stationarity([x], 1.0),
    "random_effects": lambda x: random_effects(x, np.ones(len(x))),
    "random_effects, exact": lambda x: random_effects(x, np.zeros(len(x))),
    "next_value": lambda x: next_value(x, np.ones(len(x))),
}


@pytest.mark.parametrize("of", OF.values(), ids=OF)
@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5, 20, 200])
def test_series_of_any_length_are_answered_or_refused(of: Of, count: int) -> None:
    broken = np.random.default_rng(count).normal(size=(3, count))
    if count:
        broken[1, count // 2], broken[2, count // 2] = math.nan, math.inf
    for values in (*broken, np.zeros(count), np.full(count, 3.0), np.full(count, math.nan)):
        try:
            of(values)
        except InputError as error:
            assert str(error).strip(), error


@pytest.mark.parametrize("interval", [0.0, -1.0, math.nan, math.inf])
def test_an_interval_is_a_positive_number(interval: float) -> None:
    x = np.random.default_rng(1).normal(size=200)
    for of in (
        lambda: allan_deviation(x, interval),
        lambda: spectrum_of([x], interval),
        lambda: noise_terms_of(x, interval),
        lambda: floor_model(x, interval, 10.0, ONE, ONE + 200),
        lambda: floor_model(x, 1.0, interval, ONE, ONE + 200),
        lambda: whiteness(x, sample_s=interval),
        lambda: stationarity([x], interval),
        lambda: fit_noise([_times(x)], [x], averaging_s=interval),
    ):
        with pytest.raises(InputError, match="positive"):
            of()


@pytest.mark.parametrize("level", [0.0, 1.0, -1.0, 2.0, math.nan])
def test_a_level_is_a_share(level: float) -> None:
    x = np.random.default_rng(1).normal(size=200)
    for of in (
        lambda: allan_deviation(x, 1.0, level=level),
        lambda: noise_terms_of(x, 1.0, level),
        lambda: whiteness(x, level=level),
        lambda: next_value(x, np.ones(200), level),
    ):
        with pytest.raises(InputError, match="between 0 and 1"):
            of()


def test_what_a_spectrum_lacks_is_told() -> None:
    with pytest.raises(InputError, match="the longest stretch has 2 samples; it takes 3"):
        spectrum_of([np.zeros(1), np.zeros(2)], 1.0)
    with pytest.raises(InputError, match="the values are all the same"):
        search_noise(spectrum_of([np.full(50, 3.0)], 1.0))
