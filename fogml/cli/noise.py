"""``fogml noise``: Allan deviation and noise terms of a run."""

from __future__ import annotations

from typing import Annotated, ClassVar

from fogml.cli import options
from fogml.cli.given import argument, option
from fogml.cli.settings import Settings


class NoiseSettings(Settings):
    """Allan deviation and the IEEE 952 noise terms with intervals.

    With --out, writes noise.json, noise.html and noise.config.yaml; with --to the terms for another program
    too: noise.kalibr.yaml, noise_gyroparams.m (MATLAB), or noise.kalman.json (discrete-time Q).
    """

    job: ClassVar[str] = "fogml.cli.noise_job:noise_and_write"
    run: Annotated[
        str | list[str] | None,
        argument(
            "RUN...",
            "A run, best at constant temperature; several share their terms.",
            reads=True,
            known=options.SHIPPED_RUNS,
        ),
    ] = None
    overlapping: Annotated[bool, option("Kind of estimator.", "--overlapping/--not-overlapping")] = True
    to: Annotated[
        str | None,
        option(
            "Write the terms for another program.",
            metavar="kalibr|matlab|kalman",
            known="fogml.export.noise_parameters:TARGETS",
        ),
    ] = None
    axis: options.Axis = None
    repair: options.Repair = False
    out: options.FolderIfNamed = None
