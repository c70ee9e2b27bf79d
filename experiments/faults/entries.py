"""The cheap entry points alone, as a command beside the others: within the same net, without a job behind."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from fogml.cli.given import argument, option
from fogml.cli.settings import Settings

NAME = "only"
COMMAND = {NAME: ("experiments.faults.entries:COMMANDS", "An entry point without a job.")}


class ReadSettings(Settings):
    """Read a run."""

    job: ClassVar[str] = "experiments.faults.entries:read"
    path: Annotated[str, argument("RUN", "The run.")]
    repair: Annotated[bool, option("Repair it.", "--repair")] = False
    axis: Annotated[str | None, option("The axis of several.", "--axis")] = None


class LoadSettings(Settings):
    """Load a model."""

    job: ClassVar[str] = "experiments.faults.entries:load"
    folder: Annotated[str, argument("DIR", "The model's folder.")]


class FeaturesSettings(Settings):
    """Read a feature text."""

    job: ClassVar[str] = "experiments.faults.entries:features"
    text: Annotated[str, argument("TEXT", "The text.")]


COMMANDS = {"read": ReadSettings, "load": LoadSettings, "features": FeaturesSettings}


def read(settings: ReadSettings, _: Any) -> None:
    """Read a run."""
    from fogml.cli.runs import open_run

    open_run(settings.path, repair=settings.repair, axis=settings.axis)


def load(settings: LoadSettings, _: Any) -> None:
    """Load a model."""
    from fogml.models.saved import load_model

    load_model(settings.folder)


def features(settings: FeaturesSettings, _: Any) -> None:
    """Read a feature text."""
    from fogml.features.parse import parse_features

    parse_features(settings.text)
