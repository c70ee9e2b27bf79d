"""The configurations that ship are ones that the commands take."""

from __future__ import annotations

from pathlib import Path

import pytest

from fogml.cli.model_commands import SweepSettings, TrainSettings
from fogml.cli.sweep_job import plan_of
from fogml.features.parse import parse_features
from fogml.models.names import make_model
from fogml.validation.limits import check_limits
from fogml.yaml_text import read_yaml

CONFIGS = sorted((Path(__file__).parents[2] / "configs" / "models").glob("*.yaml"))


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_model_configuration(path: Path) -> None:
    settings = TrainSettings.model_validate(read_yaml(path))
    make_model(settings.model, settings.features)
    check_limits(settings.limits)
    if settings.features is not None:
        assert parse_features(settings.features).names()


SWEEPS = sorted((Path(__file__).parents[2] / "configs" / "sweeps").glob("*.yaml"))


@pytest.mark.parametrize("path", SWEEPS, ids=lambda path: path.stem)
def test_sweep_configuration(path: Path) -> None:
    settings = SweepSettings.model_validate(read_yaml(path))
    plan_of(settings, []).check()
