"""Choosing realities: alone, in turn, or a twin's own runs; each case of a seed is always the same."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from fogml.blind.folders import BlindFolder, case_files, check_sums
from fogml.blind.make import make_cases
from fogml.blind.plan import MIX, REALITIES, SAME_TWIN, plans
from fogml.blind.relatives import measure_forms
from fogml.blind.truth import read_truth
from fogml.errors import InputError
from fogml.twin.nominal import NominalConstants
from fogml.twin.twin_file import load_twin

SAMPLE_S = 30.0


def digest(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_the_mix_takes_the_realities_in_turn_each_with_its_own_plans() -> None:
    drawn = plans(12, 5, of=MIX)
    assert [plan.reality for plan in drawn] == [REALITIES[k % len(REALITIES)] for k in range(12)]
    assert [plan.number for plan in drawn] == list(range(1, 13))
    for place, name in enumerate(REALITIES):
        own = [(plan.kind, plan.first, plan.runs) for plan in drawn[place :: len(REALITIES)]]
        alone = plans(len(own), 5, of=name)
        assert own == [(plan.kind, plan.first, plan.runs) for plan in alone]
    with pytest.raises(InputError, match="no reality 'fourth'"):
        plans(1, 5, of="fourth")


def test_bounds_of_d_prime_take_the_place_of_the_strata() -> None:
    assert {plan.strata for plan in plans(3, 5, d_prime=((20.0, 60.0),))} == {((20.0, 60.0),)}
    assert not any(plan.mix for plan in plans(3, 5, d_prime=((20.0, 60.0),)))
    with pytest.raises(InputError, match="the lower first"):
        plans(1, 5, d_prime=((60.0, 20.0),))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> BlindFolder:
    folder = tmp_path_factory.mktemp("realities")
    make_cases(folder, 2, 6, SAMPLE_S, workers=1, kinds=["one"], of=MIX, d_prime=((20.0, 60.0),))
    return BlindFolder(folder)


def test_a_seed_gives_the_same_files_and_no_other_reality_goes_on(made: BlindFolder, tmp_path: Path) -> None:
    make_cases(tmp_path, 2, 6, SAMPLE_S, workers=1, kinds=["one"], of=MIX, d_prime=((20.0, 60.0),))
    assert digest(tmp_path) == digest(made.path)
    with pytest.raises(InputError, match="is of the first reality, not of the second"):
        make_cases(tmp_path, 1, 6, SAMPLE_S, kinds=["one"], of="second", d_prime=((20.0, 60.0),))


def test_the_distance_of_each_form_is_written_into_the_truth_and_hashed(made: BlindFolder) -> None:
    before = [read_truth(made.truth / f"{name}.json") for name in made.names()]
    assert measure_forms(made) == 2 and measure_forms(made) == 0
    assert check_sums(made.truth) == 2
    for old, name in zip(before, made.names()):
        new = read_truth(made.truth / f"{name}.json")
        (effect,) = new.effects
        assert 20.0 <= effect.d_prime <= 60.6 and 0.0 < effect.cosine <= 1.0 + 1e-9
        low = {"over 0.95": 0.95, "0.9-0.95": 0.9, "0.8-0.9": 0.8, "under 0.8": 0.0}[effect.form_distance]
        assert low <= effect.cosine
        bare = effect.model_copy(update={"cosine": None})
        assert new.model_copy(update={"effects": (bare,)}) == old


def test_a_twins_own_runs_lack_nothing_and_name_the_twin(tmp_path: Path) -> None:
    make_cases(tmp_path, 2, 6, SAMPLE_S, workers=1, of=SAME_TWIN)
    folder = BlindFolder(tmp_path)
    held = [case_files(folder.cases / name).twin for name in folder.names()]
    assert held == ["tactical", "navigation"]
    assert all(isinstance(load_twin(name).nominal, NominalConstants) for name in held)
    truths = [read_truth(folder.truth / f"{name}.json") for name in folder.names()]
    assert {(t.kind, t.reality, t.effects) for t in truths} == {("nothing", SAME_TWIN, ())}
    assert truths[0].noise["N"].value == load_twin("tactical").noise.N
    with pytest.raises(InputError, match="nothing is missing there"):
        plans(1, 5, ["one"], of=SAME_TWIN)
