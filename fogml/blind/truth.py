"""What is true of a blind case: the schema ``fogml.blind_truth/1``, its files and their hashes.

``truth/NNNN.json`` holds a `Truth`, ``truth/NNNN.npz`` what each missing effect truly adds to each
run, and ``truth/SHA256SUMS`` the hashes of all of them, in the form that ``sha256sum -c`` takes.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args
from zipfile import BadZipFile

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fogml.arrays import FloatArray
from fogml.errors import InputError, printable
from fogml.json_files import read_bytes, write_json
from fogml.outputs import whole_file
from fogml.signals.noise_model import NoiseModel

SCHEMA = "fogml.blind_truth/1"
Kind = Literal[
    "nothing",
    "one",
    "two",
    "three",
    "unknown_left_out",
    "unknown_invented",
    "unknown_and_known",
    "wrong_thermal",
]
KINDS: tuple[Kind, ...] = get_args(Kind)
STRATA = ((0.0, 4.0), (4.0, 6.0), (6.0, 10.0), (10.0, 20.0), (20.0, math.inf))
"""Bounds of the strata by d'; the wanted figures rest on those from 4."""
RIGHT_FOR_WRONG_THERMAL = "hidden_thermal_node"
"""The effect that is no wrong name where the twin's thermal structure is wrong."""


def stratum(d_prime: float) -> str:
    """The name of the stratum of a d': ``under 4``, ``4-6``, ``6-10``, ``10-20`` or ``over 20``."""
    low, high = next(bounds for bounds in STRATA if d_prime < bounds[1] or math.isinf(bounds[1]))
    if low == 0.0:
        return f"under {high:g}"
    return f"over {low:g}" if math.isinf(high) else f"{low:g}-{high:g}"


STRATUM_NAMES = tuple(stratum(low) for low, _ in STRATA)


FORM_DISTANCES = {"over 0.95": 0.95, "0.9-0.95": 0.9, "0.8-0.9": 0.8, "under 0.8": 0.0}
"""How near the catalogue comes to a true form: lowest cosine of each bin."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, protected_namespaces=())


class Amount(_Part):
    """A number with its unit."""

    value: float
    unit: str


class TrueEffect(_Part):
    """An effect that the reality has and the nominal twin lacks.

    Attributes
    ----------
    id
        Id in the library, whether or not it is left out of the candidates; None for one that no
        library holds.
    name
        The id, or the name of an invented one.
    stage
        Where it acts.
    form
        Which form the reality gives it, e.g. ``Preisach``.
    amplitude
        In the card's unit, where the reality's form has one that compares; else None.
    shape
        Parameters of the reality's form.
    d_prime
        ``||W (I - P) s||`` over all fit runs, of this effect's contribution where nothing else acts.
    cosine
        How near the catalogue's form of it comes: the absolute cosine of its best member with this
        contribution, whitened and beside the nominal constants. None where it was not measured, or no
        library holds the effect.
    """

    id: str | None
    name: str
    stage: str
    form: str = ""
    amplitude: Amount | None = None
    shape: dict[str, float] = Field(default_factory=dict)
    d_prime: float
    cosine: float | None = None

    @property
    def stratum(self) -> str:
        """The stratum of its d'."""
        return stratum(self.d_prime)

    @property
    def form_distance(self) -> str | None:
        """The bin of its cosine, of `FORM_DISTANCES`; None where there is none."""
        if self.cosine is None:
            return None
        return next(name for name, low in FORM_DISTANCES.items() if self.cosine >= low)


class Segment(_Part):
    """A stretch of at least 600 s in which the 100 s averages of the true gap exceed the floor."""

    run: str
    from_s: float
    to_s: float


class TrueClosed(_Part):
    """What the true effects, fitted in the reality's own form, close on a held-out run.

    Rms values in deg/h of averages over `averaging_s`, defined as in ``gap.json``.
    """

    run: str
    averaging_s: float
    recalibrated: float
    after: float
    floor: float
    closed: float | None


class Runs(_Part):
    """Files of a case by base name."""

    fit: tuple[str, ...]
    held_out: tuple[str, ...]
    noise: str | None = None


class Truth(_Part):
    """What is true of one case.

    Attributes
    ----------
    case
        Its number, as in the file names.
    seed
        The suite's; with the case's number it fixes everything that is drawn.
    kind
        What it is drawn as.
    reality
        Which reality it is of.
    runs
        Its files.
    sample_s
        Sample interval [s].
    turning
        Whether the table turns in a run.
    effects
        What is missing from the nominal twin, in no order; empty where nothing is.
    left_out
        Ids that the diagnosis is told not to offer: a withheld effect and its relatives.
    d_prime
        ``||W (I - P) s||`` of all missing effects together; 0 where nothing is missing.
    segments
        Where the true structural gap lies, on the fit runs.
    closed
        On each held-out run.
    noise
        True noise constants by name, with units.
    nominal
        True nominal constants by name, in the units of `fogml.gap`.
    thermal
        A few words on the reality's thermal structure.
    mix
        Whether it was drawn from the whole mix: all kinds, every stratum.
    """

    schema_: Literal["fogml.blind_truth/1"] = Field(default="fogml.blind_truth/1", alias="schema")
    case: str = Field(pattern=r"^[0-9]+$")
    seed: int
    kind: Kind
    reality: str = "first"
    runs: Runs
    sample_s: float
    turning: bool
    effects: tuple[TrueEffect, ...] = ()
    left_out: tuple[str, ...] = ()
    d_prime: float = 0.0
    segments: tuple[Segment, ...] = ()
    closed: tuple[TrueClosed, ...] = ()
    noise: dict[str, Amount] = Field(default_factory=dict)
    nominal: dict[str, float] = Field(default_factory=dict)
    thermal: str = ""
    mix: bool = True

    @property
    def noise_model(self) -> NoiseModel:
        """The true noise."""
        value = {name: amount.value for name, amount in self.noise.items()}
        return NoiseModel(value["N"], value.get("B", 0.0), value.get("K", 0.0))

    @property
    def known(self) -> tuple[TrueEffect, ...]:
        """The missing effects that the diagnosis may name."""
        return tuple(e for e in self.effects if e.id is not None and e.id not in self.left_out)

    @property
    def right_names(self) -> frozenset[str]:
        """Ids of which one in a named class makes the name right, relatives of what was left out apart."""
        known = {e.id for e in self.known if e.id}
        return frozenset(known | ({RIGHT_FOR_WRONG_THERMAL} if self.kind == "wrong_thermal" else set()))

    @property
    def unknown(self) -> tuple[TrueEffect, ...]:
        """The missing effects that the diagnosis can't name."""
        return tuple(e for e in self.effects if e.id is None or e.id in self.left_out)

    @property
    def stratum(self) -> str:
        """The stratum of the weakest missing effect, which is the one that decides; ``none`` without one."""
        return stratum(min(e.d_prime for e in self.effects)) if self.effects else "none"


def write_truth(folder: Path, truth: Truth, contributions: Mapping[tuple[str, int], FloatArray]) -> None:
    """Write one case's truth: ``NNNN.json`` and ``NNNN.npz``.

    Parameters
    ----------
    folder
        The folder ``truth``.
    truth
        The truth.
    contributions
        What an effect truly adds to the output [deg/h], shape (n,), by run and place in
        `truth.effects`.
    """
    values = truth.model_dump(mode="json", by_alias=True)
    with whole_file(folder / f"{truth.case}.json") as partial:
        write_json(partial, values, indent=1)
    with whole_file(folder / f"{truth.case}.npz") as partial, partial.open("wb") as file:
        arrays: dict[str, Any] = {_key(run, i): values for (run, i), values in contributions.items()}
        np.savez_compressed(file, **arrays)


def read_truth(path: Path) -> Truth:
    """The truth of one case from its JSON file.

    Raises
    ------
    InputError
        If it is missing or breaks the schema; names the file and the key.
    """
    held = read_bytes(path, "make the cases first (fogml blind make)")
    try:
        return Truth.model_validate_json(held)
    except ValidationError as error:
        first = error.errors()[0]
        place = f"key '{'.'.join(str(part) for part in first['loc'])}': " if first["loc"] else ""
        raise InputError(f"{path}: {place}{printable(first['msg'])}; make the cases anew") from None


def read_contributions(path: Path) -> dict[tuple[str, int], FloatArray]:
    """What `write_truth` was given as `contributions`, from the ``.npz`` file."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return {_parsed(key): arrays[key] for key in arrays.files}
    except (OSError, ValueError, EOFError, BadZipFile, zlib.error, NotImplementedError) as error:
        raise InputError(f"{path}: damaged, or no file of contributions; make the cases anew") from error


def _key(run: str, place: int) -> str:
    return f"{place}|{run}"


def _parsed(key: str) -> tuple[str, int]:
    place, run = key.split("|", 1)
    return run, int(place)
