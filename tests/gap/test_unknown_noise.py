"""Noise that grows somewhere: found where it was put in, and not where noise is less."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.gap.basis import build_basis
from fogml.gap.evidence import Field
from fogml.gap.search import Search
from fogml.gap.unknown_noise import uneven_noise
from tests.gap.small_model import SmallModel, framed, noise_of, ramps, recorded


def told(more):
    """What is told of runs whose white noise is `more` times larger, by temperature and share of time."""
    rng, model, runs = np.random.default_rng(8), SmallModel(ids=("cube",)), []
    for name, turns in (("a", 2), ("b", 3)):
        run = ramps(name, count=1200, turns=turns)
        white = rng.standard_normal(len(run)) * noise_of(run, rng).std()
        size = more(run.temperature(), np.linspace(0.0, 1.0, len(run)))
        noise = noise_of(run, rng) * 0.2 + white * size
        runs.append(recorded(run, model, {}, (), noise))
    scale = np.concatenate([run.gyro for run in runs]).std()
    frame = framed([run.with_columns(gyro=run.gyro / scale * 0.3) for run in runs], model)
    search = Search(Field(build_basis(frame, model.candidates(), [], model.grade)))
    return uneven_noise(search, search.explanation(()))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (lambda t, share: 1.0 + (t > 25.0), "noise grows with high temperature"),
        (lambda t, share: 1.0 + (t < 12.0), "noise grows with low temperature"),
        (lambda t, share: 1.0 + share, "noise grows with time"),
        (lambda t, share: 2.0 - share, "noise falls with time"),
    ],
)
def test_noise_that_grows_is_told_with_what(more, words):
    found = told(more)
    assert found.gain > 5.0 and found.looks_like == words


def test_even_noise_is_told_as_even():
    assert told(lambda t, share: np.ones(len(t))).gain < 0.0
