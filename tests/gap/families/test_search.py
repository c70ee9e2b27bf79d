"""Sets of causes by inner products alone, and what stands in for a name."""

import numpy as np
import pytest

from fogml.gap.families.inference import infer
from fogml.gap.families.places import Scene
from fogml.gap.families.posterior import judge
from fogml.gap.families.priors import Priors
from fogml.gap.families.unknown import _decay, unknown_families
from fogml.gap.twin_model import TwinModel
from fogml.runs.epochs import with_epoch
from fogml.twin.twin_file import load_twin
from tests.gap.families.test_answer import _run


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
        assert held == pytest.approx(search.field.beside(explanation.nodes).log_evidence, rel=1e-9)


def test_what_stands_in_for_a_name_has_none_of_its_class(found):
    best = found.explanations[0]
    names = found.search.names(best)
    assert [found.columns.families[f].id for f in names] == ["thermal_hysteresis"]
    for other in found.search.unexplained(best, names):
        assert not names & set(other.key)
        assert other.score < best.score
    assert found.search.without(best, names).log_prior == pytest.approx(0.0)


def test_a_name_is_no_surer_than_its_evidence_and_what_carries_over(found):
    priors = found.setting.priors
    (cause,) = judge(found).causes
    assert cause.odds <= np.log(cause.evidence / (1.0 - cause.evidence)) + 1e-9
    assert cause.probability == pytest.approx(1.0 / (1.0 + np.exp(-priors.trusted(cause.odds))))


def test_noise_beside_what_was_found_is_the_twins(found):
    white = found.field.whitening.noise.N
    assert white == pytest.approx(load_twin("tactical").noise.N, rel=0.1)


def test_what_an_event_leaves_heals_in_its_time():
    time = np.arange(0.0, 5000.0, 50.0)
    kicks = np.zeros((len(time), 2))
    kicks[10], kicks[40, 1] = (1.0, 2.0), -1.0
    left = _decay(time, kicks, 900.0)
    since = np.maximum(time - time[10], 0.0)
    assert left[10:, 0] == pytest.approx(np.exp(-since[10:] / 900.0))
    assert left[-1, 1] == pytest.approx(2.0 * left[-1, 0] - np.exp(-(time[-1] - time[40]) / 900.0))


def test_each_unknown_gives_the_same_blocks_on_every_run(found):
    scene: Scene = found.setting.scene
    for family in unknown_families():
        widths = [
            [b.columns.shape[1] for b in family.build(r, scene, found.setting.values)] for r in scene.runs
        ]
        assert widths[0] == widths[1]
