"""Making blind cases: drawn from their plans, seeded, in parallel, the truth apart and hashed."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from datetime import timedelta
from functools import partial
from pathlib import Path

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.folders import BlindFolder, write_sums
from fogml.blind.frame.form import Form, compatible
from fogml.blind.frame.strength import (
    AVERAGING_S,
    Acting,
    Reckoning,
    Scales,
    TooWeak,
    recorded,
    recorded_output,
)
from fogml.blind.frame.unit import Reality, Unit, UnitRun
from fogml.blind.plan import FIRST, SAME_TWIN, Plan, Strata, plans, reality
from fogml.blind.truth import Amount, Runs, Segment, TrueClosed, TrueEffect, Truth, read_truth, write_truth
from fogml.errors import InputError
from fogml.outputs import folder_to_fill, settled, whole_folder
from fogml.processes import in_processes, one_thread
from fogml.runs.facts import Facts, Heading
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from fogml.settings_check import check_whole

_MOST_UNITS = 300
"""Units that are tried for one case; the hardest effects are shown by one in five."""
_DIGITS = 6


def _make_case(folder: Path, truth_folder: Path, plan: Plan, seed: int, sample_s: float) -> None:
    """Draw one case and write it: runs and options into `folder`, its truth beside the others'."""
    unit, effects = draw_case(plan, seed, sample_s)
    scales = Scales(unit)
    reckoning = Reckoning(scales, effects)
    with whole_folder(folder / plan.name) as place:
        for run in unit.runs:
            write_run(recorded_run(unit, run, effects, plan), place / run.name)
        if unit.static is not None:
            write_run(recorded_run(unit, unit.static, (), plan), place / unit.static.name)
        options = json.dumps({"without": list(plan.left_out)}, indent=1)
        (place / "options.json").write_text(options + "\n", encoding="utf-8")
    # Half the digits are more than any score needs.
    compact = {
        key: values.astype(np.float32).astype(np.float64) for key, values in reckoning.contributions.items()
    }
    write_truth(truth_folder, _truth(plan, seed, unit, reckoning), compact)


def draw_case(plan: Plan, seed: int, sample_s: float) -> tuple[Unit, tuple[Acting, ...]]:
    """The unit and the effects of a case; units are drawn until one shows its effects as wanted."""
    world, attempt = reality(plan.reality), 0
    while True:
        rng = np.random.default_rng([seed, plan.number, attempt])
        forms = _draw_forms(rng, plan, world)
        runs = max(plan.runs, 2) if any(f.several_runs for f in forms) else plan.runs
        unit = world.draw_unit(rng, forms, runs, plan.static, sample_s)
        scales = Scales(unit)
        try:
            return unit, tuple(_set_strength(rng, scales, form, plan.strata) for form in forms)
        except TooWeak as error:
            attempt += 1
            if attempt >= _MOST_UNITS:
                raise RuntimeError(f"case {plan.name}: no unit shows {error} as wanted") from None


def _draw_forms(rng: np.random.Generator, plan: Plan, world: Reality) -> list[type[Form]]:
    forms: list[type[Form]] = []
    if plan.first is not None:
        own = world.forms_of(plan.first)
        forms.append(own[int(rng.integers(len(own)))])
    while len(forms) < plan.known + (plan.first is not None):
        more = world.known[int(rng.integers(len(world.known)))]
        if more.name not in plan.left_out and compatible([*forms, more]):
            forms.append(more)
    return forms


def _set_strength(rng: np.random.Generator, scales: Scales, form: type[Form], strata: Strata) -> Acting:
    low, high = strata[int(rng.integers(len(strata)))]
    wanted = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    made = form()
    shape = {name: float(value) for name, value in made.draw(rng).items()}
    sign = 1.0 if rng.random() < 0.5 else -1.0
    return scales.with_strength(made, shape, sign, wanted)


def recorded_run(unit: Unit, run: UnitRun, effects: tuple[Acting, ...], plan: Plan) -> Run:
    """A run as its logger writes it, in the run format's columns and facts."""
    world = run.world
    columns: dict[str, FloatArray] = {
        "time": world.time,
        "gyro": np.round(recorded_output(unit, run, effects), _DIGITS),
        **recorded(unit, run, effects),
    }
    if unit.turning:
        columns["rate"] = np.round(world.table_rate, 9)
    for name in unit.shown:
        columns[name] = np.round(world.drives[name], _DIGITS)
    if "angle" in unit.instruments.others:
        columns["angle"] = np.round(world.angle, _DIGITS)
    heading = unit.set_up.heading
    known, first = unit.earth_stated, unit.first_day
    facts = Facts(
        unit=f"BLIND-{plan.name}",
        axis="x",
        latitude=unit.set_up.latitude if known else None,
        input_axis=("up" if heading is None else Heading(heading=heading)) if known else None,
        powered_on=world.programme.powered_on,
        started=None if first is None else first + timedelta(seconds=round(world.since_first)),
    )
    return Run(name=run.name, columns=columns, facts=facts)


def _truth(plan: Plan, seed: int, unit: Unit, reckoning: Reckoning) -> Truth:
    noise = {name: Amount(value=value, unit=of) for name, (value, of) in unit.noise.amounts().items()}
    return Truth(
        schema="fogml.blind_truth/1",
        case=plan.name,
        seed=seed,
        kind=plan.kind,
        reality=plan.reality,
        runs=Runs(
            fit=tuple(run.name for run in unit.fit),
            held_out=tuple(run.name for run in unit.held_out),
            noise=unit.static.name if unit.static else None,
        ),
        sample_s=unit.sample_s,
        turning=unit.turning,
        effects=tuple(_true_effect(effect) for effect in reckoning.effects),
        left_out=plan.left_out,
        d_prime=reckoning.d_prime,
        segments=tuple(Segment(run=r, from_s=a, to_s=b) for r, a, b in reckoning.segments()),
        closed=tuple(TrueClosed(averaging_s=AVERAGING_S, **asdict(c)) for c in reckoning.closing()),
        noise=noise,
        nominal=unit.constants.as_dict(),
        thermal="; ".join(f"{r.name}: {r.world.programme.text}" for r in unit.runs),
        mix=plan.mix,
    )


def _true_effect(effect: Acting) -> TrueEffect:
    form = effect.form
    return TrueEffect(
        id=form.name if form.known else None,
        name=form.name,
        stage=form.stage,
        form=form.form,
        amplitude=Amount(value=effect.amplitude, unit=form.unit) if form.unit else None,
        shape=effect.shape,
        d_prime=effect.d_prime,
    )


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
    for name, number in (("count", count), ("workers", workers), ("first", first)):
        check_whole(name, number, 1)
    check_whole("seed", seed)
    if not 0.1 <= sample_s <= 30.0:
        raise InputError(f"sample interval {sample_s:g} s: 0.1 to 30 s are possible")
    wanted = plans(first - 1 + count, seed, kinds, least_d_prime, of, d_prime)[first - 1 :]
    folder = BlindFolder(Path(directory))
    with folder_to_fill(folder.cases), folder_to_fill(folder.truth), settled(folder.cases, folder.truth):
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
    from fogml.blind.same_twin import make_same_twin

    with one_thread():
        make = make_same_twin if plan.reality == SAME_TWIN else _make_case
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
    # A form that is not linear reaches the wanted d' to a hundredth.
    strange = [
        e.d_prime for e in held.effects if not any(0.99 * a <= e.d_prime <= 1.01 * b for a, b in plan.strata)
    ]
    if strange and held.mix == plan.mix:
        raise InputError(f"{path}: has d' {strange[0]:.3g}, outside what is wanted; choose another folder")
    if held.mix != plan.mix:
        which = "the whole mix" if held.mix else "chosen kinds or strata of d'"
        raise InputError(f"{path}: was drawn from {which}, unlike what is wanted; choose another folder")
    return True
