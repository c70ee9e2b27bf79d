"""Making blind cases: seeded, in parallel, the truth apart and hashed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from fogml.blind.folders import BlindFolder, write_sums
from fogml.blind.plan import FIRST, SAME_TWIN, Plan, Strata, plans
from fogml.blind.truth import read_truth
from fogml.errors import InputError
from fogml.processes import in_processes


def make_cases(
    directory: str | Path,
    count: int,
    seed: int,
    sample_s: float = 10.0,
    workers: int = 2,
    kinds: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
    first: int = 1,
    least_d_prime: float = 0.0,
    of: str = FIRST,
    d_prime: Strata = (),
) -> int:
    """Make `count` cases under `directory`, in ``cases``, and their truth in ``truth``.

    The same arguments give the same files, byte for byte, whatever `workers`. Cases whose truth is
    there already are left as they are, so that an interrupted call goes on where it stopped; a
    greater `count` adds cases to those of a smaller one. Where a suite is made in parts, each case is the
    same as where it is made in one go.

    Parameters
    ----------
    directory
        Made if it is not there.
    count
        How many, from number `first` on.
    seed
        What everything is drawn from.
    sample_s
        Sample interval [s].
    workers
        Processes.
    kinds
        Kinds of `fogml.blind.truth.KINDS`, in the mix's proportions among them; all if None.
    progress
        Called with the number of cases that are there, and `count`.
    first
        Number of the first one.
    least_d_prime
        Effects are drawn from the strata of d' that begin there or above; from all if 0.
    of
        A reality's name, ``mix`` for all of them in turn, or ``same-twin`` for a twin's own runs.
    d_prime
        Bounds of d' to draw within, in place of the strata.

    Returns
    -------
    int
        How many were made now.

    Raises
    ------
    InputError
        If an argument is not possible, or `directory` holds cases of another seed or interval.
    """
    if count < 1 or workers < 1 or first < 1:
        raise InputError(
            f"count, workers and the first number must be at least 1, found {count}, {workers} and {first}"
        )
    if not 0.1 <= sample_s <= 30.0:
        raise InputError(f"sample interval {sample_s:g} s: 0.1 to 30 s are possible")
    wanted = plans(first - 1 + count, seed, kinds, least_d_prime, of, d_prime)[first - 1 :]
    folder = BlindFolder(Path(directory))
    folder.cases.mkdir(parents=True, exist_ok=True)
    folder.truth.mkdir(parents=True, exist_ok=True)
    missing = [plan for plan in wanted if not _is_there(folder, plan, seed, sample_s)]
    done = count - len(missing)
    if progress:
        progress(done, count)
    if missing:
        make = partial(_make, folder.cases, folder.truth, seed, sample_s)
        for number, _ in enumerate(in_processes(make, missing, workers), start=1):
            if progress:
                progress(done + number, count)
    write_sums(folder.truth)
    return len(missing)


def _make(cases: Path, truth: Path, seed: int, sample_s: float, plan: Plan) -> None:
    from threadpoolctl import threadpool_limits

    from fogml.blind.case import make_case
    from fogml.blind.same_twin import make_same_twin

    # One thread a process; sums then also come out the same on any machine's number of cores.
    with threadpool_limits(limits=1):
        make = make_same_twin if plan.reality == SAME_TWIN else make_case
        make(cases, truth, plan, seed, sample_s)


def _is_there(folder: BlindFolder, plan: Plan, seed: int, sample_s: float) -> bool:
    path = folder.truth / f"{plan.name}.json"
    if not (path.is_file() and path.with_suffix(".npz").is_file() and (folder.cases / plan.name).is_dir()):
        return False
    held = read_truth(path)
    if (held.seed, held.sample_s, held.kind) != (seed, sample_s, plan.kind):
        raise InputError(
            f"{path}: is of seed {held.seed}, {held.sample_s:g} s and kind {held.kind}, not of seed {seed}, "
            f"{sample_s:g} s and kind {plan.kind}; choose another folder"
        )
    if held.reality != plan.reality:
        raise InputError(
            f"{path}: is of the {held.reality} reality, not of the {plan.reality}; choose another folder"
        )
    if held.mix != plan.mix:
        which = "the whole mix" if held.mix else "chosen kinds or strata of d'"
        raise InputError(f"{path}: was drawn from {which}, unlike what is wanted; choose another folder")
    return True
