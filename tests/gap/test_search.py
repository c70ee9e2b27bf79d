"""Sets of causes by inner products alone, and what stands in for a name."""

import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap import posterior
from fogml.gap.cards import cards_of
from fogml.gap.causes import onset
from fogml.gap.diagnosis import _closed_share, with_epoch
from fogml.gap.fitted_model import explained
from fogml.gap.how_far import Foretold, HeldOut
from fogml.gap.inference import infer, over_noises
from fogml.gap.model import TwinModel, with_effects
from fogml.gap.planning import next_run as ahead
from fogml.gap.planning.rehearsal import _most_likely
from fogml.gap.posterior import _likeliest, judge
from fogml.gap.reports import STAGES
from fogml.gap.result import Estimate
from fogml.gap.scene import Scene
from fogml.gap.settings import STANDARD, Priors
from fogml.gap.unknown import unknown_families
from fogml.gap.where import averages
from fogml.signals.bases import decayed
from fogml.signals.large import release
from fogml.twin.twin_file import load_twin
from tests.gap.test_answer import _run


@pytest.fixture(scope="module")
def found():
    twin = load_twin("tactical")
    wrong = twin.with_effect("thermal_hysteresis", 0.9, half_width=8.0)
    runs = [_run(twin, 1, 120.0), _run(twin, 2, 120.0, hot=40)]
    return infer(TwinModel(wrong), *with_epoch(runs, [], [])[:2], None, (), Priors())


def test_evidence_by_inner_products_is_that_of_the_data(found):
    search = found.search
    for explanation in found.explanations[:5]:
        held = search._held(explanation.members).log_evidence
        assert held == pytest.approx(search.field.beside(explanation.members).log_evidence, rel=1e-9)


def test_candidates_share_what_is_expected_before_the_data(found):
    known = [f.id for f in found.columns.families if f.kind == "known"]
    search, expected = found.search, found.setting.priors.expected_causes
    assert search.prior_probability(known[:1]) == pytest.approx(expected / len(known))
    assert search.prior_probability(known[:3]) == pytest.approx(3 * expected / len(known))
    assert search.prior_probability(["nothing_of_the_kind"]) == 0.0


def test_a_set_has_the_evidence_over_noises_that_the_search_gave_it_at_one(found):
    """Signs that physics gives count in both, of each member, whichever joined last."""
    search, nodes = found.search, found.columns.nodes
    every = search.explanations()
    assert any(len(e.members) > 1 and any(nodes[m.node].positive for m in e.members) for e in every)
    searched = {e.members: e.log_evidence for e in every}
    for e in over_noises(every, [search.field], [0.0]):
        at_one = e.by_noise[0] + search.field.whitening.log_det
        assert at_one == pytest.approx(searched[e.members], abs=1e-6)


def test_what_stands_in_for_a_name_has_none_of_its_class(found):
    best = found.explanations[0]
    names = found.search.names(best)
    assert [found.columns.families[f].id for f in names] == ["thermal_hysteresis"]
    for other in found.search.unexplained(best, names):
        assert not names & set(other.key)
        assert other.score < best.score
    assert found.search.without(best, names).log_prior == pytest.approx(0.0)


def test_what_stands_in_for_a_name_may_be_two_unknown_families(found):
    """A smooth past and what differs between places: neither alone explains as much."""
    search, best = found.search, found.explanations[0]
    names = search.names(best)
    sets = search.unexplained(best, names)
    one = search._refined(search.without(best, names))
    alone = search._each_more(one, search.families_of("unknown"))
    assert len(sets[0].members) == 2
    assert sets[0].score > max(search._refined(e).score for e in alone.values())
    assert [e.score for e in sets] == sorted((e.score for e in sets), reverse=True)


def test_a_name_is_exchanged_for_each_that_explains_nearly_as_much(found):
    search, best = found.search, found.explanations[0]
    (name,) = search.names(best)
    others = [f for f in search.families_of("known") if f != name]
    at_hand = best.log_prior + best.log_evidence
    near = {
        f for f, e in search.instead(best, name, others).items() if e.score > at_hand - search.priors.hopeless
    }
    assert near and near <= search.exchanged(best, name).keys()


def test_what_stands_in_for_names_is_asked_of_the_set_that_is_told(found, monkeypatch):
    """A set with another name, and something unknown, turns out likelier than the first one."""
    search, best = found.search, found.explanations[0]
    (name,) = search.names(best)
    other = max(search.exchanged(best, name).values(), key=lambda e: e.score)
    beside = next(f for f in search.families_of("unknown") if found.columns.families[f].id == "steps")
    other = replace(search.grown(other, [beside]), by_noise=best.by_noise)
    told = iter([best, best, other, other])
    monkeypatch.setattr(posterior, "_likeliest", lambda found, explanations: next(told))
    judged = judge(found)
    assert judged.best is other
    alike = {f for f in search.families_of("known") if found.columns.families[f].id in judged.causes[0].ids}
    assert {e.key for e in search.unexplained(other, alike)} <= {e.key for e in judged.explanations}


def test_a_set_that_is_asked_again_at_one_noise_keeps_its_evidence_over_all(found):
    every = found.explanations
    again = posterior._with_more(every, [replace(e, by_noise=()) for e in every])
    assert [(e.members, e.score) for e in again] == [(e.members, e.score) for e in every]
    better = replace(every[3], log_evidence=every[3].log_evidence + 1.0, by_noise=())
    ahead = better.log_evidence - every[0].log_evidence
    (told,) = (e for e in posterior._with_more(every, [better]) if e.key == better.key)
    assert told.by_noise == pytest.approx([x + ahead for x in every[0].by_noise])


def test_that_nothing_acts_is_asked_at_every_noise_however_many_sets_are_likelier(found):
    few = replace(STANDARD, search=replace(STANDARD.search, rescored=3))
    scene = found.scene
    again = infer(found.model, [r.run for r in scene.runs], (), None, (), few)
    sets = [e.key for e in again.explanations]
    assert len(sets) == 4 and sets[-1] == ()
    assert len(again.explanations[-1].by_noise) == len(again.points.noises)


def test_a_name_is_no_surer_than_its_evidence_and_what_carries_over(found):
    priors = found.setting.priors
    (cause,) = judge(found).causes
    assert cause.evidence <= cause.known
    judged = judge(found)
    assert all(0.0 <= p <= 1.0 for p in (judged.unknown, judged.nothing, cause.evidence))
    against = np.exp(-priors.trust * np.array([cause.odds, cause.within])).sum() + np.exp(-priors.surest)
    # All that is made is its own.
    assert cause.log_share == 0.0
    assert cause.probability == pytest.approx(1.0 / (1.0 + against))
    # Beside one that makes nine times as much, against it counts ten times what no evidence shows.
    beside = priors.believed(cause.odds, cause.within, log_share=np.log(0.1))
    assert beside == pytest.approx(1.0 / (1.0 + against + 9.0 * np.exp(-priors.surest)))
    # Of a rival that is known nothing more is unknown.
    rival = replace(cause, evidence=0.5 * cause.evidence)
    assert rival.odds == cause.odds and rival.within < cause.within


def test_a_cause_acts_since_it_left_a_trace(found):
    """Its course in the first run and a half of the second taken out of the data: it begins there."""
    best = found.explanations[0]
    every = Foretold.of(found, best.members)
    (cause,) = judge(found).causes
    assert onset(found, every, cause, Estimate(1.0, 0.0, "deg/h")) is None
    courses = [sum(every.of_member(i, m) for m in cause.members) for i in range(2)]
    half = len(courses[1]) // 2
    courses[1] = np.where(np.arange(len(courses[1])) < half, courses[1], 0.0)
    later = copy.copy(found.field)
    later.base = replace(later.base, data=later.base.data - later.whitening.stacked(courses))
    search = copy.copy(found.search)
    search.field = later
    again = replace(found, search=search)
    mean = Foretold.of(again, best.members)
    whole, less = (sum(f.of_member(1, m) for m in cause.members) for f in (every, mean))
    size = 0.12 * float(whole @ less) / float(whole @ whole)
    begun = onset(again, mean, cause, Estimate(size, 0.0, "deg/h"))
    assert begun.run == found.setting.scene.runs[1].run.name
    assert begun.time_s == pytest.approx(found.setting.scene.runs[1].time_s[half], abs=300.0)
    # Its size over all runs is a mean of what it is since and of nothing.
    assert size < 0.09
    assert begun.amplitude.value == pytest.approx(0.12, abs=3.0 * begun.amplitude.se)
    assert begun.amplitude.se < 0.02


def test_a_name_among_several_that_are_alike_counts_for_all(found):
    """Two sets with a name, each less likely than the one without, together more likely."""
    named = found.explanations[0]
    none = replace(named, members=())
    one, other = (replace(named, log_prior=named.log_prior - less) for less in (0.3, 0.4))
    assert _likeliest(found, [none, one, other]) is one
    assert _likeliest(found, [none, one]) is none


def test_members_of_a_class_are_told_apart_at_the_sizes_that_they_would_have(found, monkeypatch):
    judged = judge(found)
    item = SimpleNamespace(
        effect="thermal_hysteresis", named=True, members=("thermal_hysteresis", "glass_transition")
    )
    asked = {}

    def told(on, family, members, **rest):
        asked.update(on=on, family=family, members=members, **rest)
        return "a run"

    monkeypatch.setattr(ahead, "separating_run", told)
    assert ahead.next_run(found, judged, [item], (), 3, print) == "a run"
    assert [m.id for m in asked["members"]] == list(item.members)
    own, other = asked["members"]
    assert own.amplitude == pytest.approx(cards_of(found, judged)[own.id].lacking, rel=0.3)
    assert other.amplitude != 0.0
    # As the first run was: its columns, and mounted as it was.
    first = found.scene.runs[0].run
    assert {*asked["on"].columns, "time", "gyro"} == {*first.columns} and asked["on"].facts == first.facts
    assert asked["family"].mountings == (None,)
    alone = SimpleNamespace(effect="thermal_hysteresis", named=True, members=("thermal_hysteresis",))
    assert ahead.next_run(found, judged, [alone], (), 3, print) is None


def test_what_causes_close_is_nothing_where_the_gap_is_no_more_than_noise(found):
    foretold = Foretold.of(found, found.explanations[0].members)
    closed = _closed_share(found, foretold)
    assert 0.5 < closed <= 1.0
    assert _closed_share(found, SimpleNamespace(members=())) == 0.0
    field = copy.copy(found.field)
    quiet = field.base.data / np.linalg.norm(field.base.data)
    field.base = replace(field.base, data=quiet)
    assert _closed_share(SimpleNamespace(field=field), foretold) == 0.0


def test_noise_beside_what_was_found_is_the_twins(found):
    white = found.field.whitening.noise.N
    assert white == pytest.approx(load_twin("tactical").noise.N, rel=0.1)


def test_what_an_event_leaves_heals_in_its_time():
    time = np.arange(0.0, 5000.0, 50.0)
    kicks = np.zeros((len(time), 2))
    kicks[10], kicks[40, 1] = (1.0, 2.0), -1.0
    left = decayed(time, kicks, 900.0)
    since = np.maximum(time - time[10], 0.0)
    assert left[10:, 0] == pytest.approx(np.exp(-since[10:] / 900.0))
    assert left[-1, 1] == pytest.approx(2.0 * left[-1, 0] - np.exp(-(time[-1] - time[40]) / 900.0))


def test_each_unknown_gives_the_same_blocks_on_every_run(found):
    scene: Scene = found.setting.scene
    for family in unknown_families(STANDARD.grids):
        widths = [[b.columns.shape[1] for b in family.build(r, scene)] for r in scene.runs]
        assert widths[0] == widths[1]


@pytest.mark.parametrize(("moves", "recorded"), [(True, False), (False, True)])
def test_an_unknown_of_the_angle_is_told_where_the_table_turns_or_the_angle_is_recorded(moves, recorded):
    count, angle = 60, np.linspace(0.0, 170.0, 60)

    class Turning:
        temperature, row_s, kept = np.full(count, 25.0), 10.0, np.ones(count, dtype=bool)
        even = SimpleNamespace(
            time=10.0 * np.arange(count),
            table_rate=np.full(count, 0.3 * moves),
            angle_deg=angle,
            drives={"angle": angle} if recorded else {},
        )

        def __len__(self):
            return count

        def of(self, values):
            return values

    rows = Turning()
    scene = SimpleNamespace(runs=[rows], span_degc=50.0)
    (family,) = (f for f in unknown_families(STANDARD.grids) if f.id == "table")
    harmonics = list(family.build(rows, scene))[4].columns
    assert harmonics[:, 0] == pytest.approx(np.sin(np.radians(angle)))
    assert harmonics[:, 5] == pytest.approx(np.cos(3.0 * np.radians(angle)))


def test_draws_of_what_is_foretold_move_with_constants_and_the_form_of_what_is_named(found):
    """By finite differences of what is foretold, in the place of its slopes."""
    foretold = explained(found, 1.0).fit.foretold
    (form, unknowns), design = foretold.forms["thermal_hysteresis"], foretold.design(1)
    width = len(foretold.posterior.mean)
    each = averages(found.scene.runs[1], found.scene.runs[1].row_s)
    assert width == design.shape[1] + len(unknowns)
    step = 1e-3
    for i in (0, design.shape[1], width - 1):
        covariance = np.zeros((width, width))
        covariance[i, i] = step**2
        told = replace(foretold, posterior=replace(foretold.posterior, covariance=covariance))
        drawn = told.drawn_on(1, each, np.random.default_rng(3))
        moved = foretold.posterior.mean.copy()
        own = unknowns.copy()
        if i < design.shape[1]:
            moved[i] += step
        else:
            own[i - design.shape[1]] += step
        other = replace(
            foretold,
            posterior=replace(foretold.posterior, mean=moved),
            forms={"thermal_hysteresis": (form, own)},
        )
        change = each.of(other.on(1) - foretold.on(1))
        steps = change @ drawn / (change @ change)
        assert 0.6 < steps.std() < 1.5
        np.testing.assert_allclose(drawn, np.outer(change, steps), atol=0.02 * np.abs(drawn).max())


def test_ends_of_what_is_closed_hardly_move_with_the_seed(found):
    """Forty draws moved an end by a third of the draws' deviation."""
    recalibrated, foretold = Foretold.of(found, ()), explained(found, 1.0).fit.foretold
    told = [HeldOut(found, 1, recalibrated, (), seed).how_far(foretold).closed_ci90 for seed in range(8)]
    width = np.mean([high - low for low, high in told])
    assert width > 0.0
    assert np.std([low for low, _ in told]) < 0.15 * width / 3.3


def test_what_is_named_is_foretold_in_the_place_of_what_the_model_has(found):
    """The model with it replays the run as what is foretold closes the gap."""
    told = explained(found, 1.0)
    constants = {c.name: c.value for c in told.fit.constants}
    twin = with_effects(found.plant, constants, told.fit.effects)
    for run, rows in enumerate(found.scene.fit):
        left = rows.gap - told.fit.foretold.on(run)
        replayed = rows.gap_of(twin)
        assert np.std(replayed - left) < 0.1 * np.std(rows.gap)
        assert np.std(left) < 0.7 * np.std(rows.gap)


def test_a_cause_in_its_familys_form_comes_with_what_the_model_has_of_it(found):
    cause = judge(found).causes[0]
    foretold, rows = Foretold.of(found, cause.members), found.scene.runs[0]
    declared, had = next(held for held in found.plant.on if held[0].id == cause.ids[0])
    more = foretold.of_cause(0, cause) - sum(foretold.of_member(0, m) for m in cause.members)
    made = rows.made(declared, had.amplitude, had.shape, found.setting.values)
    np.testing.assert_allclose(more, made, atol=1e-9)


def test_what_looks_like_an_error_of_a_thermometer_acts_at_the_sensor():
    """Words and stage of an unknown cause stand side by side on the page."""
    reading = [f.id for f in unknown_families(STANDARD.grids) if "thermometer" in f.words]
    assert len(reading) == 2 and {STAGES[id] for id in reading} == {"sensor"}


def test_a_search_on_other_data_finds_what_makes_those(found):
    """What one family makes, without noise, is found to be that family."""
    search = found.search
    family = next(f for f in search.families_of("known") if search.families[f].id == "bias_polynomial")
    node = search.blocks.nodes[search.blocks.rows[family].start]
    data = 20.0 * search.field.block(node)[:, 0]
    other = search.on(data, most_causes=1)
    sets = other.explanations()
    assert {len(e.members) for e in sets} <= {0, 1}
    alone = {e.key[0]: e.score for e in sets if e.members}
    nothing = next(e.score for e in sets if not e.members)
    assert max(alone, key=alone.__getitem__) == family
    assert alone[family] - nothing == pytest.approx(search.alone_on(data)[family])
    # The search itself is as it was.
    assert search.field.base.data is not other.field.base.data
    assert search.priors.most_causes > 1


def test_a_rehearsal_names_beside_something_unknown_that_holds_more():
    """Of sets of two as of one: a class is as likely as all sets that hold it."""
    search = SimpleNamespace(priors=STANDARD, families_of=lambda kind: [0, 1])
    alone = {frozenset(): 0.0, frozenset({0}): 40.0, frozenset({1}): 20.0, frozenset({2}): 90.0}
    likeliest, probability = _most_likely(search, alone, 1.0)
    assert likeliest == [0] and probability < 0.01
    pairs = alone | {frozenset({0, 2}): 130.0, frozenset({2, 3}): 100.0}
    likeliest, probability = _most_likely(search, pairs, 1.0)
    assert likeliest == [0] and probability > 0.8
    assert _most_likely(search, pairs, 1e6)[1] < 0.5
    assert _most_likely(search, {frozenset(): 0.0, frozenset({2}): 5.0}, 1.0) == ([], 0.0)


def test_what_is_put_away_finds_the_same(found):
    """Of several units the columns lie in files."""
    away = found.put_away()
    assert not away.search.cached_rows and away.search.field.white is not found.search.field.white
    assert np.array_equal(away.search.field.white, found.search.field.white)
    assert all(map(np.array_equal, away.columns.by_run, found.columns.by_run))
    release()
    best = found.explanations[0]
    members = found.search.best_members(best.members)
    assert away.search.best_members(best.members) == members
    assert Foretold.of(away, best.members).on(0) == pytest.approx(
        Foretold.of(found, best.members).on(0), rel=1e-12
    )
