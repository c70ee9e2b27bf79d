"""One unit's job in a fleet: train, compare, diagnose or acceptance, and what the fleet wants of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.fleet.manifest import Unit

if TYPE_CHECKING:
    from fogml.models.base import DriftModel
    from fogml.runs.run import Run
    from fogml.validation.results import Judgement


@dataclass(frozen=True)
class UnitWork:
    """Does a unit's job as the command of that name would, and prints nothing.

    Attributes
    ----------
    settings
        Settings that all units share, by the names of those commands.
    form
        Form of the constants that units are compared in.
    shared
        ``shared`` of an earlier fleet's ``fleet.json``: constants are drawn to that fleet's.
    """

    settings: Mapping[str, Any]
    form: str
    shared: Mapping[str, Any] | None = None

    def __call__(self, unit: Unit, folder: Path) -> Mapping[str, Any]:
        """Do the job, and give what the fleet wants of it."""
        from fogml.runs.three_axes import SeveralAxes

        try:
            return getattr(self, f"_{unit.job}")(unit, folder)
        except SeveralAxes:
            if not unit.axis or "axis" in self.settings:
                raise
            # Files of three gyros: the manifest tells which of them is the unit's.
            return replace(self, settings={**self.settings, "axis": unit.axis})(unit, folder)

    def _train(self, unit: Unit, folder: Path) -> dict[str, Any]:
        from fogml.cli.train_job import (
            TrainSettings,
            check_settings,
            fit_and_judge,
            split_runs,
            write_results,
        )
        from fogml.outputs import whole_folder

        terminal = Terminal(quiet=True)
        settings = self._for(TrainSettings, unit, folder, runs=list(unit.train), test=list(unit.test))
        check_settings(settings)
        with whole_folder(folder) as staging:
            train_runs, test_runs = split_runs(settings, terminal)
            check_belong(unit, (*train_runs, *test_runs))
            drawn = self._drawn(unit)
            model, judgement = fit_and_judge(settings, train_runs, test_runs, terminal, drawn)
            # A model drawn to another fleet's is none that 'fogml train' makes.
            write_results(staging, settings, model, judgement, terminal, again=drawn is None)
        return {
            **_told(judgement),
            "constants": self._constants(unit, train_runs),
            "parameters": model.parameter_count(),
        }

    def _compare(self, unit: Unit, folder: Path) -> dict[str, Any]:
        import json

        from fogml.cli.compare_job import CompareSettings, compare_and_write

        settings = self._for(CompareSettings, unit, folder, runs=list(unit.train), test=list(unit.test))
        met = compare_and_write(settings, Terminal(quiet=True), partial(check_belong, unit))
        models = json.loads((folder / "compare.json").read_text(encoding="utf-8"))["models"]
        worst = {
            name: max(body["test"], key=lambda run: run["after"]["rms"]) for name, body in models.items()
        }
        # What is told is the automatic choice where it is there: the best by the test would be chosen by it.
        name = "auto" if "auto" in worst else min(worst, key=lambda key: worst[key]["after"]["rms"])
        run = worst[name]
        return {
            "model": name,
            "met": met,
            "worst": {key: run[key] for key in ("run", "averaging_s")}
            | {key: run[key]["rms"] for key in ("before", "after")}
            | {key: run[key] for key in ("floor", "outside_training")},
            "notes": models[name]["notes"],
        }

    def _diagnose(self, unit: Unit, folder: Path) -> dict[str, Any]:
        from fogml.cli.diagnose_job import DiagnoseSettings, Diagnosis, diagnose_and_write
        from fogml.fleet.diagnosis import unit_diagnosis

        settings = self._for(DiagnoseSettings, unit, folder, runs=list(unit.train), held_out=list(unit.test))
        found = diagnose_and_write(settings, Terminal(quiet=True), partial(check_belong, unit))
        assert isinstance(found, Diagnosis)
        far = [item for item in found.how_far if item.after is not None]
        worst = max(far, key=lambda item: item.after) if far else None
        return {
            "verdict": found.verdict,
            "effects": [item.effect for item in found.named],
            "diagnosis": unit_diagnosis(found, unit.covariates),
            "worst": worst and _worst(worst, worst.before, worst.after, None),
        }

    def _acceptance(self, unit: Unit, folder: Path) -> dict[str, Any]:
        """The report of the test runs, before and after a model of the training runs, if there are any."""
        from fogml.cli.lab import AcceptanceSettings
        from fogml.cli.lab_jobs import write_report
        from fogml.cli.runs import open_runs
        from fogml.lab.acceptance import ACCEPTED, NO_LIMITS
        from fogml.models.names import make_model

        terminal = Terminal(quiet=True)
        # Of the fleet's settings these two names mean others: limits of judgements, a model's name.
        own = {"limits": self.settings.get("acceptance_limits"), "model": None}
        settings = self._for(AcceptanceSettings, unit, folder, runs=list(unit.test), **own)

        def model_of() -> DriftModel | None:
            if not unit.train:
                return None
            chosen = [self.settings[key] for key in ("model", "features", "seed", "parameters")]
            unfitted = self._drawn(unit) or make_model(*chosen)
            trained = open_runs(list(unit.train), terminal, repair=settings.repair, axis=settings.axis)
            check_belong(unit, trained)
            return unfitted.fit(trained)

        values = write_report(settings, terminal, model_of, partial(check_belong, unit))
        return {
            "model": ("shared" if self.shared else str(self.settings["model"])) if unit.train else "",
            "met": values["verdict"] in (ACCEPTED, NO_LIMITS),
            "verdict": values["verdict"],
            "reasons": values["reasons"],
            "notes": values["notes"],
        }

    def _drawn(self, unit: Unit) -> DriftModel | None:
        """The unit's model, not yet fitted, drawn to an earlier fleet's; None where there is none."""
        if self.shared is None:
            return None
        from fogml.fleet.shared import shared_model

        return shared_model(self.shared, unit.covariates)

    def _for(self, kind: Any, unit: Unit, folder: Path, **own: Any) -> Any:
        """Settings of a command: those that it knows of the fleet's, and the unit's own."""
        known = {key: value for key, value in self.settings.items() if key in kind.model_fields}
        return kind.model_validate({**known, **own, "out": str(folder)})

    def _constants(self, unit: Unit, runs: Sequence[Run]) -> dict[str, Any] | None:
        from fogml.fleet.constants import UnitConstants
        from fogml.runs.checks import refuse_dead

        try:
            refuse_dead(runs)
            return UnitConstants.of(runs, self.form, unit.covariates).as_dict()
        except InputError:
            return None


def check_belong(unit: Unit, runs: Sequence[Run]) -> None:
    """Check that runs are of the unit and axis that the manifest names."""
    for run in runs:
        for what, stated, wanted in (
            ("unit", run.facts.unit, unit.name),
            ("axis", run.facts.axis, unit.axis),
        ):
            if stated and wanted and str(stated) != wanted:
                raise InputError(f"{run.name}: is of {what} '{stated}', the manifest names '{wanted}'")


def _told(judgement: Judgement) -> dict[str, Any]:
    from fogml.validation.advice import advice_on, output_reasons

    worst = max(judgement.test, key=lambda run: run.after.rms)
    doubts = [f"{one.brief}: {one.sentence.partition(': ')[2]}" for one in output_reasons(judgement)]
    return {
        "model": str(judgement.model["kind"]),
        "met": judgement.met,
        "verdict": advice_on(judgement).grade,
        "worst": _worst(worst, worst.before.rms, worst.after.rms, worst.outside_training),
        "notes": [str(note) for note in (*doubts, *judgement.notes, *judgement.model.get("notes", ()))],
    }


def _worst(run: Any, before: float, after: float, outside: float | None) -> dict[str, Any]:
    told = {"run": run.run, "averaging_s": run.averaging_s, "before": before, "after": after}
    return {**told, "floor": run.floor, "outside_training": outside}
