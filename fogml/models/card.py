"""What a fitted model states of its training: unit, axis, runs, box, and the version that made it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Annotated, Any, Literal
from zlib import crc32

import numpy as np
from pydantic import Field, with_config

import fogml
from fogml.errors import InputError
from fogml.features.features import Features
from fogml.features.slices import SavedSlices
from fogml.models.box import slices_of
from fogml.runs.exchange import runs_of
from fogml.runs.run import Run
from fogml.runs.thermometers import SavedLimits, saved_limits, trained_limits
from fogml.signals import large
from fogml.strict import CONTENT


@with_config(CONTENT)
@dataclass(frozen=True)
class TrainingRun:
    """A training run by name and by the SHA-256 of its columns."""

    name: str
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


@with_config(CONTENT)
@dataclass(frozen=True)
class TrainingCard:
    """Where a model comes from, as saved models hold it.

    Attributes
    ----------
    unit, axis
        Serial number and axis of the training runs; None where they state none.
    gyro_unit
        Unit in which the output was recorded, ``deg/h`` or ``count``.
    runs
        The training runs, by name.
    fogml_version
        Version that fitted the model.
    sample_s
        Shortest of the training runs' median sample intervals [s].
    earth_known
        Whether Earth rate was known, and so is no part of the drift.
    rows
        Training rows used.
    box
        Atom of the features to its [low, high] in the training rows, in the atom's unit.
    slices
        Trained ranges at each temperature.
    thermometer
        Limits of what a thermometer can show; None for those of any thermometer.
    notes
        What a user of the model should know.
    """

    unit: str | None
    axis: str | None
    gyro_unit: Literal["deg/h", "count"]
    runs: tuple[TrainingRun, ...]
    fogml_version: str
    sample_s: Annotated[float, Field(gt=0.0)]
    earth_known: bool
    rows: Annotated[int, Field(ge=0)]
    box: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    slices: SavedSlices | None = None
    thermometer: SavedLimits | None = None

    def __post_init__(self) -> None:
        # What features show of their box is a view, which no file holds.
        object.__setattr__(self, "box", dict(self.box))


def training_card(
    runs: Sequence[Run],
    *,
    hashes: Callable[[], list[str]],
    rows: int,
    features: Features | None = None,
    notes: Sequence[str] = (),
) -> TrainingCard:
    """The card of a model fitted to `runs`, which `checked_runs` has passed.

    Parameters
    ----------
    runs
        The training runs.
    hashes
        What `hash_ahead` gave for them.
    rows
        Training rows used.
    features
        Features whose box is learned; None of a model without. Here they learn what thermometers show.
    notes
        What a user of the model should know.
    """
    if features is not None:
        features.thermometer = trained_limits(runs, features.sensors)
    recorded = [TrainingRun(run.name, digest) for run, digest in zip(runs, hashes(), strict=True)]
    return TrainingCard(
        unit=_common(run.facts.unit for run in runs),
        axis=_common(run.facts.axis for run in runs),
        gyro_unit=runs[0].gyro_unit,
        runs=tuple(sorted(recorded, key=attrgetter("name", "sha256"))),
        fogml_version=fogml.__version__,
        sample_s=min(run.sample_s for run in runs),
        earth_known=runs[0].earth_known,
        rows=rows,
        box=features.box if features is not None else {},
        notes=tuple(notes),
        slices=slices_of(features) if features is not None else None,
        thermometer=saved_limits(features.thermometer) if features is not None else None,
    )


def hash_ahead(runs: Sequence[Run]) -> Callable[[], list[str]]:
    """Begin to hash runs beside other work; what is returned waits for the hashes.

    SHA-256 leaves the interpreter free, so it costs a fit next to nothing.
    """
    pool = ThreadPoolExecutor(max_workers=min(4, len(runs)))
    pending = [pool.submit(attrgetter("hash"), run) for run in runs]
    pool.shutdown(wait=False)
    return lambda: [hash_of.result() for hash_of in pending]


def refuse_targets(y: object) -> None:
    """Hold that nothing is given beside runs to learn or to be compared with, as scikit-learn's `y`."""
    if y is not None:
        raise InputError("y: the output that a drift model learns is the runs' own; give runs alone")


def checked_runs(runs: Run | Sequence[Run], y: object = None) -> tuple[Run, ...]:
    """Training runs as a tuple, of one unit and axis, and either all or none with known Earth rate.

    They come in an order by what they hold, so that the order in which they are given decides no model.

    Raises
    ------
    InputError
        If there is none, one is empty or there twice, or they don't belong together, or beside them a `y` is
        given.
    """
    refuse_targets(y)
    group = runs_of(runs)
    if not group:
        raise InputError("no training run is given; name at least one")
    for run in group:
        if len(run) == 0:
            raise InputError(f"{run.name}: holds no samples; leave it out of training")
    for place, run in enumerate(group):
        for other in group[:place]:  # left out, it would be judged by itself
            if np.array_equal(run.gyro, other.gyro) and np.ptp(run.gyro) > 0.0:
                raise InputError(f"{run.name}: the same samples as {other.name}; give each run once")
    for fact in ("unit", "axis"):
        stated = {getattr(run.facts, fact): run.name for run in group if getattr(run.facts, fact) is not None}
        if len(stated) > 1:
            listed = ", ".join(f"{value} ({name})" for value, name in stated.items())
            raise InputError(
                f"training runs are of more than one {fact}: {listed}; train one model for each {fact}"
            )
    known = [run for run in group if run.earth_known]
    if known and len(known) < len(group):
        without = next(run for run in group if not run.earth_known)
        raise InputError(
            f"{without.name}: latitude and input_axis are not stated, but they are for {known[0].name}; "
            "state them for every training run or for none, or Earth rate is drift in some and not in others"
        )
    return tuple(sorted(group, key=_content))


def _content(run: Run) -> tuple[int, int]:
    """What orders runs: number of samples, and a checksum of the output."""
    checksum = 0
    for part in large.pieces(run.gyro):
        checksum = crc32(np.ascontiguousarray(run.gyro[part]).data, checksum)
    return len(run), checksum


def check_unit_and_axis(card: TrainingCard, run: Run, any_unit: bool) -> tuple[str, ...]:
    """Whether a model may be used on a run: notes to show, or an error.

    Raises
    ------
    InputError
        If the run is of another unit or axis and `any_unit` is not set.
    """
    notes = []
    for fact in ("unit", "axis"):
        trained, found = getattr(card, fact), getattr(run.facts, fact)
        if trained is None or found is None:
            if trained != found:
                silent = "the model" if trained is None else run.name
                notes.append(f"{silent} states no {fact}: whether model and run belong together is not known")
        elif trained != found:
            difference = f"{run.name}: {fact} '{found}', but the model was trained on {fact} '{trained}'"
            if not any_unit:
                raise InputError(
                    f"{difference}; use a model of this {fact}, or apply it nevertheless (--any-unit, where "
                    "the command takes that)"
                )
            notes.append(f"{difference}: applied because any unit was allowed")
    if run.earth_known and not card.earth_known:
        notes.append(
            f"{run.name}: Earth rate is known here, but was not in training: "
            "the model's drift holds the Earth rate of the training attitude"
        )
    return tuple(notes)


def _common(values: Any) -> str | None:
    return next((value for value in values if value is not None), None)
