"""What an effect adds beside an unknown, against normal densities by whole matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from experiments.gap_blind import beside_unknown, per_case, strictness
from fogml.gap.basis import build_basis
from fogml.gap.evidence import Field, Term
from fogml.gap.group import Group
from fogml.gap.model import EffectValue
from fogml.gap.priors import LENGTH_WEIGHTS, LENGTHS
from tests.gap.small_model import SmallModel, framed, noise_of, ramps, recorded

MODEL = SmallModel(("bend", "cube"))


@pytest.fixture(scope="module")
def frame():
    run = ramps("a", count=120)
    effects = (EffectValue("bend", 0.2, {"centre_temperature": 22.0, "width": 5.0}),)
    return framed([recorded(run, MODEL, {}, effects, noise_of(run, np.random.default_rng(8)))], MODEL)


def test_the_gain_is_that_of_normal_densities(frame) -> None:
    (o,) = frame.observations
    waves = np.cos(np.outer(o.time / 500.0, np.arange(1, 4)))
    groups = (Group("waves", "", (waves,), price=1.5), Group("slow", "", (o.time[:, None] ** 2 / 1e6,)))
    field = Field(build_basis(frame, {}, groups, MODEL.grade))
    white = frame.white([o.response("cube", {}, {})[:, None]])
    term = Term(field.append(white), 1.0)
    gain = beside_unknown._with_unknown(field, [term]) - beside_unknown._with_unknown(field, [])

    def averaged(known: np.ndarray) -> float:
        logs = []
        for name, places in field.basis.groups.items():
            columns = field.basis.rows[:, places]
            for length, weight in zip(LENGTHS, LENGTH_WEIGHTS):
                factors = np.concatenate([frame.fixed, length * columns, known], axis=1)
                covariance = np.eye(len(columns)) + factors @ factors.T
                density = multivariate_normal.logpdf(frame.residual[:, 0], cov=covariance)
                price = field.basis.kinds[name].price
                logs.append(density + math.log(weight) - price - math.log(len(groups)))
        return float(logsumexp(logs))

    assert gain == pytest.approx(averaged(white) - averaged(white[:, :0]), abs=1e-6)


def test_the_kept_page_is_of_the_kept_measurements() -> None:
    seed = strictness.kept_seed()
    rows = [row for case in per_case.of_seed("beside_unknown", seed) for row in case]
    page = (per_case.HERE / "beside_unknown.md").read_text(encoding="utf-8")
    told = beside_unknown.sentence(rows, per_case.of_seed("limits", seed))
    assert told in page and told in (per_case.HERE / "results.md").read_text(encoding="utf-8")
    # The two measurements are of the same effects.
    limits = {
        (row["case"], row["effect"])
        for case in per_case.of_seed("limits", seed)
        for row in case["effects"]
        if row["kind"] == beside_unknown.KIND and row["known"]
    }
    assert {(row["case"], row["effect"]) for row in rows} == limits
