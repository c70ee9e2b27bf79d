"""From a found cause to a compensated gyro: the drift model that a diagnosis makes, and what it brings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import Field

from fogml.errors import InputError
from fogml.gap.result import Diagnosis
from fogml.gap.result_parts import Brought, Compensable, Compensation
from fogml.json_files import json_object, read_json
from fogml.runs.run import Run
from fogml.strict import Strict, strictly

if TYPE_CHECKING:
    from fogml.cli.model_commands import TrainSettings
    from fogml.models.base import DriftModel
    from fogml.models.causes import CauseModel

GAP_FILE = "gap.json"
_REMEDY = "name the folder that 'fogml diagnose' wrote"


class _Cause(Strict):
    effect: str
    counted: bool
    features: list[str]
    reason: str


class _Written(Strict):
    """What a drift model needs of ``compensation`` in ``gap.json``."""

    constants: list[str] = Field(min_length=1)
    causes: list[_Cause]


def read_compensation(folder: str | Path) -> Compensation:
    """What a diagnosis wrote of what can be compensated.

    Raises
    ------
    InputError
        If the folder holds no diagnosis, or one without it.
    """
    path = Path(folder)
    path = path if path.name == GAP_FILE else path / GAP_FILE
    if (path.parent / "units.json").is_file() and not path.is_file():
        raise InputError(f"{folder}: a diagnosis of several units; name the folder of one of them")
    values = json_object(read_json(path, _REMEDY), str(path), "fogml.gap/1", _REMEDY)
    held = values.get("compensation")
    if not isinstance(held, dict):
        raise InputError(f"{path}: it says nothing of what can be compensated; diagnose again")
    try:
        told = strictly(_Written, {key: held.get(key) for key in ("constants", "causes")})
    except InputError as error:
        raise InputError(f"{path}: key 'compensation': {error}; diagnose again") from None
    causes = (Compensable(c.effect, c.counted, tuple(c.features), c.reason) for c in told.causes)
    return Compensation(tuple(told.constants), tuple(causes))


def cause_model(told: Compensation, asked: Sequence[str] = ()) -> CauseModel:
    """The unfitted drift model of the constants and of the causes that count, or of those asked for.

    Raises
    ------
    InputError
        If one asked for is no candidate of the diagnosis, or can't be compensated.
    """
    from fogml.models.causes import CauseModel

    by_id = {c.effect: c for c in told.causes}
    for id in asked:
        if id not in by_id:
            raise InputError(f"--cause {id}: no candidate of that diagnosis; those are {', '.join(by_id)}")
        if not by_id[id].features:
            raise InputError(f"--cause {id}: can't be compensated: {by_id[id].reason}")
    causes = [by_id[id] for id in asked] if asked else told.counted
    return CauseModel(", ".join(told.constants), {c.effect: ", ".join(c.features) for c in causes})


def unfitted_model(settings: TrainSettings) -> DriftModel:
    """The model that settings ask for: by its name, or as a diagnosis makes it.

    Raises
    ------
    InputError
        If the name, features or parameters are not known, or go with no diagnosis.
    """
    if settings.from_diagnosis is None:
        if settings.causes:
            raise InputError("--cause: of which diagnosis? name its folder with --from-diagnosis")
        from fogml.models.names import make_model

        return make_model(settings.model, settings.features, settings.seed, settings.parameters)
    for key in ("features", "parameters", "train_again"):
        if getattr(settings, key):
            flag = "set" if key == "parameters" else key.replace("_", "-")
            raise InputError(f"--{flag}: the diagnosis makes the model; leave it out, or --from-diagnosis")
    if settings.model != "auto":
        raise InputError(
            f"--model {settings.model}: the diagnosis makes the model, and auto is judged beside it; "
            "leave one of them out"
        )
    return cause_model(read_compensation(settings.from_diagnosis), settings.causes)


def not_compensated(told: Compensation, asked: Sequence[str] = ()) -> list[str]:
    """Sentences on what a model does not take: causes that count and can't be compensated, or none at all."""
    if asked:
        return []
    if not told.counted:
        return ["the diagnosis names no cause that can be compensated: the twin's constants alone are fitted"]
    return [f"{c.effect} is not compensated: {c.reason}" for c in told.causes if c.counted and not c.features]


def with_brought(
    found: Diagnosis, fit: Iterable[Run], held_out: Sequence[Run], noise: Run | None
) -> Diagnosis:
    """The diagnosis with what its drift model, fitted to the fit runs, brings on the held-out ones."""
    from fogml.gap.inference import keep_back

    told = found.compensation
    if told is None:
        return found
    unusable = {name for name, _ in found.unusable}
    fit = [run for run in fit if run.name not in unusable]
    if not held_out:
        fit, held_out = keep_back(fit)
    held_out = [run for run in held_out if run.name not in unusable]
    if not held_out:
        return found
    try:
        brought = _brought(told, fit, held_out, noise)
    except InputError as error:
        return replace(found, compensation=replace(told, note=str(error)))
    return replace(found, compensation=replace(told, held_out=brought))


def _brought(
    told: Compensation, fit: Sequence[Run], held_out: Sequence[Run], noise: Run | None
) -> tuple[Brought, ...]:
    from fogml.models.causes import CauseModel
    from fogml.validation.judge import judge

    with_causes = cause_model(told).fit(fit)
    constants = CauseModel(", ".join(told.constants)).fit(fit) if told.counted else with_causes
    ends = [judge(m, fit, held_out, any_unit=True, noise=noise) for m in (constants, with_causes)]
    return tuple(
        Brought(a.run, a.averaging_s, b.before.rms, a.after.rms, b.after.rms, b.floor)
        for a, b in zip(*(judgement.test for judgement in ends))
    )
