"""Making blind cases: the mix, files that read, the same bytes again, hashes, going on."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from fogml.blind.first.reality import INVENTED, REALITY
from fogml.blind.folders import BlindFolder, case_files, check_sums
from fogml.blind.make import make_cases
from fogml.blind.plan import plans
from fogml.blind.truth import read_contributions, read_truth
from fogml.errors import InputError
from fogml.runs.reading import read_run

SEED, COUNT, SAMPLE_S = 11, 5, 30.0


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> BlindFolder:
    folder = tmp_path_factory.mktemp("blind")
    assert make_cases(folder, COUNT, SEED, SAMPLE_S, workers=1) == COUNT
    return BlindFolder(folder)


def digests(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_the_mix_is_that_of_the_specification() -> None:
    drawn = plans(400, 3)
    share = {kind: n / 400 for kind, n in Counter(plan.kind for plan in drawn).items()}
    assert share == {
        "nothing": 0.15,
        "one": 0.30,
        "two": 0.15,
        "three": 0.05,
        "unknown_left_out": 0.10,
        "unknown_invented": 0.10,
        "unknown_and_known": 0.10,
        "wrong_thermal": 0.05,
    }
    assert {plan.runs for plan in drawn} == {1, 2, 5}
    assert plans(50, 3) == drawn[:50]
    assert plans(50, 4) != drawn[:50]


def test_every_effect_is_left_out_in_turn_and_every_invention_comes_up() -> None:
    names = REALITY.known_names
    left_out = plans(len(names), 1, ["unknown_left_out"])
    assert sorted(plan.left_out[0] for plan in left_out) == sorted(names)
    assert len(INVENTED) >= 10
    invented = plans(len(INVENTED), 1, ["unknown_invented"])
    assert {plan.first for plan in invented} == {form.name for form in INVENTED}
    assert not any(plan.left_out for plan in invented)


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(InputError, match="no kind of case 'four'"):
        plans(3, 1, ["four"])


def test_run_files_read_without_a_fault_and_fit_the_truth(made: BlindFolder) -> None:
    for name in made.names():
        files, truth = case_files(made.cases / name), read_truth(made.truth / f"{name}.json")
        added = read_contributions(made.truth / f"{name}.npz")
        assert tuple(path.name for path in files.fit) == truth.runs.fit
        assert files.without == truth.left_out
        assert (files.noise is not None) == (truth.runs.noise is not None)
        for path in (*files.fit, *files.held_out):
            run = read_run(path)
            assert run.sample_s == pytest.approx(SAMPLE_S)
            assert 6.0 * 3600.0 <= run.span_s + SAMPLE_S <= 10.0 * 3600.0
            assert np.ptp(run.temperature("T")) > 10.0
            assert run.facts.unit == f"BLIND-{name}"
            for place in range(len(truth.effects)):
                assert len(added[path.name, place]) == len(run)
                assert np.all(np.isfinite(added[path.name, place]))
        programmes = {read_run(path).temperature("T").tobytes() for path in (*files.fit, *files.held_out)}
        assert len(programmes) == len(files.fit) + len(files.held_out)


def test_truth_states_what_it_should(made: BlindFolder) -> None:
    for name in made.names():
        truth = read_truth(made.truth / f"{name}.json")
        many = {"nothing": 0, "two": 2, "three": 3, "unknown_and_known": 2}.get(truth.kind, 1)
        assert len(truth.effects) == many
        assert all(4.0 <= effect.d_prime <= 41.0 for effect in truth.effects)
        assert (truth.d_prime > 0.0) == bool(truth.effects)
        assert all(part.to_s - part.from_s >= 600.0 for part in truth.segments)
        assert set(truth.noise) == {"N", "B", "K"}
        if truth.kind.startswith("unknown"):
            assert truth.unknown
        for closed in truth.closed:
            assert closed.floor > 0.0
            assert closed.closed is None or truth.effects


def test_hashes_hold_and_tell_a_change(made: BlindFolder, tmp_path: Path) -> None:
    assert check_sums(made.truth) == COUNT
    truth = shutil.copytree(made.truth, tmp_path / "truth")
    path = truth / "0001.json"
    path.write_text(path.read_text().replace('"seed": 11', '"seed": 12'))
    with pytest.raises(InputError, match="changed since it was hashed"):
        check_sums(truth)


def test_workers_and_interruptions_don_t_change_a_byte(made: BlindFolder, tmp_path: Path) -> None:
    shutil.copytree(made.path, tmp_path, dirs_exist_ok=True)
    # The last ones were not begun, and one was not done.
    for name in made.names()[3:]:
        shutil.rmtree(tmp_path / "cases" / name)
        for suffix in (".json", ".npz"):
            (tmp_path / "truth" / f"{name}{suffix}").unlink()
    (tmp_path / "truth" / "0002.json").unlink()
    calls: list[tuple[int, int]] = []
    assert make_cases(tmp_path, COUNT, SEED, SAMPLE_S, 2, progress=lambda *c: calls.append(c)) == COUNT - 2
    assert calls[0] == (2, COUNT) and calls[-1] == (COUNT, COUNT)
    assert digests(tmp_path) == digests(made.path)
    assert make_cases(tmp_path, COUNT, SEED, SAMPLE_S) == 0


def test_a_folder_of_another_seed_is_left_alone(made: BlindFolder) -> None:
    before = digests(made.path)
    with pytest.raises(InputError, match="choose another folder"):
        make_cases(made.path, 2, SEED + 1, SAMPLE_S)
    assert digests(made.path) == before


def test_impossible_arguments_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="of 1 or above"):
        make_cases(tmp_path, 0, 1)
    with pytest.raises(InputError, match="sample interval"):
        make_cases(tmp_path, 1, 1, sample_s=100.0)


def test_a_case_is_the_same_whatever_the_part(made: BlindFolder, tmp_path: Path) -> None:
    assert make_cases(tmp_path, 1, SEED, SAMPLE_S, workers=1, first=3) == 1
    assert BlindFolder(tmp_path).names() == ("0003",)
    part = {name: digest for name, digest in digests(tmp_path).items() if "SHA256SUMS" not in name}
    assert part == {name: digest for name, digest in digests(made.path).items() if "0003" in name}
    assert len(part) > 4
    with pytest.raises(InputError, match="of 1 or above"):
        make_cases(tmp_path, 1, SEED, SAMPLE_S, first=0)


def test_only_strong_effects_are_drawn_where_that_is_asked(tmp_path: Path) -> None:
    folder = BlindFolder(tmp_path / "suite")
    make_cases(folder.path, 2, SEED, SAMPLE_S, workers=1, kinds=["two"], first=5, least_d_prime=10.0)
    truths = [read_truth(folder.truth / f"{name}.json") for name in folder.names()]
    assert [truth.case for truth in truths] == ["0005", "0006"]
    assert all(9.9 < effect.d_prime < 41.0 for truth in truths for effect in truth.effects)
    assert not any(truth.mix for truth in truths)
    drawn = plans(6, SEED, ["two"], 10.0)
    assert {plan.strata for plan in drawn} == {((10.0, 20.0), (20.0, 40.0))}
    # Nothing else about the cases changes.
    assert [plan.first for plan in drawn] == [plan.first for plan in plans(6, SEED, ["two"])]
    with pytest.raises(InputError, match="no stratum begins there"):
        make_cases(tmp_path / "none", 1, SEED, SAMPLE_S, least_d_prime=20.5)
    assert not (tmp_path / "none").exists()


def test_only_what_is_drawn_whole_is_of_the_mix(made: BlindFolder, tmp_path: Path) -> None:
    assert all(plan.mix for plan in plans(3, SEED))
    assert not any(plan.mix for plan in (*plans(3, SEED, ["one"]), *plans(3, SEED, None, 10.0)))
    path = made.truth / "0001.json"
    truth = read_truth(path)
    assert truth.mix
    with pytest.raises(InputError, match="drawn from the whole mix"):
        make_cases(made.path, 1, SEED, SAMPLE_S, kinds=[truth.kind])
    # Truths from before this was stated are of the mix.
    old = json.loads(path.read_text())
    del old["mix"]
    (tmp_path / "0001.json").write_text(json.dumps(old))
    assert read_truth(tmp_path / "0001.json") == truth


def test_a_suite_holds_one_range_of_d_prime(tmp_path: Path) -> None:
    """Else the page of stronger cases held those of before, in silence."""
    folder = tmp_path / "suite"
    assert make_cases(folder, 1, 3, SAMPLE_S, 1, ["one"], d_prime=((10.0, 12.0),)) == 1
    assert make_cases(folder, 1, 3, SAMPLE_S, 1, ["one"], d_prime=((10.0, 12.0),)) == 0
    with pytest.raises(InputError, match="outside what is wanted"):
        make_cases(folder, 1, 3, SAMPLE_S, 1, ["one"], d_prime=((20.0, 60.0),))
