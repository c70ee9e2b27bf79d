"""Several fits of the noise side by side: what each holds for likely counts in the probabilities."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fogml.gap.classes import rank
from fogml.gap.confidence import MOSTLY_FORM, SURE_BESIDE_UNKNOWN, Support, named_probability
from fogml.gap.model import EffectValue
from fogml.gap.preparing import prepare
from fogml.gap.trials import best_trial
from fogml.signals.noise_model import NoiseModel
from tests.gap.small_model import NOISE, SmallModel, noise_of, ramps, recorded


def made(effects=(), noise=NOISE, seed=3, turns=(3, 4, 2)):
    rng, model = np.random.default_rng(seed), SmallModel(ids=("bend", "cube"))
    runs = [ramps(name, count=350, turns=t) for name, t in zip("abc", turns)]
    done = [recorded(run, model, {"offset": 0.5}, effects, noise_of(run, rng, noise)) for run in runs]
    return prepare(model, done[:2], done[2:], None)


def trial(p):
    return best_trial(p, p.model.candidates(), lambda what: None)


CUBE = (EffectValue("cube", 0.6),)


def test_a_rival_that_is_the_same_changes_nothing():
    one = trial(made(CUBE))
    again = rank(one.search, one.explanations, -math.inf, one.explanations)
    alone = rank(one.search, one.explanations, -math.inf)
    assert [(r.chosen, r.margin, r.probability) for r in again.effects] == [
        (r.chosen, r.margin, r.probability) for r in alone.effects
    ]
    assert (again.unknown, again.nothing) == (alone.unknown, alone.nothing)


@pytest.mark.parametrize("ahead", [-6.0, 2.0])
def test_what_is_nothing_under_other_noise_takes_the_margin_off(ahead):
    one = trial(made(CUBE))
    best = one.explanations[0]
    assert best.ids == {"cube"}
    nothing = next(e for e in one.explanations if not e.ids and e.rest == "nothing")
    rival = replace(nothing, log_posterior=best.log_posterior + ahead)
    told = rank(one.search, one.explanations, -math.inf, [rival])
    (cube,) = (r for r in told.effects if r.chosen.candidate == "cube")
    with_it = sum(math.exp(e.log_posterior - best.log_posterior) for e in one.explanations if "cube" in e.ids)
    without = sum(
        math.exp(e.log_posterior - best.log_posterior)
        for e in one.explanations
        if "cube" not in e.ids and (e.ids or e.rest != "nothing")
    )
    # The search's own sets count beside the best one and its rival, as far as that makes the margin less.
    assert cube.members == ("cube",)
    together = math.log(with_it) - math.log(without + math.exp(ahead))
    assert cube.margin == pytest.approx(min(together, -ahead))
    share = math.exp(ahead) / (with_it + without + math.exp(ahead))
    assert told.nothing == pytest.approx(share, rel=1e-6)


def test_noise_that_was_taken_for_too_large_gives_the_effect_back():
    plain = trial(made(CUBE, NoiseModel(0.02, 0.01, 0.01)))
    assert plain.ranking.best.ids == {"cube"}
    assert plain.prepared.noise.fit.model.B < 0.05


def test_nothing_is_named_where_slow_noise_is_all_there_is():
    loud = trial(made(noise=NoiseModel(NOISE.N, 20.0 * NOISE.B, 20.0 * NOISE.K)))
    assert not any(r.probability >= 0.5 for r in loud.ranking.effects)
    assert loud.ranking.nothing > 0.02


def test_slow_noise_is_seen_though_smooth_unknowns_could_make_it_up():
    loud = NoiseModel(NOISE.N, 0.1 * NOISE.B, 9.0 * NOISE.K)
    p = made(noise=loud)
    found = trial(p)
    # Kept out of the noise, smooth unknowns take most of a random walk along.
    assert p.noise.fit.model.K < 0.5 * loud.K
    assert loud.K / 2.0 < found.prepared.noise.fit.model.K < 2.0 * loud.K
    assert not found.ranking.best.ids and found.ranking.best.unknown is None


def test_an_effect_that_each_run_draws_anew_is_no_noise():
    rng, model = np.random.default_rng(5), SmallModel(ids=("bend", "cube_drawn"))
    done = []
    for name, turns, size in (("a", 2, 2.0), ("b", 3, -1.0), ("c", 4, 1.0)):
        run = ramps(name, count=400, turns=turns)
        done.append(
            recorded(run, model, {"offset": 0.5}, (EffectValue("cube_drawn", size),), noise_of(run, rng))
        )
    found = trial(prepare(model, done[:2], done[2:], None))
    assert found.ranking.best.ids == {"cube_drawn"}
    # Taken for noise, twice the one run's cube less the other's would be a random walk of 0.9.
    assert found.prepared.noise.fit.model.K < 3.0 * NOISE.K


def test_names_are_given_from_so_much_evidence_on():
    told = [
        named_probability(Support(m, rest=0.3, length=10.0, joint=m)) for m in np.linspace(-2.0, 30.0, 65)
    ]
    assert all(p >= SURE_BESIDE_UNKNOWN or p < 0.5 for p in told)
    assert told[0] < 0.5 < told[-1]
    # What hangs on another form is not the effect's, however much it gains.
    assert named_probability(Support(1e3, MOSTLY_FORM + 0.01, length=10.0, joint=1e3)) < 0.5


@pytest.mark.parametrize(
    "less",
    [{"margin": 3.0}, {"form_share": 0.1}, {"rest": 1.0}, {"outside": 1}, {"joint": 3.0}, {"others": 30.0}],
)
def test_as_many_nats_with_another_form_or_beside_more_say_less(less):
    support = Support(margin=3.5, length=10.0, joint=6.0, others=10.0)
    assert named_probability(replace(support, **less)) < named_probability(support)
