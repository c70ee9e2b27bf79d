"""Sets of effects: the search against trying them all, classes of those that are alike, the unknown."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from fogml.gap.basis import build_basis
from fogml.gap.classes import rank
from fogml.gap.dictionary import unknown_groups
from fogml.gap.evidence import Field
from fogml.gap.model import EffectValue
from fogml.gap.priors import LENGTH_WEIGHTS, LENGTHS, SLACK
from fogml.gap.search import MATTERS, SECOND, Search
from tests.gap.small_model import SmallModel, framed, noise_of, ramps, recorded

TRUE = {"offset": 1.0, "slope": -0.5}
BEND = ("bend", 2.0, (("centre_temperature", 18.0), ("width", 6.0)))
CUBE = ("cube", 3.0, ())
OTHER_FORM = ("bend", -1.5, (("centre_temperature", 18.0), ("width", 6.0)))
LINE = ("line", 0.8, (("period", 900.0), ("phase", 70.0)))


def nothing(time):
    return 0.0


@cache
def searched(effects, ids=("bend", "cube", "mixture", "line"), added=nothing, grouped=True) -> Search:
    rng = np.random.default_rng(1)
    model, whole = SmallModel(ids), SmallModel()
    acting = tuple(EffectValue(id, size, dict(shape)) for id, size, shape in effects)
    runs = []
    for name, count, turns, low in (("a", 300, 2, 0.0), ("b", 240, 3, 5.0)):
        run = ramps(name, count=count, turns=turns, low=low)
        made = recorded(run, whole, TRUE, acting, noise_of(run, rng))
        runs.append(made.with_columns(gyro=made.gyro + added(made.time)))
    frame = framed(runs, model)
    groups = unknown_groups(frame.observations) if grouped else []
    return Search(Field(build_basis(frame, model.candidates(), groups, model.grade)))


def ranked(search):
    explanations = search.run()
    return rank(search, explanations), explanations


@pytest.mark.parametrize("effects", [(), (BEND,), (CUBE, LINE)])
def test_what_acts_is_what_is_found(effects):
    ranking, explanations = ranked(searched(effects))
    assert {e[0] for e in effects} == ranking.best.ids and ranking.best.unknown is None
    named = {r.chosen.candidate for r in ranking.effects if r.probability >= 0.5}
    assert named == ranking.best.ids
    assert ranking.unknown < 0.5
    order = [e.log_posterior for e in explanations]
    assert order == sorted(order, reverse=True)


def test_no_set_beats_the_one_that_the_search_ends_on():
    search = searched((CUBE, LINE))
    best = search.run()[0]
    every = Search(search.field_)
    held = every.field_.condition([])
    first = {id: every.best_node(id, held) for id in every.places}
    for size in (0, 1, 2):
        for ids in combinations(every.places, size):
            for unknown in (False, True):
                found = every.explanation([first[id] for id in ids], "unknown" if unknown else "nothing")
                assert found.log_posterior <= best.log_posterior + 0.5, found


def test_evidence_of_one_effect_is_the_sum_over_its_shapes_and_sizes():
    search = searched((BEND,))
    held = search.field_.condition([])
    gains = held.node_gains()
    # Below the length from which room for a form is made the two are the same sum.
    for id in ("cube", "mixture"):
        found = search.explanation([search.best_node(id, held)])
        if found.effects[0].length < 10.0:
            assert found.log_evidence == pytest.approx(float(logsumexp(gains[search.places[id]])), abs=1e-6)


def test_the_size_of_an_effect_is_the_whitened_length_of_what_it_makes():
    search = searched((CUBE,))
    frame = search.field_.basis.frame
    true = 3.0 * np.sqrt(frame.beside(frame.responses("cube", [{}]))[0, 0])
    chosen = search.best_node("cube", search.field_.condition([]))
    # To half a step of sizes, and the noise.
    assert 0.8 < chosen.size / true < 1.25


def cancelling(time):
    """Made of the two parts of `mixture` against each other, far outside of its shares."""
    return -4.0 * np.sin(time / 700.0)


def test_room_for_a_form_goes_with_what_an_effect_makes_not_with_its_coefficients():
    search = searched((("mixture", 1.0, (("share", 1.0),)),), added=cancelling)
    chosen = search.best_node("mixture", search.field_.condition([]))
    assert chosen.size <= chosen.length
    (room,) = [t for t in search.parts.of([chosen], None) if t.columns == search.field_.slack(chosen.node)]
    assert room.length == pytest.approx(SLACK * chosen.size)


@pytest.mark.parametrize("effects, exact", [((CUBE,), True), ((CUBE, OTHER_FORM), False)])
def test_effects_have_the_catalogues_form_or_room_for_another(effects, exact, monkeypatch):
    # Without the bend among the candidates it is another form of the cube.
    search = searched(effects, ids=("cube", "line"))
    held = search.field_.condition([])

    def explained(share):
        monkeypatch.setattr("fogml.gap.search.EXACT", share)
        return Search(search.field_).explanation([search.best_node("cube", held)])

    found = explained(0.5)
    loose, own = explained(1e-12).log_evidence, explained(1.0 - 1e-12).log_evidence
    assert found.log_evidence == pytest.approx(np.logaddexp(loose, own) - np.log(2.0), abs=1e-6)
    assert found.exact == exact == (own > loose)
    assert len(search.terms(found)) == (1 if exact else 2)


def test_what_acts_beside_an_effect_is_measured_against_it():
    def wander(time):
        return 0.8 * np.sin(2.0 * np.pi * time / 2500.0 + 1.0) * (time > time.mean())

    search = searched((CUBE,), ids=("cube", "bend"), added=wander)
    ranking, _ = ranked(search)
    assert ranking.best.unknown is not None
    (one,) = (r for r in ranking.effects if r.chosen.candidate == "cube")
    rows = search.estimates(ranking.best)
    both = np.column_stack([rows["cube"], rows[ranking.best.unknown[0]]])
    own, unknown = np.diag(search.field_.basis.frame.beside(both))
    assert one.support.length == pytest.approx(np.sqrt(own))
    assert one.support.rest == pytest.approx(np.sqrt(unknown / own))


def test_two_that_are_alike_form_a_class_whose_probability_is_of_both():
    ranking, _ = ranked(searched((BEND,), ids=("bend", "bend_again", "cube", "line")))
    (one,) = (r for r in ranking.effects if r.probability >= 0.5)
    assert set(one.members) == {"bend", "bend_again"} and one.members[0] == one.chosen.candidate
    assert one.probability > 0.7 and one.margin > 5.0


@pytest.mark.parametrize("behind, alike", [(1.0, True), (30.0, False)])
def test_what_takes_the_place_under_other_noise_or_beside_an_unknown_is_of_the_class(behind, alike):
    search = searched((BEND, LINE))
    ranking, explanations = ranked(search)
    best = ranking.best
    assert best.ids == {"bend", "line"}
    swapped = tuple(replace(c, candidate="cube") if c.candidate == "bend" else c for c in best.effects)
    rival = replace(best, effects=swapped, rest="unknown", log_posterior=best.log_posterior - behind)
    told = rank(search, explanations, rivals=[rival])
    classes = {r.chosen.candidate: set(r.members) for r in told.effects}
    assert ("cube" in classes["bend"]) == alike and "cube" not in classes["line"]
    # What does as well without it makes a passenger of it.
    line = tuple(c for c in best.effects if c.candidate == "line")
    without = replace(rival, effects=line, log_posterior=rival.log_posterior + 0.5)
    told = rank(search, explanations, rivals=[rival, without])
    assert all("cube" not in r.members for r in told.effects if r.chosen.candidate == "bend")


def test_a_class_leads_by_what_its_members_are_worth_together():
    search = searched((BEND, LINE))
    ranking, explanations = ranked(search)
    best = ranking.best
    assert best.ids == {"bend", "line"} and best.unknown is None
    (alone,) = (e for e in explanations if not e.ids and e.rest == "unknown")
    ahead = replace(alone, log_posterior=best.log_posterior + 0.5)

    def leading(behind):
        swapped = tuple(replace(c, candidate="cube") if c.candidate == "bend" else c for c in best.effects)
        second = replace(best, effects=swapped, log_posterior=best.log_posterior - behind)
        others = [e for e in explanations if e.log_posterior < best.log_posterior - 3.0]
        return rank(search, sorted([ahead, best, second, *others], key=lambda e: -e.log_posterior)).best

    # Of two members that are worth as much each is half as probable as both together.
    assert leading(0.2).ids == {"bend", "line"}
    assert leading(2.0).ids == frozenset()


def test_one_that_nothing_else_is_like_stands_alone():
    ranking, _ = ranked(searched((CUBE, LINE)))
    (one,) = (r for r in ranking.effects if r.chosen.candidate == "line")
    assert one.members == ("line",) and one.margin > 10.0


def test_something_that_no_candidate_can_do_is_the_unknowns():
    def wander(time):
        rng = np.random.default_rng([4, len(time)])
        waves = zip(rng.normal(size=6), rng.uniform(1500.0, 5000.0, 6), rng.uniform(0.0, 6.0, 6))
        return sum(0.3 * size * np.sin(2.0 * np.pi * time / period + f) for size, period, f in waves)

    ranking, _ = ranked(searched((), ids=("bend", "bend_again", "cube"), added=wander))
    assert ranking.unknown > 0.9
    # What else is named is small beside it.
    assert all(c.length < ranking.best.unknown[1] for c in ranking.best.effects)


def test_a_second_group_of_the_unknown_counts_by_its_dense_density():
    search = searched(())
    basis = search.field_.basis
    terms = search.terms(search.explanation([], "unknown"))
    rows = basis.rows
    covariance = np.eye(len(rows)) + rows[:, basis.constants] @ rows[:, basis.constants].T
    for term in terms:
        columns = rows[:, list(term.columns)]
        covariance += term.length**2 * columns @ columns.T

    def density(more):
        return multivariate_normal(np.zeros(len(rows)), covariance + more).logpdf(rows[:, 0])

    alone = density(0.0)
    gains = []
    for name, places in basis.groups.items():
        spread = rows[:, places] @ rows[:, places].T
        price = basis.kinds[name].price + np.log(len(basis.groups))
        gains += [
            density(length**2 * spread) - alone + np.log(weight / LENGTH_WEIGHTS.sum()) - price
            for length, weight in zip(LENGTHS, LENGTH_WEIGHTS)
        ]
    # Where nothing acts no group gains so much that its likeness to candidates would be asked for.
    assert max(gains) < MATTERS
    expected = np.log(1.0 - SECOND + SECOND * np.exp(logsumexp(gains)))
    assert search._second(terms) == pytest.approx(float(expected), abs=1e-6)


def test_what_two_groups_explain_is_no_effects():
    def both(time):
        fast = 1.2 * np.sin(2.0 * np.pi * time / 700.0) * (time > time.mean())
        return fast + 0.8 * np.sin(2.0 * np.pi * time / 7000.0 + 1.0)

    search = searched((), ids=("cube", "tilted"), added=both)
    found = search.explanation([], "unknown")
    assert found.group is not None
    one = search.field_.condition(search.terms(found)).log_evidence - search.field_.condition([]).log_evidence
    # More than averaging over one group's sizes can bring.
    assert found.log_evidence > one + 5.0


def test_with_no_groups_for_the_unknown_effects_are_found_all_the_same():
    ranking, explanations = ranked(searched((CUBE,), grouped=False))
    assert ranking.best.ids == {"cube"}
    assert all(e.group is None for e in explanations)


def test_probabilities_are_probabilities():
    ranking, _ = ranked(searched((CUBE, LINE)))
    assert 0.0 <= ranking.unknown <= 1.0
    assert all(0.0 <= r.probability <= 1.0 for r in ranking.effects)
    certain = [r.probability for r in ranking.effects]
    assert certain == sorted(certain, reverse=True)
