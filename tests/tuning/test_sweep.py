"""Sweeps: repeatable, resumable, shared by processes and a database, and safe against killed workers."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import time
from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.features.parse import parse_features
from fogml.models.names import make_model
from fogml.report.sweep_page import standing
from fogml.runs.run import Run
from fogml.tuning.held_out import HeldOut
from fogml.tuning.plan import Choice, Space
from fogml.tuning.storage import JOURNAL
from fogml.tuning.study import begin_trial, free_place, is_finished, open_study
from fogml.tuning.sweep import run_sweep, study_json
from fogml.tuning.winner import against_references, complete, figure, pareto, train_settings, winner
from tests.tuning.world import SPACE, plan, runs

optuna = pytest.importorskip("optuna", reason="Optuna is not installed: pip install -e '.[sweep]'")


def tried(study):
    return [(t.params, t.values) for t in study.get_trials() if is_finished(t)]


def test_the_held_out_error_is_that_of_a_plain_least_squares_fit_on_the_other_run(tmp_path):
    held_out = HeldOut(runs(), Space.model_validate(SPACE | {"window": 4.0}))
    choice = Choice("polynomial", "T", {"ridge": 0.0})
    results = list(held_out.judged(choice))
    assert len(results) == 2
    for place, result in enumerate(results):
        # Windows of up to 3 time constants: the first rows count for no choice.
        held, other = runs()[place], runs()[1 - place]
        full = parse_features("dT[exp, 4 s], dT[block, 4 s]").atom_values
        used, rest = full(held)[1], full(other)[1]
        slope, level = np.polyfit(other.columns["T"][rest], other.gyro[rest], 1)
        span = other.columns["T"][rest]
        limited = np.clip(held.columns["T"][used], span.min(), span.max())
        # Beyond the box a polynomial goes on along its tangent, which for a line is the line.
        error = held.gyro[used] - (level + slope * limited)
        if np.array_equal(limited, held.columns["T"][used]):
            found = np.average(result.squared_errors, weights=result.rows)
            assert found == pytest.approx(np.mean(error**2), rel=1e-9)
        assert result.size_bytes == 16
        # A signal, four to limit it, a product and two sums.
    assert result.operations == 8


def test_every_choice_is_judged_on_the_same_rows():
    held_out = HeldOut(runs(), Space.model_validate(SPACE))
    texts = ("T", "T, dT[block, 16 s]", "T, dT[exp, 64 s]")
    rows = [[r.rows for r in held_out.judged(Choice("polynomial", text, {}))] for text in texts]
    assert rows[0] == rows[1] == rows[2]


def test_a_sweep_repeats_itself_and_goes_on_as_if_it_had_not_been_interrupted(tmp_path):
    whole = run_sweep(plan(tmp_path / "whole"))
    again = run_sweep(plan(tmp_path / "again"))
    first = run_sweep(plan(tmp_path / "parts", trials=3))
    assert len(tried(first)) == 3
    resumed = run_sweep(plan(tmp_path / "parts"))
    assert len(tried(whole)) == 8
    assert tried(whole) == tried(again) == tried(resumed)
    assert tried(run_sweep(plan(tmp_path / "other", seed=1))) != tried(whole)


@pytest.mark.parametrize("sampler", ["tpe", "random"])
def test_a_sweep_killed_at_any_entry_of_its_journal_goes_on_bit_for_bit(tmp_path, sampler):
    settings = {"sampler": sampler, "trials": 5, "prune": True, "objectives": ("rms", "bytes")}
    whole = plan(tmp_path / "whole", **settings)
    expected = _told(run_sweep(whole))
    lines = (tmp_path / "whole" / JOURNAL).read_text().splitlines(keepends=True)
    # A process that is gone: the journal names this one, which lives.
    lines = [line.replace(f'"pid":{os.getpid()}', '"pid":999999999') for line in lines]
    begun = [at for at, line in enumerate(lines) if '"op_code":4' in line]
    # After a trial is made, after its first parameter, before it is told; of the third and the last trial.
    ends = [begun[2] + 1, begun[2] + 2, begun[3], begun[4] + 1, len(lines) - 1]
    for end in ends:
        folder = tmp_path / f"cut-{end}"
        folder.mkdir()
        (folder / JOURNAL).write_text("".join(lines[:end]))
        assert _told(run_sweep(plan(folder, **settings))) == expected


def _told(study, objectives=("rms", "bytes")):
    """``sweep.json`` but for how many trials had to be tried again."""
    values = study_json(
        study,
        objectives=objectives,
        runs=["a.csv", "b.csv"],
        test=[],
        seed=0,
        averaging_s=100.0,
        storage=None,
        judgement=None,
    )
    del values["counts"]["retried"]
    return json.dumps(values)


def test_a_mean_among_the_models_takes_no_features(tmp_path):
    space = {"features": ["T"], "models": ["mean"]}
    (trial,) = run_sweep(plan(tmp_path, space=space, trials=1)).get_trials()
    assert trial.state.name == "COMPLETE" and trial.user_attrs["features"] == ""


def test_presets_alone_leave_nothing_to_choose(tmp_path):
    with pytest.raises(InputError, match="'M3' leaves nothing to choose"):
        run_sweep(plan(tmp_path, space={"features": ["T"], "models": ["M3"]}))
    with pytest.raises(InputError, match=r"model 'Mine'.*known"):
        run_sweep(plan(tmp_path, space={"features": ["T"], "models": ["Mine"]}))


@pytest.mark.parametrize(("folds", "told"), [("time", "blocks of time"), ("auto", "runs")])
def test_what_was_held_out_is_told_as_it_was_whatever_the_number_of_runs(tmp_path, folds, told):
    space = {"features": ["T"], "models": ["polynomial"]}
    study = run_sweep(plan(tmp_path, space=space, trials=1, folds=folds))
    assert json.loads(_told(study, objectives=["rms"]))["folds"] == told


def test_workers_of_one_place_leave_it_to_the_first(tmp_path):
    study = open_study(plan(tmp_path))
    first, second = begin_trial(study, 0), begin_trial(study, 0)
    assert first is not None and second is None
    assert [t.state.name for t in study.get_trials()] == ["RUNNING", "FAIL"]
    assert free_place(study, 2) == 1
    study.tell(first, state=optuna.trial.TrialState.FAIL)
    assert free_place(study, 2) == 0
    again = begin_trial(study, 0)
    assert again is not None and again.user_attrs["retry_of"] == 1


def test_the_right_features_win(tmp_path):
    study = run_sweep(plan(tmp_path, objectives=("rms", "bytes"), trials=12))
    best = winner(study.get_trials())
    assert "dT" in best.user_attrs["features"]
    least = min(figure(t, "rms") for t in complete(study.get_trials()))
    assert figure(best, "rms") < 1.1 * least
    front = pareto(study.get_trials())
    for trial in complete(study.get_trials()):
        assert trial in front or any(np.all(np.array(f.values) <= trial.values) for f in front)
    for one in front:
        assert not any(np.all(np.array(f.values) <= one.values) and f.values != one.values for f in front)


def test_trials_that_a_finished_one_beats_are_pruned_and_the_best_never_is(tmp_path):
    settings = {"folds": "time", "fold_count": 10, "trials": 14, "sampler": "random"}
    kept = run_sweep(plan(tmp_path / "kept", **settings))
    raced = run_sweep(plan(tmp_path / "raced", **settings, prune=True))
    pruned = [t for t in raced.get_trials() if t.state.name == "PRUNED"]
    assert pruned
    assert all(len(t.user_attrs["fold_errors"]) < 10 for t in pruned)
    assert [t.params for t in kept.get_trials()] == [t.params for t in raced.get_trials()]
    assert figure(winner(raced.get_trials()), "rms") == pytest.approx(
        figure(winner(kept.get_trials()), "rms"), rel=0.02
    )


def test_random_trials_are_the_same_for_any_number_of_workers(tmp_path):
    alone = run_sweep(plan(tmp_path / "one", sampler="random", trials=6))
    crew = run_sweep(plan(tmp_path / "two", sampler="random", trials=6), workers=2)
    key = lambda entry: sorted(entry[0].items(), key=str)  # noqa: E731
    assert sorted(tried(alone), key=key) == sorted(tried(crew), key=key)


def _hang_in_the_third_trial(settings):
    import fogml.tuning.worker as worker

    evaluate = worker._evaluate

    def hanging(study, plan, held_out, trial):
        if trial.number == 2:
            plan.space.suggest(trial)
            time.sleep(600)
        return evaluate(study, plan, held_out, trial)

    worker._evaluate = hanging
    run_sweep(settings)


@pytest.mark.parametrize("kept_in", ["journal", "postgres"])
def test_a_worker_killed_in_mid_trial_loses_nothing(tmp_path, kept_in, request):
    storage = request.getfixturevalue("database") if kept_in == "postgres" else None
    settings = replace(plan(tmp_path, storage=storage, trials=5), name=f"killed {tmp_path}")
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=_hang_in_the_third_trial, args=(settings,))
    process.start()
    study, deadline = None, time.monotonic() + 60
    while time.monotonic() < deadline:
        time.sleep(0.1)
        study = study or open_study(settings)
        running = [t for t in study.get_trials(deepcopy=False) if t.state.name == "RUNNING"]
        if running and running[0].number == 2 and running[0].params:
            break
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    before = tried(study)
    assert len(before) == 2
    ended = run_sweep(settings)
    finished = [t for t in ended.get_trials() if is_finished(t)]
    assert len(finished) == 5
    assert [(t.params, t.values) for t in finished][:2] == before
    retried = [t for t in finished if t.user_attrs.get("retry_of") == 2]
    assert len(retried) == 1
    assert running[0].params.items() <= retried[0].params.items()
    uninterrupted = run_sweep(plan(tmp_path / "other", trials=5))
    assert [v for _, v in tried(uninterrupted)] == [v for _, v in tried(ended)]


def test_two_commands_share_a_study_in_the_database(tmp_path, database):
    settings = replace(plan(tmp_path, storage=database, trials=8), name=f"shared {tmp_path}")
    context = multiprocessing.get_context("spawn")
    other = context.Process(target=run_sweep, args=(settings,))
    other.start()
    here = run_sweep(settings)
    other.join(60)
    assert other.exitcode == 0
    finished = [t for t in here.get_trials() if is_finished(t)]
    assert len(finished) == 8
    assert not [t for t in here.get_trials() if t.state.name in ("RUNNING", "WAITING")]


def test_a_study_made_for_something_else_is_refused(tmp_path):
    run_sweep(plan(tmp_path, trials=2))
    wider = {**SPACE, "window": {"low": 8, "high": 64}}
    with pytest.raises(InputError, match="another search space; its trials can't be gone on with"):
        run_sweep(plan(tmp_path, trials=2, space=wider))
    with pytest.raises(InputError, match="another seed"):
        run_sweep(plan(tmp_path, trials=2, seed=5))


def test_a_choice_that_cannot_be_fitted_is_told_and_the_rest_go_on(tmp_path):
    # The rows alone tell that this kernel can't take them: it is of numbers above 0.
    space = {**SPACE, "models": {"sklearn.kernel_ridge.KernelRidge": {"kernel": ["chi2", "rbf"]}}}
    study = run_sweep(plan(tmp_path, space=space, trials=6, sampler="random"))
    states = {t.params["sklearn.kernel_ridge.KernelRidge.kernel"]: t for t in study.get_trials()}
    assert states["chi2"].state.name == "PRUNED"
    assert "negative" in states["chi2"].user_attrs["reason"]
    assert states["rbf"].state.name == "COMPLETE"


def test_the_default_and_autos_choice_are_tried_first(tmp_path):
    """Whatever the space offers, and the winner is held against them."""
    space = {"features": ["T"], "models": {"polynomial": {"ridge": {"low": 1e-4, "high": 1e-2}}}}
    study = run_sweep(plan(tmp_path, space=space, trials=4, references=None))
    trials = [trial for trial in study.get_trials() if is_finished(trial)]
    assert len(trials) == 4
    (default, *others) = [trial for trial in trials if "reference" in trial.user_attrs]
    assert default.number == 0 and default.user_attrs["features"] == make_model("polynomial").features
    names = ", ".join(trial.user_attrs["reference"] for trial in (default, *others))
    assert names == "default, auto"
    # The space knows nothing of the rate, which the drift holds.
    best = winner(trials)
    assert "reference" in best.user_attrs
    worst = max(trials, key=lambda trial: figure(trial, "bias_stability"))
    told = against_references(trials, worst)
    assert all(one["winner_worse"] and one["beyond_noise"] for one in told)
    assert "worse than default" in standing({"bias_stability": 1.0, "against": told})[0]
    alike = [{**told[0], "bias_stability": 0.41721, "winner_worse": True}]
    assert standing({"bias_stability": 0.41724, "against": alike}) == []
    # What `auto` made, here the default's form and nothing beside, is judged as it would be used, and
    # `fogml train` is told to make it again.
    auto = next(trial for trial in trials if trial.user_attrs.get("reference") == "auto")
    weights = make_model("auto").fit(runs()).weighed_.weights
    assert weights.pop(default.user_attrs["features"]) == pytest.approx(1.0, abs=1e-3)
    assert set(weights.values()) == {0.0}
    assert figure(auto, "rms") == pytest.approx(figure(default, "rms"), rel=0.1)
    assert train_settings(auto) == {"model": "auto"}


def test_the_default_wins_unless_a_trial_beats_it_beyond_noise(tmp_path):
    """The drift is of the default's form: less does worse, and more tells nothing of fresh runs."""
    default = Choice("polynomial", "T, dT[block, 16 s]", {})
    space = {"features": {"static": ["T", "T^1..5"], "rate": ["", "dT[block, 16 s]"]}}
    asked = plan(tmp_path, space=space | {"models": ["polynomial"]}, references={"default": default})
    best = winner(run_sweep(asked).get_trials())
    assert best.user_attrs["reference"] == "default"
    assert "it stays the winner" in standing(best.user_attrs)[0]
    poor = replace(asked, folder=str(tmp_path / "poor"), references={"default": Choice("mean", "", {})})
    beaten = winner(run_sweep(poor).get_trials())
    assert "dT" in beaten.user_attrs["features"] and not standing(beaten.user_attrs)


def test_a_bias_that_moves_from_run_to_run_does_not_hide_the_better_model(tmp_path):
    """Biases of 0.3 deg/h on runs whose rate term is a third of that: it is in the winner still."""

    def biased() -> list[Run]:
        return [
            Run(run.name, {**run.columns, "gyro": run.gyro + 0.3 * (-1) ** number}, run.facts)
            for number, run in enumerate(runs(3))
        ]

    space = {"features": {"static": ["T"], "rate": ["", "dT"]}, "models": ["polynomial"]}
    asked = replace(
        plan(tmp_path, space=space, objectives=("bias_stability", "bytes"), trials=8), read=biased
    )
    trials = run_sweep(asked).get_trials()
    best = winner(trials)
    assert "dT" in best.user_attrs["features"]
    assert figure(best, "bias_stability") < 0.1 < 0.25 < figure(best, "rms")
    # Of each run's errors about its own mean, from the errors themselves.
    held = HeldOut(biased(), asked.space)
    squares, rows = [], []
    for result in held.judged(Choice("polynomial", best.user_attrs["features"], {})):
        mean = np.average(result.mean_errors, weights=result.rows)
        squares.append(np.average(result.squared_errors, weights=result.rows) - mean**2)
        rows.append(sum(result.rows))
    assert figure(best, "bias_stability") == pytest.approx(
        np.sqrt(np.average(squares, weights=rows)), rel=1e-6
    )
