"""What a sweep is to do, as every worker is told, and what it may choose among."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Literal

from pydantic import FiniteFloat, field_validator, model_validator

from fogml.errors import InputError
from fogml.numerals import ascii_number
from fogml.strict import Strict

if TYPE_CHECKING:
    import optuna

    from fogml.models.weighing import Weighed
    from fogml.runs.run import Run

BUILDER, WINDOW = "{builder}", "{window}"
"""Where a feature text takes the builder and the window [s] that a trial chose."""
Scalar = bool | int | float | str


class Range(Strict):
    """Numbers from `low` to `high`, both included; whole ones if both are whole; evenly in the logarithm
    where `log` is set."""

    low: int | FiniteFloat
    high: int | FiniteFloat
    log: bool = False

    @model_validator(mode="after")
    def _in_order(self) -> Range:
        if not self.low < self.high:
            raise ValueError(f"low {self.low:g} must be below high {self.high:g}")
        if self.log and not self.low > 0:
            raise ValueError(f"low {self.low:g} must be positive where log is set")
        return self

    def suggest(self, trial: optuna.Trial, name: str) -> float:
        """The trial's value."""
        if isinstance(self.low, int) and isinstance(self.high, int):
            return trial.suggest_int(name, self.low, self.high, log=self.log)
        return trial.suggest_float(name, float(self.low), float(self.high), log=self.log)


Values = Range | list[Scalar] | Scalar
"""A range, a list to choose from, or one value."""


@dataclass(frozen=True)
class Choice:
    """What a trial chose: a model's name, its feature text and its parameters; features may be empty.

    ``made`` is what `auto` made of the training runs, where that is the model.
    """

    model: str
    features: str
    parameters: dict[str, Any]
    made: Weighed | None = None


class Space(Strict):
    """What a sweep may choose among.

    Attributes
    ----------
    features
        Parts by name, each with the texts to choose from; what is chosen of each is joined by commas.
        An empty text leaves the part out. ``{builder}`` and ``{window}`` in a text stand for the
        trial's builder and window.
    builder
        Builders to choose from: block, slope, exp.
    window
        Windows to choose from [s].
    models
        Names of models, each with its parameters to choose.
    """

    features: dict[str, list[str]]
    builder: list[str] = ["block"]
    window: Range | list[FiniteFloat] | FiniteFloat = 64.0
    models: dict[str, dict[str, Values]]

    @field_validator(
        "features", mode="before", json_schema_input_type=str | list[str] | dict[str, str | list[str]]
    )
    @classmethod
    def _one_text(cls, value: object) -> object:
        """A text or a list of texts is one part."""
        if isinstance(value, str | list):
            value = {"features": value}
        if isinstance(value, dict):
            return {key: [part] if isinstance(part, str) else part for key, part in value.items()}
        return value

    @field_validator(
        "models", mode="before", json_schema_input_type=str | list[str] | dict[str, dict[str, Values] | None]
    )
    @classmethod
    def _names_alone(cls, value: object) -> object:
        if isinstance(value, str):
            value = [value]
        if isinstance(value, list):
            return {str(name): {} for name in value}
        if isinstance(value, dict):
            return {name: parameters or {} for name, parameters in value.items()}
        return value

    @model_validator(mode="after")
    def _something(self) -> Space:
        if not self.features or not all(self.features.values()):
            raise ValueError("'features' needs at least one text in each part")
        if not self.models:
            raise ValueError("'models' needs at least one model")
        if any(values == [] for part in self.models.values() for values in part.values()):
            raise ValueError("'models' needs at least one value for each parameter")
        if not self.builder:
            raise ValueError("'builder' needs at least one of block, slope, exp")
        texts = "".join(text for part in self.features.values() for text in part)
        for key, place in (("builder", BUILDER), ("window", WINDOW)):
            if place not in texts and getattr(self, key) != type(self).model_fields[key].default:
                raise ValueError(f"'{key}' would change nothing; write {place} in 'features' where it goes")
        return self

    def suggest(self, trial: optuna.Trial) -> Choice:
        """The trial's choice; only what matters to it is asked of the sampler."""
        model = _of(trial, "model", list(self.models))
        texts = [_of(trial, f"features.{part}", texts) for part, texts in self.features.items()]
        text = ", ".join(part for part in texts if part)
        if BUILDER in text:
            text = text.replace(BUILDER, _of(trial, "builder", self.builder))
        if WINDOW in text:
            text = text.replace(WINDOW, window_text(_value(trial, "window", self.window)))
        parameters = {
            name: _value(trial, f"{model}.{name}", values) for name, values in self.models[model].items()
        }
        return Choice(model, text, parameters) if text and model != "mean" else Choice("mean", "", {})

    def extreme_texts(self) -> Iterator[str]:
        """Every feature text of the space, windows at their longest."""
        longest = window_text(_greatest(self.window))
        for parts in product(*self.features.values()):
            text = ", ".join(part for part in parts if part).replace(WINDOW, longest)
            for builder in self.builder if BUILDER in text else self.builder[:1]:
                if text:
                    yield text.replace(BUILDER, builder)

    def check(self) -> None:
        """Check models, their parameters and features before any run is read."""
        from fogml.features.parse import parse_features
        from fogml.models.names import PRESETS, make_model

        for text in self.extreme_texts():
            parse_features(text)
        for name, parameters in self.models.items():
            if name in ("auto", "none", "joint", "joint-patent", *PRESETS):
                raise InputError(
                    f"space: model '{name}' leaves nothing to choose; sweep polynomial, rbf, rbf-patent "
                    "or a scikit-learn regressor by its dotted name"
                )
            features = None if name == "mean" else "T"
            make_model(name, features, 0, {key: _ends(values)[0] for key, values in parameters.items()})
            for key, values in parameters.items():
                for value in _ends(values):
                    make_model(name, features, 0, {key: value})

    def fingerprint(self) -> str:
        """SHA-256 of what the space offers."""
        text = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def window_text(seconds: float) -> str:
    """A window's length to three significant digits, as feature text takes it."""
    return f"{float(ascii_number(seconds)):g}"


def _of(trial: optuna.Trial, name: str, choices: list[str]) -> str:
    return choices[0] if len(choices) == 1 else str(trial.suggest_categorical(name, choices))


def _value(trial: optuna.Trial, name: str, values: Any) -> Any:
    if isinstance(values, Range):
        return values.suggest(trial, name)
    if isinstance(values, list):
        return values[0] if len(values) == 1 else trial.suggest_categorical(name, values)
    return values


def _greatest(values: Range | list[float] | float) -> float:
    if isinstance(values, Range):
        return float(values.high)
    return float(max(values)) if isinstance(values, list) else float(values)


def _ends(values: Any) -> list[Any]:
    """Every value of a list, both ends of a range, or the one value."""
    if isinstance(values, Range):
        return [values.low, values.high]
    return values if isinstance(values, list) else [values]


OBJECTIVES = {"rms": "deg/h", "bias_stability": "deg/h", "bytes": "byte", "operations": "per sample"}
"""What can be minimised, and its unit: error on held-out parts, the same about each held-out run's mean, size
of the weights, arithmetic."""


@dataclass(frozen=True)
class Plan:
    """A sweep.

    Attributes
    ----------
    name
        Name of the study in its storage.
    read
        Gives the training runs; every worker reads them for itself.
    space
        What to choose from.
    objectives
        Names out of `OBJECTIVES`, ``rms`` or ``bias_stability`` among them.
    folds, fold_count
        As in `fogml.tuning.held_out.HeldOut`.
    trials
        Trials to finish, whole or pruned.
    sampler
        ``tpe`` or ``random``.
    prune
        Whether a trial ends once a finished one that is no larger beats it.
    seed
        Seed of the sampler and of the networks.
    storage
        URL of a database; None for a journal in `folder`.
    folder
        Where results go.
    references
        Choices tried first, by name; None for those of `fogml.tuning.winner.reference_choices`.
    heartbeat_s
        A trial whose worker has not been heard of for three times this long is tried again [s].
    """

    name: str
    read: Callable[[], Sequence[Run]]
    space: Space
    objectives: tuple[str, ...] = ("rms",)
    folds: Literal["auto", "time", "runs"] = "auto"
    fold_count: int = 5
    trials: int = 50
    sampler: str = "tpe"
    prune: bool = True
    seed: int = 0
    storage: str | None = None
    folder: str = "sweep-results"
    references: Mapping[str, Choice] | None = None
    heartbeat_s: float = 10.0

    def check(self) -> None:
        """Check what can be checked before a run is read."""
        from fogml.tuning.held_out import FOLD_COUNTS

        if self.trials < 1:
            raise InputError(f"trials {self.trials}: at least 1 is needed")
        if not self.heartbeat_s > 0.0:
            raise InputError(f"heartbeat {self.heartbeat_s:g} s: a positive number of seconds is needed")
        if self.fold_count not in FOLD_COUNTS:
            known = ", ".join(map(str, FOLD_COUNTS))
            raise InputError(f"{self.fold_count} folds: one of {known} was expected")
        if self.sampler not in ("tpe", "random"):
            raise InputError(f"sampler '{self.sampler}': tpe or random was expected")
        unknown = [name for name in self.objectives if name not in OBJECTIVES]
        if unknown or len(set(self.objectives)) < len(self.objectives):
            raise InputError(
                f"objectives {', '.join(self.objectives)}: each once of {', '.join(OBJECTIVES)} was expected"
            )
        if not {"rms", "bias_stability"} & set(self.objectives):
            raise InputError(
                "objectives: rms is missing, or bias_stability in its place; "
                "a model's error is always among them"
            )
        self.space.check()

    def identity(self, runs: Sequence[Run]) -> dict[str, Any]:
        """What has to be the same for trials to belong to one study."""
        return {
            "search space": self.space.fingerprint(),
            "objectives": list(self.objectives),
            "folds": [self.folds, self.fold_count],
            "seed": self.seed,
            "sampler": self.sampler,
            "pruning": self.prune,
            "training runs": [run_identity(run) for run in runs],
        }


def run_identity(run: Run) -> list[Any]:
    """What has to be the same for a run to be the same: its columns, and its set-up facts."""
    return [run.hash, run.facts.as_dict()]
