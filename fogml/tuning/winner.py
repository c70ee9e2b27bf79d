"""What a study found: the Pareto set, the winner against what every sweep tries first, and what mattered."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.errors import InputError
from fogml.models.auto import AutoModel
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.tuning.plan import Choice
from fogml.tuning.study import place_of
from fogml.tuning.worker import score_of

if TYPE_CHECKING:
    from optuna.trial import FrozenTrial


DEFAULT, AUTO = "default", "auto"


def reference_choices(runs: Sequence[Run], seed: int = 0) -> dict[str, Choice]:
    """The choices that a sweep's winner is held against, by name.

    Raises
    ------
    InputError
        If the runs don't belong together, lack a temperature, or are too short.
    """
    features = make_model("polynomial", None, seed).get_params()["features"]
    made = AutoModel(seed=seed).fit(runs).weighed_
    return {
        DEFAULT: Choice("polynomial", str(features), {}),
        AUTO: Choice("auto", ", ".join(made.model.feature_names), {}, made),
    }


def complete(trials: Sequence[FrozenTrial]) -> list[FrozenTrial]:
    """The trials that went through every fold, by place."""
    return sorted((t for t in trials if t.state.name == "COMPLETE"), key=lambda t: place_of(t))


def pareto(trials: Sequence[FrozenTrial]) -> list[FrozenTrial]:
    """The trials that no other is at least as good as in every objective and better in one.

    Of trials that are equal in all objectives the first is kept. Sorted by error.
    """
    kept: list[FrozenTrial] = []
    for trial in complete(trials):
        others = [other for other in complete(trials) if place_of(other) != place_of(trial)]
        if not any(_at_least_as_good(other, trial) for other in others):
            kept.append(trial)
    return sorted(kept, key=lambda t: (figure(t, "rms"), place_of(t)))


def _at_least_as_good(other: FrozenTrial, trial: FrozenTrial) -> bool:
    if other.values == trial.values:
        return place_of(other) < place_of(trial)
    return all(a <= b for a, b in zip(other.values, trial.values, strict=True))


def figure(trial: FrozenTrial, name: str) -> float:
    """Held-out rms or bias stability [deg/h], bytes or operations of a complete trial."""
    if name == "rms":
        squares, rows = (np.concatenate(trial.user_attrs[key]) for key in ("fold_errors", "fold_rows"))
        return float(np.sqrt(np.average(squares, weights=rows)))
    if name == "bias_stability":
        return float(np.sqrt(score_of(trial).mean_square))
    return float(trial.user_attrs[name])


def winner(trials: Sequence[FrozenTrial]) -> FrozenTrial:
    """The default, unless trials beat it on the parts held out beyond noise: then the best of these.

    Trials are compared block by block of the same rows, the mean of each run held out apart: the bias
    moves from run to run by more than models differ by. Of several that the folds can't tell from the
    default the best is best by luck, and the smallest leaves out what fresh runs need. Without a default
    among the trials it is the best of all.

    Raises
    ------
    InputError
        If no trial went through every fold.
    """
    found = complete(trials)
    if not found:
        reasons = [t.user_attrs["reason"] for t in trials if "reason" in t.user_attrs]
        why = f": {reasons[0]}" if reasons else ""
        raise InputError(f"no trial could be fitted{why}")
    default = next((t for t in found if t.user_attrs.get("reference") == DEFAULT), None)
    if default is None:
        better = found
    else:
        score = score_of(default)
        better = [t for t in found if score_of(t).beats(score)] or [default]
    return min(better, key=lambda t: (figure(t, "bias_stability"), t.user_attrs["bytes"], place_of(t)))


def against_references(trials: Sequence[FrozenTrial], best: FrozenTrial) -> list[dict[str, Any]]:
    """The winner beside the default polynomial and what `auto` chooses, on the same parts held out.

    Each with its name, its trial's number, held-out bias stability [deg/h], whether the winner is worse, and
    whether that is beyond two standard errors.
    """
    mine, told = score_of(best), []
    for trial in complete(trials):
        name = trial.user_attrs.get("reference")
        if name is None:
            continue
        score = score_of(trial)
        worse = bool(score.mean_square < mine.mean_square)
        told.append(
            {
                "reference": name,
                "number": place_of(trial),
                "bias_stability": figure(trial, "bias_stability"),
                "winner_worse": worse,
                "beyond_noise": worse and score.beats(mine),
            }
        )
    return told


def train_settings(trial: FrozenTrial) -> dict[str, Any]:
    """Model, features and parameters of a trial, as a configuration of ``fogml train`` takes them."""
    attributes = trial.user_attrs
    values: dict[str, Any] = {"model": attributes["model"]}
    if attributes["features"] and attributes["model"] != "auto":
        values["features"] = attributes["features"]
    if attributes["parameters"]:
        values["parameters"] = dict(attributes["parameters"])
    return values


def command_line(
    trial: FrozenTrial, runs: Sequence[str], test: Sequence[str], seed: int, averaging_s: float
) -> str:
    """The command that trains a trial's model on all training runs, for a shell."""
    values = train_settings(trial)
    words = ["fogml", "train", *runs, *(["--test", *test] if test else []), "--model", values["model"]]
    if "features" in values:
        words += ["--features", values["features"]]
    for name, value in values.get("parameters", {}).items():
        words += ["--set", f"{name}={value}"]
    words += ["--averaging", f"{averaging_s:g}", "--seed", str(seed)]
    return shlex.join(words)


def importance(
    trials: Sequence[FrozenTrial], seed: int = 0, *, trees: int = 200, least_trials: int = 10
) -> dict[str, float]:
    """Share of each parameter in what the logarithm of the error varies by, the largest first.

    By a random forest of the complete trials, and how much worse it gets when a parameter's values
    are exchanged among trials (L. Breiman, Machine Learning 45 (2001) 5). Parameters that a trial
    did not need count as a value of their own.

    Parameters
    ----------
    trials
        Of a study; those that are complete count.
    seed
        Of the forest and the exchange.
    trees
        Of the forest.
    least_trials
        Complete trials below which nothing is told.
    """
    found = complete(trials)
    names = sorted({name for trial in found for name in trial.params})
    errors = np.log([max(figure(trial, "rms"), 1e-300) for trial in found])
    if len(found) < least_trials or not names or np.ptp(errors) == 0.0:
        return {}
    from sklearn.ensemble import RandomForestRegressor
    from sklearn.inspection import permutation_importance

    columns = np.column_stack([_numbers([trial.params.get(name) for trial in found]) for name in names])
    forest = RandomForestRegressor(trees, random_state=seed, n_jobs=1).fit(columns, errors)
    worse = permutation_importance(forest, columns, errors, n_repeats=10, random_state=seed, n_jobs=1)
    shares = np.maximum(worse.importances_mean, 0.0)
    if not shares.sum() > 0.0:
        return {}
    shares = shares / shares.sum()
    return {names[i]: float(shares[i]) for i in np.argsort(-shares, kind="stable")}


def _numbers(values: list[Any]) -> Any:
    """Values as numbers: numbers themselves, texts by their place in order; below all where missing."""
    present = [value for value in values if value is not None]
    if all(isinstance(value, int | float) for value in present):
        least = min(present) - 1.0
        return np.array([least if value is None else float(value) for value in values])
    order = {text: place for place, text in enumerate(sorted({str(value) for value in present}))}
    return np.array([-1.0 if value is None else float(order[str(value)]) for value in values])
