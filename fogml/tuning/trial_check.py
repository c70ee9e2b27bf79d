"""Whether the trials in a study's storage are as a sweep writes them: it may come from anywhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, FiniteFloat, ValidationError, model_validator

from fogml.errors import InputError
from fogml.tuning.plan import Plan
from fogml.tuning.storage import shown

if TYPE_CHECKING:
    import optuna
    from optuna.trial import FrozenTrial


class _Worker(BaseModel):
    model_config = ConfigDict(strict=True)
    host: str
    pid: int = 0
    started: str


class _Attributes(BaseModel):
    """What is told of a trial, where it is told."""

    model_config = ConfigDict(strict=True, protected_namespaces=())
    model: str = ""
    features: str | None = None
    parameters: dict[str, Any] = {}
    fold_errors: list[list[FiniteFloat]] = []
    fold_rows: list[list[FiniteFloat]] = []
    fold_means: list[list[FiniteFloat]] | None = None
    bytes: FiniteFloat | None = None
    operations: FiniteFloat | None = None
    reason: str = ""
    place: int = 0
    worker: _Worker | None = None
    reference: str | None = None

    @model_validator(mode="after")
    def _of_one_length(self) -> _Attributes:
        if [len(fold) for fold in self.fold_errors] != [len(fold) for fold in self.fold_rows]:
            raise ValueError("each fold needs as many errors as numbers of rows")
        lengths = [(len(errors), 0) for errors in self.fold_errors]
        if self.fold_means is not None and (
            len(self.fold_means) != len(lengths)
            or any(len(means) not in kinds for means, kinds in zip(self.fold_means, lengths))
        ):
            raise ValueError("each fold needs as many means as errors, or none")
        if any(rows <= 0.0 for fold in self.fold_rows for rows in fold):
            raise ValueError("numbers of rows are positive")
        return self


class _Drawn(BaseModel):
    """What was drawn and found."""

    model_config = ConfigDict(strict=True)
    params: dict[str, FiniteFloat | int | str | bool | None]
    values: list[FiniteFloat] | None


def check_trials(study: optuna.Study, plan: Plan) -> None:
    """Check every trial that is there.

    Raises
    ------
    InputError
        Naming the first trial that is not as a sweep writes it.
    """
    for trial in study.get_trials(deepcopy=False):
        fault = _fault(trial, len(plan.objectives))
        if fault:
            raise InputError(
                f"study '{plan.name}' in {shown(plan.storage)}: trial {trial.number} is damaged ({fault}); "
                "move the study away, or choose another --out or --name"
            )


def _fault(trial: FrozenTrial, objectives: int) -> str:
    try:
        told = _Attributes.model_validate(trial.user_attrs)
        drawn = _Drawn.model_validate({"params": trial.params, "values": trial.values})
    except ValidationError as error:
        first = error.errors()[0]
        return f"{'.'.join(str(part) for part in first['loc'][:2])}: {first['msg']}".lstrip(": ")
    if trial.state.name != "COMPLETE":
        return ""
    if not told.model_fields_set >= {"model", "parameters"} or told.features is None:
        return "it names no model, features and parameters"
    if len(drawn.values or ()) != objectives:
        return f"{objectives} values were expected"
    if not (told.fold_errors and all(told.fold_errors)) or told.bytes is None or told.operations is None:
        return "it holds no figures"
    return ""
