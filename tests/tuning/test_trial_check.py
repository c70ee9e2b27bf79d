"""Trials that come from anywhere: what a sweep did not write is told before it is used."""

from __future__ import annotations

from typing import Any

import optuna
import pytest
from optuna.trial import TrialState, create_trial

from fogml.errors import InputError
from fogml.tuning.study import check_trials
from tests.tuning.world import plan

SOUND: dict[str, Any] = {
    "model": "polynomial", "features": "T", "parameters": {}, "bytes": 8, "operations": 2,
    "fold_errors": [[1.0, 2.0]], "fold_rows": [[5, 5]], "fold_means": [[0.1, 0.2]],
}  # fmt: skip


def checked(home: object, drawn: dict[str, Any] | None = None, **attributes: Any) -> None:
    optuna.logging.disable_default_handler()
    study = optuna.create_study()
    told = {key: value for key, value in {**SOUND, **attributes}.items() if value is not ...}
    trial = create_trial(state=TrialState.COMPLETE, value=1.0, user_attrs=told)
    trial.number = 0
    for name, value in (drawn or {}).items():
        setattr(trial, f"_{name}", value)
    study.get_trials = lambda deepcopy=True: [trial]
    check_trials(study, plan(home))


@pytest.mark.parametrize("attributes", [{}, {"fold_means": [[]]}, {"fold_means": ...}, {"features": ""}])
def test_what_a_sweep_writes_is_taken(tmp_path, attributes):
    checked(tmp_path, **attributes)


@pytest.mark.parametrize(
    "attributes",
    [
        {"fold_means": [0.1]},
        {"fold_means": [["a", "b"]]},
        {"fold_means": [[0.1]]},
        {"fold_means": []},
        {"fold_rows": [[5, 0]]},
        {"fold_errors": [[float("nan"), 1.0]]},
        {"features": None},
        {"model": 5},
        {"reference": 7},
        {"bytes": ...},
        {"parameters": ...},
    ],
)
def test_what_it_does_not_write_is_told(tmp_path, attributes):
    with pytest.raises(InputError, match="trial 0 is damaged"):
        checked(tmp_path, **attributes)


@pytest.mark.parametrize(
    "drawn",
    [{"values": ["low"]}, {"values": [float("inf")]}, {"params": {3: 1.0}}, {"params": {"ridge": []}}],
)
def test_what_it_does_not_draw_is_told(tmp_path, drawn):
    with pytest.raises(InputError, match="trial 0 is damaged"):
        checked(tmp_path, drawn)
