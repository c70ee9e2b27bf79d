"""Which case is what: the mix of `gap.md`, fixed for each block of twenty cases; final seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from fogml.blind.folders import read_json
from fogml.blind.frame.unit import Reality
from fogml.blind.truth import KINDS, Kind
from fogml.errors import InputError, known_are
from fogml.json_files import write_json
from fogml.outputs import folder_to_fill, whole_file

FIRST = "first"
"""What is drawn from unless another one is chosen, so that a seed goes on giving the same files."""
MIX = "mix"
"""All of them in turn, case by case."""
SAME_TWIN = "same-twin"
"""No reality: a shipped twin's own runs, to be diagnosed against it."""
REALITIES = (FIRST, "second", "third")
"""Their names, each that of a package beside this module."""


def reality(name: str) -> Reality:
    """The reality of a name of `REALITIES`."""
    found: Reality = import_module(f"fogml.blind.{name}.reality").REALITY
    return found


def chosen(name: str) -> tuple[str, ...]:
    """Names of the realities that a choice means."""
    if name == MIX:
        return REALITIES
    if name not in (*REALITIES, SAME_TWIN):
        choices = (*REALITIES, MIX, SAME_TWIN)
        raise InputError(f"there is no reality '{name}'; {known_are(name, choices, 'choices')}")
    return (name,)


PER_BLOCK: dict[Kind, int] = {
    "nothing": 3,
    "one": 6,
    "two": 3,
    "three": 1,
    "unknown_left_out": 2,
    "unknown_invented": 2,
    "unknown_and_known": 2,
    "wrong_thermal": 1,
}
"""Cases of each kind in twenty."""
STRATA = ((4.0, 6.0), (6.0, 10.0), (10.0, 20.0), (20.0, 40.0))
"""Bounds of d'; within them it is drawn evenly in its logarithm."""
Strata = tuple[tuple[float, float], ...]
_RUNS = (1, 2, 5)
_RUN_SHARES = (0.35, 0.45, 0.2)


@dataclass(frozen=True)
class Plan:
    """What one case is to be.

    Attributes
    ----------
    number
        From 1.
    kind
        Of the truth's schema.
    left_out
        Ids that are withheld.
    first
        Name of an effect that it must have, or None; drawn ones come on top.
    known
        How many more effects of the catalogue are drawn.
    runs
        To fit on.
    static
        Whether there is a static run.
    strata
        Bounds of d' that its effects are drawn within.
    mix
        Whether it is drawn from the whole mix.
    reality
        Which reality it is of.
    """

    number: int
    kind: Kind
    first: str | None
    known: int
    left_out: tuple[str, ...]
    runs: int
    static: bool
    strata: Strata = STRATA
    mix: bool = True
    reality: str = FIRST

    @property
    def name(self) -> str:
        """Number as in the file names."""
        return f"{self.number:04d}"


def strata_from(least_d_prime: float) -> Strata:
    """The strata whose lower bound reaches a d'."""
    found = tuple(bounds for bounds in STRATA if bounds[0] >= least_d_prime)
    if not found:
        raise InputError(f"least d' {least_d_prime:g}: no stratum begins there or above {STRATA[-1][0]:g}")
    return found


def plans(
    count: int,
    seed: int,
    kinds: Sequence[str] | None = None,
    least_d_prime: float = 0.0,
    of: str = FIRST,
    d_prime: Strata = (),
) -> list[Plan]:
    """The first `count` cases of a seed; a longer list begins with a shorter one.

    Parameters
    ----------
    kinds
        Only cases of these kinds, in the mix's proportions among them; all if None.
    least_d_prime
        Only strata of d' that begin there or above.
    of
        A reality's name, ``mix`` for all of them in turn, each with the plans that it has alone, or
        ``same-twin``.
    d_prime
        Bounds of d' in place of the strata.

    Raises
    ------
    InputError
        If a kind or the reality is not known, bounds are not possible, or no stratum is left.
    """
    for low, high in d_prime:
        if not 0.0 < low < high:
            raise InputError(f"d' from {low:g} to {high:g}: two positive bounds are needed, the lower first")
    strata = d_prime or strata_from(least_d_prime)
    for kind in kinds or ():
        if kind not in KINDS:
            raise InputError(f"there is no kind of case '{kind}'; {known_are(kind, KINDS, 'kinds')}")
    names = chosen(of)
    own = [_of_one(-(-count // len(names)), seed, kinds, strata, name) for name in names]
    found = [own[place % len(own)][place // len(own)] for place in range(count)]
    return [replace(plan, number=number) for number, plan in enumerate(found, start=1)]


def _of_one(count: int, seed: int, kinds: Sequence[str] | None, strata: Strata, of: str) -> list[Plan]:
    """Plans of one reality; a twin's own runs lack nothing."""
    if of == SAME_TWIN:
        if kinds not in (None, ["nothing"]):
            raise InputError(f"{of}: nothing is missing there; leave kinds out")
        rng = np.random.default_rng([seed, 0x7715])
        drawn = ((int(rng.integers(1, 3)), bool(rng.random() < 0.6)) for _ in range(count))
        return [Plan(1, "nothing", None, 0, (), runs, static, strata, False, of) for runs, static in drawn]
    held = reality(of)
    mix = kinds is None and strata == STRATA
    block = [k for k, n in PER_BLOCK.items() if kinds is None or k in kinds for _ in range(n)]
    rng = np.random.default_rng([seed, 0x9E37])
    known = _Cycle(rng, held.known_names)
    left_out = _Cycle(rng, held.known_names)
    invented = _Cycle(rng, held.invented_names)
    unknown_and_known = 0
    found: list[Plan] = []
    while len(found) < count:
        for kind in rng.permutation(np.array(block)).tolist():
            first: str | None = None
            more, withheld = 0, list[str]()
            if kind in ("one", "two", "three"):
                first, more = known.next(), ("one", "two", "three").index(kind)
            elif kind == "unknown_left_out":
                first = left_out.next()
            elif kind == "unknown_invented":
                first = invented.next()
            elif kind == "unknown_and_known":
                more = 1
                first = (left_out if unknown_and_known % 2 else invented).next()
                unknown_and_known += 1
            elif kind == "wrong_thermal":
                first = held.wrong_structure.name
            if kind.startswith("unknown") and first in held.known_names:
                withheld = [first]
            runs = int(rng.choice(_RUNS, p=_RUN_SHARES))
            static = bool(rng.random() < 0.6)
            number = len(found) + 1
            found.append(Plan(number, kind, first, more, tuple(withheld), runs, static, strata, mix, of))
    return found[:count]


class _Cycle:
    """Names in random order, each once before any comes again."""

    def __init__(self, rng: np.random.Generator, names: tuple[str, ...]) -> None:
        self._rng, self._names = rng, names
        self._left: list[str] = []

    def next(self) -> str:
        if not self._left:
            self._left = [str(name) for name in self._rng.permutation(np.array(self._names))]
        return str(self._left.pop())


FINAL_FROM = 1_000_000
"""Seeds from here on are kept for final figures; those below are to develop on."""
SCHEMA = "fogml.blind_uses/1"


def is_final(seed: int) -> bool:
    """Whether a suite's seed is one that nobody develops on."""
    return seed >= FINAL_FROM


def check_use(seed: int, final: Path | None) -> None:
    """Refuse to score a final seed without the ledger, or another seed with it."""
    if is_final(seed) and final is None:
        raise InputError(
            f"seed {seed} is kept for final figures (from {FINAL_FROM} on): score it with --final, which "
            "records the use, or make cases with a smaller seed to develop on"
        )
    if final is not None and not is_final(seed):
        raise InputError(f"--final: seed {seed} is one to develop on; final ones begin at {FINAL_FROM}")


def uses(ledger: Path) -> list[dict[str, Any]]:
    """Every use of a final seed that the ledger records, the first one first."""
    return list(read_json(ledger).get("uses", [])) if ledger.is_file() else []


def record_use(ledger: Path, seed: int, cases: int, truth_hash: str, figures: dict[str, Any]) -> None:
    """Add a use to the ledger: when, which seed, how many cases, their truth's hash, every figure."""
    use = {
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
        "seed": seed,
        "cases": cases,
        "truth": truth_hash,
        "figures": figures,
    }
    values = {"schema": SCHEMA, "uses": [*uses(ledger), use]}
    with folder_to_fill(ledger.parent), whole_file(ledger) as partial:
        write_json(partial, values, indent=1)
