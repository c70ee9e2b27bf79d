"""Passes over long series against numpy on the whole of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.fft import dct

from fogml.errors import InputError
from fogml.signals import large
from fogml.signals.cosine import cosine_transform


@pytest.fixture(autouse=True)
def everything_is_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(large, "HELD_VALUES", 100)
    monkeypatch.setattr(large, "PIECE", 64)
    monkeypatch.setattr(large, "_SAMPLE", 32)


def _values() -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.concatenate([rng.normal(size=3001), np.zeros(500), -rng.random(200), [1e300, -1e-300]])


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.77, 0.999, 1.0])
@pytest.mark.parametrize("samples", [3700, 3703])
def test_quantiles_are_those_of_the_whole(share: float, samples: int) -> None:
    values = _values()[-samples:]
    assert large.quantiles(large.parts_of(values), [share]) == [np.quantile(values, share)]
    assert large.median(large.parts_of(values)) == np.median(values)


def test_a_quantile_of_one_value_many_times() -> None:
    values = np.repeat([2.5, -1.0, 7.0], 1000)
    assert large.quantiles(large.parts_of(values), [0.3, 0.5, 0.9]) == [-1.0, 2.5, 7.0]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    st.lists(st.integers(-3, 3), min_size=101, max_size=400),
    st.floats(0.0, 1.0),
    st.booleans(),
    st.sampled_from([0.0, 1e-3, np.inf]),
)
def test_quantiles_of_few_levels_of_sorted_and_of_infinite_values(levels, share, ordered, spread) -> None:
    values = np.array(levels, dtype=float)
    values[::7] += np.arange(len(values[::7])) * spread if spread < np.inf else 0.0
    if spread == np.inf:
        values[:5], values[-5:] = -np.inf, np.inf
    values = np.sort(values) if ordered else values
    parts = large.parts_of(values)
    with np.errstate(invalid="ignore"):
        np.testing.assert_array_equal(large.quantiles(parts, [share]), [np.quantile(values, share)])
        np.testing.assert_array_equal(large.median(parts), np.median(values))


@pytest.mark.parametrize("order", [1, 2])
def test_differences_go_on_from_part_to_part(order: int) -> None:
    values = _values()
    found = list(large.differences(values, order))
    assert len(found) > 10
    assert np.array_equal(np.concatenate([steps for _, steps in found]), np.diff(values, order))
    assert [at for at, _ in found] == np.cumsum([0, *(len(steps) for _, steps in found[:-1])]).tolist()


def test_values_survive_being_let_go_of() -> None:
    values = large.each(lambda x: 2.0 * x, _values())
    large.release()
    assert np.array_equal(values, 2.0 * _values())
    growing = large.Growing()
    for part in large.pieces(values):
        growing.append(values[part])
    del values
    held = growing.array()
    large.release()
    assert np.array_equal(held, 2.0 * _values())


def test_masks_are_those_of_numpy() -> None:
    values = _values()
    mask = values > 0.3
    assert np.array_equal(large.chosen(values, mask), values[mask])
    assert np.array_equal(large.places(mask), np.flatnonzero(mask))
    assert large.standard_deviation(values[:3000]) == pytest.approx(values[:3000].std(), rel=1e-14)


@pytest.mark.parametrize("samples", [102, 1200, 2048, 30000, 2 * 3**4 * 5**3])
def test_the_cosine_transform_in_parts_is_that_of_the_whole(samples: int) -> None:
    values = np.random.default_rng(2).normal(7.0, 1.0, samples)
    assert cosine_transform(values) == pytest.approx(dct(values, norm="ortho"), abs=1e-11)


def test_no_room_for_a_long_run_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(large.os, "posix_fallocate", full, raising=False)
    with pytest.raises(InputError, match=r"no room for .* \(No space left on device\).*TMPDIR"):
        large.empty(10**6)
