"""Noise or effect: the joint probability against the dense normal density."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fogml.gap.basis import build_basis
from fogml.gap.classes import UNEVEN, rank
from fogml.gap.evidence import Field
from fogml.gap.frame import Frame
from fogml.gap.preparing import Prepared, prepare
from fogml.gap.quieter import log_joint, quieter
from fogml.gap.search import Search
from fogml.signals.noise_model import NoiseModel
from tests.gap.small_model import NOISE, SmallModel, dense, noise_of, ramps, recorded


def prepared(noise: NoiseModel) -> Prepared:
    """Runs of a model whose noise is thought to be the usual one."""
    rng = np.random.default_rng(12)
    model = SmallModel(ids=("cube",))
    runs = [ramps(name, count=400, turns=turns) for name, turns in (("a", 3), ("b", 4))]
    made = [recorded(run, model, {"offset": 0.5}, (), noise_of(run, rng, noise)) for run in runs]
    return prepare(model, made[:1], made[1:], None)


def searched(p: Prepared):
    frame = Frame(p.fit, p.whiteners, p.model.constants, p.recalibrated.constants)
    search = Search(Field(build_basis(frame, p.model.candidates(), p.groups, "tactical")))
    return search, rank(search, search.run())


def test_the_joint_probability_is_the_dense_one():
    p = prepared(NOISE)
    search, ranking = searched(p)
    assert ranking.best.effects == () and ranking.best.rest == "nothing"
    (o,) = p.fit
    columns = o.model.columns()
    fixed = np.column_stack([c.sd * columns[c.name] for c in p.model.constants])
    covariance = dense(o.time, o.row_s, p.noise.model) + fixed @ fixed.T
    density = multivariate_normal(np.zeros(len(o)), covariance, allow_singular=False).logpdf(o.recorded)
    centre, deviations = p.noise_prior.centre, p.noise_prior.deviations
    fitted = p.noise.fit.model
    off = [math.log(getattr(fitted, n) / getattr(centre, n)) / d for n, d in zip("NBK", deviations)]
    uneven = math.log(1.0 - UNEVEN + UNEVEN * math.exp(ranking.noise.gain))
    wanted = density + 0.5 * len(o) * math.log(2.0 * math.pi) - 0.5 * float(np.sum(np.square(off)))
    assert log_joint(p, search, ranking) == pytest.approx(
        wanted + uneven + ranking.best.log_posterior, abs=1e-5
    )


def test_only_noise_above_what_is_known_is_tried_as_known():
    assert quieter(prepared(NOISE)) is None
    known = quieter(prepared(NoiseModel(NOISE.N, 30.0 * NOISE.B, 30.0 * NOISE.K)))
    assert known is not None
    assert (known.noise.model.B, known.noise.model.K) <= (NOISE.B * 1.001, NOISE.K * 1.001)


def test_noise_that_is_there_stays_noise():
    loud = prepared(NoiseModel(NOISE.N, 30.0 * NOISE.B, 30.0 * NOISE.K))
    known = quieter(loud)
    assert known is not None
    assert log_joint(loud, *searched(loud)) > log_joint(known, *searched(known))
