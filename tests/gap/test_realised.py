"""What evidence credits an effect with, and the fitted effect does not bring."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.gap.basis import build_basis
from fogml.gap.classes import rank
from fogml.gap.evidence import Field
from fogml.gap.fitting import usable_range
from fogml.gap.found import fit_named
from fogml.gap.frame import Frame
from fogml.gap.model import EffectValue
from fogml.gap.preparing import prepare
from fogml.gap.realised import (
    FORM_SHARE,
    lost_names,
    no_more_certain,
    realised,
    shapes_outside,
    unrealised,
)
from fogml.gap.search import Search
from tests.gap.small_model import KINDS, SmallModel, dense, noise_of, ramps, recorded

MODEL = SmallModel(("mixture", "cube"))
FREE = replace(KINDS["mixture"], shape=(replace(KINDS["mixture"].shape[0], limits=(-9.0, 9.0)),))
"""One whose shape may physically leave its usual range."""
MEANS = {"offset": 0.0, "slope": 0.0}


def searched(share=None, against=0.0):
    """Runs, what is found of them where nothing is unknown, and the fit of it."""
    rng = np.random.default_rng(5)
    effects = () if share is None else (EffectValue("mixture", 0.8, {"share": share}),)
    made = []
    for name, turns in zip("abc", (2, 3, 2)):
        run = ramps(name, count=300, turns=turns)
        run = recorded(run, MODEL, {"offset": 0.5}, effects, noise_of(run, rng))
        # Both parts of the mixture, with a share that is none.
        part = np.sin(run.time / 700.0) - 0.5 * ((run.temperature() - 20.0) / 20.0) ** 2
        made.append(run.with_columns(gyro=run.gyro + against * part))
    p = prepare(MODEL, made[:2], made[2:], None)
    frame = Frame(p.fit, p.whiteners, MODEL.constants, p.recalibrated.constants)
    search = Search(Field(build_basis(frame, MODEL.candidates(), (), MODEL.grade)))
    ranking = rank(search, search.run())
    assert ranking.named == {"mixture"}
    candidates = MODEL.candidates()
    return p, candidates, search, ranking, fit_named(p, candidates, search, ranking)


def test_an_effect_that_does_what_it_is_credited_with_keeps_its_name():
    found = searched(share=0.7)
    ranking = realised(*found)
    assert ranking.named == {"mixture"} and ranking.unknown == pytest.approx(found[3].unknown)
    assert [(r.margin, r.unrealised) for r in ranking.effects] == [(r.margin, 0.0) for r in found[3].effects]


def _blurred(on, constants, effects=()):
    """A replay whose effects see readings with noise."""
    noise = np.random.default_rng(len(on.run)).standard_normal(len(on.run))
    return 0.0 * on.run.time + sum(e.amplitude for e in effects) * noise


def test_what_readings_noise_makes_of_a_replay_is_no_loss(monkeypatch):
    """A replay of noisy readings falls short of its effect; the effect's own response does not."""
    p, candidates, search, ranking, fit = searched(share=0.7)
    monkeypatch.setattr(type(p.fit[0].model), "output", _blurred)
    assert unrealised(candidates, search, ranking, fit) == {"mixture": 0.0}


def test_what_no_share_of_the_parts_makes_is_not_named_for_them():
    found = searched(against=0.19)
    ranking = realised(*found)
    assert not ranking.named and ranking.unknown > 0.4 > found[3].unknown
    (before,), (after,) = found[3].effects, ranking.effects
    assert after.margin == pytest.approx(before.margin - after.unrealised)
    # Something acts for certain: the unknown takes over what the name gives up.
    given_up = before.probability - after.probability
    assert 1.0 - ranking.unknown == pytest.approx((1.0 - found[3].unknown) * (1.0 - given_up))
    assert after.probability < 0.5 < before.probability


def test_what_is_brought_is_the_evidence_of_the_fitted_replay():
    p, candidates, search, ranking, fit = searched(against=0.4)
    (effect,) = fit.effects
    gap = np.concatenate([o.recorded - o.model.output(MEANS) for o in p.fit])
    make = np.concatenate([o.model.response("mixture", effect.shape, MEANS) for o in p.fit])
    columns = [np.column_stack([c.sd * o.model.columns()[c.name] for c in MODEL.constants]) for o in p.fit]
    constants = np.concatenate(columns)
    covariance = constants @ constants.T
    first = 0
    for o in p.fit:
        rows = slice(first, first + len(o))
        covariance[rows, rows] += dense(o.run.time, o.run.sample_s, p.noise.model)
        first += len(o)
    inverse = np.linalg.inv(covariance)
    (chosen,) = ranking.best.effects
    fits, size = make @ inverse @ gap, make @ inverse @ make
    # A normal amplitude whose standard deviation makes a whitened length of the chosen one.
    square = chosen.length**2
    brought = 0.5 * square / (1.0 + square) * fits**2 / size - 0.5 * np.log1p(square)
    field = search.field_
    credited = field.condition(search.terms(ranking.best)).log_evidence - field.condition([]).log_evidence
    lost = unrealised(candidates, search, ranking, fit)["mixture"]
    assert lost == pytest.approx((1.0 - FORM_SHARE) * credited - brought, rel=0.03) and lost > 5.0


def test_a_member_of_the_class_that_brings_it_is_put_first(monkeypatch):
    """One that takes the place at 2 nats and brings its gain, before one that falls short of its own by 9."""
    from fogml.gap import realised as module

    p, candidates, search, ranking, fit = searched(share=0.7)
    (mixture,) = ranking.effects
    whole = next(e for e in search.tried if e.ids == {"mixture"} and e.rest == "nothing")
    cube = replace(
        whole,
        effects=(replace(whole.effects[0], candidate="cube"),),
        log_posterior=whole.log_posterior - 2.0,
    )
    search._held[(frozenset({"cube"}), "nothing")] = cube
    supported = replace(mixture, members=("mixture", "cube"), support=replace(mixture.support, margin=12.0))
    both = replace(ranking, effects=(supported,))
    lost = {"mixture": 9.0, "cube": 0.0}
    monkeypatch.setattr(module, "fit_named", lambda *given: replace(fit, effects=()))
    monkeypatch.setattr(
        module,
        "unrealised",
        lambda c, s, r, fit: {i: lost[i] for i in r.best.ids if lost[i] or i == "cube"},
    )
    found = realised(p, candidates, search, both, fit)
    assert [r.members for r in found.effects] == [("cube", "mixture")]
    assert found.best.ids == {"cube"}
    assert found.effects[0].margin == pytest.approx(10.0)
    # With as little to choose between them the first one stays.
    lost["mixture"] = 1.5
    kept = realised(p, candidates, search, both, fit)
    assert [r.members for r in kept.effects] == [("mixture", "cube")]
    assert kept.effects[0].margin == pytest.approx(10.5)


def test_a_shape_outside_of_its_usual_range_makes_a_name_less_probable():
    p, candidates, search, ranking, fit = searched(share=0.7)
    (effect,) = fit.effects
    far = replace(fit, effects=(replace(effect, shape={"share": 1.5}),))
    (usual,), (outside,) = (realised(p, candidates, search, ranking, f).effects for f in (fit, far))
    assert (usual.support.outside, outside.support.outside) == (0, 2)
    assert shapes_outside(candidates["mixture"], {"share": 1.015}, {}) == 0
    assert outside.probability < usual.probability


@pytest.mark.parametrize(
    ("share", "error", "count"),
    [(1.05, 0.0, 1), (1.05, 0.04, 1), (1.05, 0.06, 0), (-0.05, 0.06, 0), (1.05, 9.0, 0), (1.15, 9.0, 1)],
)
def test_a_shape_that_chance_may_have_put_outside_of_its_range_is_not_outside(share, error, count):
    """Where it is near: what the runs don't tell at all is no excuse for any shape."""
    errors = {"mixture.share": error, "cube.share": 9.0}
    assert shapes_outside(FREE, {"share": share}, errors) == count


@pytest.mark.parametrize("share, count", [(1.2, 1), (1.2499, 2), (1.25, 2), (-0.25, 2), (-0.2, 1), (1.0, 0)])
def test_a_shape_that_went_as_far_as_a_fit_lets_it_counts_twice(share, count):
    (quantity,) = FREE.shape
    assert usable_range(quantity, *quantity.of_any_grade) == (-0.25, 1.25)
    assert shapes_outside(FREE, {"share": share}, {}) == count


def test_directions_have_no_usual_range():
    assert shapes_outside(KINDS["line"], {"period": 900.0, "phase": 500.0}, {}) == 0
    assert shapes_outside(KINDS["line"], {"period": 5000.0, "phase": 70.0}, {}) == 1


def test_what_was_found_beside_a_lost_name_is_no_more_certain_than_without_it():
    ranking = searched(share=0.7)[3]
    (mixture,) = ranking.effects
    chosen = replace(mixture.chosen, candidate="cube")
    cube = replace(mixture, chosen=chosen, members=("cube", "bend"), probability=0.9)
    best = replace(ranking.best, effects=(mixture.chosen, chosen))
    before = replace(ranking, best=best, effects=(replace(mixture, probability=0.8), cube), unknown=0.1)
    after = replace(before, effects=(cube, replace(mixture, probability=0.3)), unknown=0.6)
    assert lost_names(before, after) == {"mixture"}
    # None of a class that is lost takes its place.
    two = replace(before, effects=(replace(before.effects[0], members=("mixture", "other", "bend")), cube))
    assert lost_names(two, after) == {"mixture", "other"}
    # A class whose first member changed has lost nothing.
    swapped = replace(cube, chosen=replace(chosen, candidate="bend"), members=("bend", "cube"))
    best = replace(best, effects=(mixture.chosen, swapped.chosen))
    changed = replace(before, best=best, effects=(before.effects[0], swapped))
    assert lost_names(before, changed) == frozenset()
    alone = replace(ranking, effects=(replace(cube, members=("bend",), probability=0.6),), unknown=0.7)
    found = no_more_certain(after, alone)
    assert [(r.chosen.candidate, r.probability) for r in found.effects] == [("cube", 0.6), ("mixture", 0.3)]
    assert found.unknown == 0.7
    assert no_more_certain(after, replace(alone, effects=(), unknown=0.2)).unknown == 0.6


def test_a_search_without_a_candidate_never_names_it():
    _, _, search, ranking, _ = searched(share=0.7)
    assert ranking.named == {"mixture"}
    without = Search(search.field_, frozenset({"mixture"}))
    assert not any("mixture" in e.ids for e in without.run())
    assert any("mixture" in e.ids for e in search.tried)
