"""How far an export is from the model, measured before anything is written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.export.c_program import FLAGS, CProgram
from fogml.export.c_source import CSource
from fogml.export.plan import Plan
from fogml.export.points import (
    POINTS,
    History,
    box_points,
    history,
    largest_in_box,
    output_size,
    recorded_history,
)
from fogml.export.self_test import sensor_range
from fogml.features.atoms import AtomValues
from fogml.models.base import DriftModel
from fogml.runs.run import Run

READING_STEP_DEGC = 1.0 / 16.0
"""Steps of a thermometer in use, a DS18B20's, in which a history is read where windows are held in bins."""
_BEYOND = 0.2
TURN_DEG_H = 36_000.0
"""Rate of turn at which a scale factor's difference is told: 1 ppm of it is 0.036 deg/h, beyond rounding."""


@dataclass(frozen=True)
class Difference:
    """Largest differences of an export from the model [deg/h].

    Attributes
    ----------
    inside
        In the trained box, windows full or not.
    outside
        Up to a fifth of the span outside of it, where it is flagged.
    points, samples
        Points in the box and samples of a history that were compared.
    good
        Those of the history with flag 0; of a graph from windows, those in the trained box.
    flags
        Samples of the history whose flag differs.
    scale_ppm
        Of a joint model, the differences at 10 and -10 deg/s from each other, as a share of 20 deg/s.
    """

    inside: float
    outside: float
    points: int
    samples: int = 0
    good: int = 0
    flags: int = 0
    scale_ppm: float | None = None

    def with_points(self, points: Difference) -> Difference:
        """That of a history, with that at points."""
        inside, outside = max(self.inside, points.inside), max(self.outside, points.outside)
        return replace(self, inside=inside, outside=outside, points=points.points)

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values."""
        values: dict[str, Any] = {
            "largest_difference": self.inside,
            "largest_difference_outside": self.outside,
            "compared": {
                "points": self.points,
                "samples": self.samples,
                "good": self.good,
                "flags_differ": self.flags,
            },
        }
        if self.scale_ppm is not None:
            values["scale_difference_ppm"] = self.scale_ppm
        return values


def plan_error(plan: Plan, model: DriftModel, seed: int) -> float:
    """Largest difference between a plan and the model it was made of [deg/h], over a history."""
    past = history(plan, seed)
    run = past.run(plan)
    atoms = past.atoms(plan)
    # First of all, as it tells numbers that are too large.
    evaluation = model.evaluate_from(run, atoms)
    value, _ = plan.compensated(atoms, past.gyro)
    return float(np.max(np.abs(value - (run.gyro_deg_h - evaluation.drift))))


def c_difference(
    plan: Plan, source: CSource, program: CProgram, seed: int, recorded: Sequence[Run] = ()
) -> Difference:
    """Difference of generated C from a plan: in the box, over a history with gaps, and over recorded runs.

    Inside is the trained box, slices apart, which a history seldom keeps to. Recorded runs show what clocks,
    lost samples and thermometers of their own make of windows.
    """
    fixed = source.numbers["fixed"]
    gyro_step = float(fixed["gyro_value"]) if fixed else 0.0
    counts = gyro_step if plan.gyro_unit == "count" else 0.0
    past = _with_outputs(plan, history(plan, seed), counts)
    off, flags, told, boxed = _over_history(plan, source, program, past)
    inside, outside = _largest(off[boxed != 1]), _largest(off[boxed == 1])
    others = [_with_outputs(plan, recorded_history(plan, run, seed), counts) for run in recorded]
    if source.layout.binned and all(atom.operator != "sign" for atom in plan.atoms):
        # Bins take samples for evenly rising, which a thermometer that shows steps does not. Of a soak's
        # direction steps leave nothing to compare.
        others.append(past.in_steps(plan, READING_STEP_DEGC))
    for other in others:
        more, _, _, where = _over_history(plan, source, program, other)
        inside, outside = max(inside, _largest(more[where == 0])), max(outside, _largest(more[where == 1]))
    good, differ = int(np.count_nonzero(flags == 0)), int(np.count_nonzero(told != flags))
    if not plan.atoms:
        return Difference(inside, outside, 0, len(off), good, differ)

    rng, steps = np.random.default_rng([seed, 4]), _reading_steps(plan, source)

    def at(gyro: float, less: float | None = None, beyond: float = 0.0) -> float:
        gyro, *others = (
            float(np.round(one / gyro_step) * gyro_step) if gyro_step else one
            for one in (gyro, less)
            if one is not None
        )

        def off(atoms: FloatArray) -> FloatArray:
            read = atoms + rng.choice([-0.5, 0.5], (len(atoms), len(steps))) @ steps
            found = _atoms_off(plan, source, program, atoms, read, gyro)
            # What differs between two outputs is of the scale factor, and no bias.
            for other in others:
                found -= _atoms_off(plan, source, program, atoms, read, other)
            return np.abs(found)

        return largest_in_box(plan, off, seed, beyond)

    # Rounding an output where it is taken adds to all else, whatever the drift: looked for of whole ones.
    scale = abs(float(plan.arrays["scale"][0])) if plan.gives_rate else 1.0
    output, taken = output_size(plan), 0.0 if counts else 0.5 * gyro_step * scale
    near, far, ppm = at(output) + taken, at(output, beyond=_BEYOND) + taken, None
    if plan.gives_rate:
        turn = float(TURN_DEG_H / plan.arrays["scale"][0])
        ppm = 1e6 * at(turn, -turn) / (2.0 * TURN_DEG_H)
    return Difference(max(inside, near), max(outside, far), POINTS, len(off), good, differ, ppm)


def _with_outputs(plan: Plan, past: History, counts: float) -> History:
    """A history with outputs about its drift, as a gyro's are; whole counts of a model that takes them."""
    if plan.gives_rate:
        return replace(past, gyro=np.round(past.gyro / counts) * counts) if counts else past
    left, _ = plan.compensated(past.atoms(plan), past.gyro)
    return replace(past, gyro=2.0 * past.gyro - left)


def _over_history(
    plan: Plan, source: CSource, program: CProgram, past: History
) -> tuple[FloatArray, NDArray[np.int8], NDArray[np.int32], NDArray[np.int8]]:
    """How far C is from the plan [deg/h], flags of both, and those of the box alone, each (n,)."""
    fixed, atoms = source.numbers["fixed"], past.atoms(plan)
    expected, flags = plan.compensated(atoms, past.gyro)
    boxed = _boxed(plan).compensated(atoms, past.gyro)[1]
    if fixed is None:
        out, told = program.steps(past.time, past.temperatures, past.gyro)
        return np.abs(out.astype(np.float64) - expected), flags, told, boxed
    temperatures = np.round(past.temperatures / fixed["temperature_value"])
    out, told = program.steps(past.time, temperatures, np.round(past.gyro / fixed["gyro_value"]))
    return np.abs(out * fixed["compensated_value"] - expected), flags, told, boxed


def _boxed(plan: Plan) -> Plan:
    """The plan, which flags what lies outside of the trained box alone."""
    return replace(plan, limits=replace(plan.limits, slices=None))


def _reading_steps(plan: Plan, source: CSource) -> FloatArray:
    """What a step of each reading moves each atom without window or memory by, shape (s, a)."""
    fixed, steps = source.numbers["fixed"], np.zeros((len(plan.sensors), len(plan.atoms)))
    for s, sensor in enumerate(plan.sensors):
        low, high, _ = sensor_range(plan, sensor)
        most = np.asarray(max(abs(low), abs(high)), dtype=None if fixed else source.dtype)
        unit = fixed["temperature_value"] if fixed else float(np.spacing(most))
        for a, atom in enumerate(plan.atoms):
            if atom.operator == "value":
                steps[s, a] = unit * dict(atom.signal.parts).get(sensor, 0.0)
    return steps


def _atoms_off(
    plan: Plan, source: CSource, program: CProgram, atoms: FloatArray, read: FloatArray, gyro: float
) -> FloatArray:
    """C of atoms as they are `read` less the plan of the `atoms` [deg/h], shape (n,), of whole outputs."""
    fixed = source.numbers["fixed"]
    output = np.full(len(atoms), gyro)
    everywhere = np.ones(len(atoms), dtype=np.bool_)
    expected, _ = plan.compensated(AtomValues(atoms, everywhere, everywhere), output)
    if not plan.gives_rate:
        drift = output - expected
        output = output + drift
        if fixed is not None:
            output = np.round(output / fixed["gyro_value"]) * fixed["gyro_value"]
        expected = output - drift
    if fixed is None:
        out, _ = program.atoms(read, output)
        return np.asarray(out.astype(np.float64) - expected)
    whole = np.round(read * 2.0 ** np.array(fixed["atom_bits"]))
    out, _ = program.atoms(np.clip(whole, 1 - 2**31, 2**31 - 1), np.round(output / fixed["gyro_value"]))
    return np.asarray(out * fixed["compensated_value"] - expected)


def direction_flip(plan: Plan, seed: int) -> float | None:
    """Most that one direction more or less makes in the trained box [deg/h]; None without directions.

    About its dead band rounding, and in bins less than a step of a thermometer, tells a direction otherwise.
    """
    points, gyro = box_points(plan, seed), np.zeros(POINTS)
    largest = None
    for place in (i for i, atom in enumerate(plan.atoms) if atom.operator == "sign"):
        values = []
        for direction in (-1.0, 0.0, 1.0):
            points[:, place] = direction
            values.append(plan.value(plan.full_columns(points), gyro))
        largest = max(largest or 0.0, _largest(np.abs(np.diff(values, axis=0))))
    return largest


def value_difference(
    plan: Plan, value: Callable[[FloatArray, FloatArray], FloatArray], seed: int
) -> Difference:
    """Difference of a function of (feature columns, output) from a plan's drift."""

    def off(atoms: FloatArray) -> FloatArray:
        columns = plan.full_columns(atoms)
        gyro = np.full(len(atoms), 10.0 / (plan.arrays["scale"][0] if plan.gives_rate else 1.0))
        return np.abs(value(columns, gyro) - plan.value(columns, gyro))

    inside, outside = (largest_in_box(plan, off, seed, beyond) for beyond in (0.0, _BEYOND))
    return Difference(inside, outside, POINTS)


def pipeline_difference(
    plan: Plan, value: Callable[[FloatArray, FloatArray], FloatArray], length: int, seed: int
) -> Difference:
    """Difference of a function of (windows (n, m, s), output (n,)) from a plan's drift, over a history."""
    past = history(plan, seed, 2 * length)
    # A window knows nothing of gaps: the history on its grid is what it is made for.
    count = 1 + round((past.time[-1] - past.time[0]) / plan.sample_s)
    time = past.time[0] + plan.sample_s * np.arange(count)
    temperatures = np.column_stack([np.interp(time, past.time, path) for path in past.temperatures.T])
    whole = type(past)(time, temperatures, np.full(count, past.gyro[0]))
    expected, flags = _boxed(plan).compensated(whole.atoms(plan), whole.gyro)
    ends = np.linspace(length, count - 1, min(512, max(1, count - length))).astype(int)
    windows = np.stack([temperatures[end - length + 1 : end + 1] for end in ends])
    off = np.abs(whole.gyro[ends] - value(windows, whole.gyro[ends]) - expected[ends])
    inside = flags[ends] == 0
    return Difference(
        _largest(off[inside]), _largest(off[~inside]), 0, len(ends), int(np.count_nonzero(inside))
    )


def _largest(off: NDArray[Any]) -> float:
    if not np.all(np.isfinite(off)):
        return float("inf")
    return float(np.max(off, initial=0.0))


def expected_outputs(
    source: CSource, program_folder: Path, flags: Sequence[str] = FLAGS
) -> tuple[list[float], list[int], int]:
    """What the compiled source gives at its self-test's checks, in the numbers of the code, and its sum."""
    test = source.self_test
    program = CProgram(source, program_folder, flags=flags)
    kind = {"float64": np.float64, "float32": np.float32}.get(source.dtype, np.int64)
    step = np.arange(test.steps)
    fold = step % (2 * test.period)
    phase = np.where(fold < test.period, fold, 2 * test.period - fold).astype(kind)
    first, rise, jump = (np.asarray(values).astype(kind) for values in (test.first, test.rise, test.jump))
    temperatures = first + rise * phase[:, None]
    temperatures[test.checks[-1] :] += jump
    time = step * np.int64(test.interval_us) - np.int64(test.before_wrap_us)
    out, told = program.steps(time, temperatures, np.full(len(step), np.asarray(test.gyro).astype(kind)))
    out, told = out[list(test.checks)], told[list(test.checks)]
    if test.atoms:
        more = program.atoms(test.atoms, np.full(len(test.atoms), np.asarray(test.gyro).astype(kind)))
        out, told = np.append(out, more[0]), np.append(told, more[1])
    return out.tolist(), told.tolist(), program.sum_of_numbers()
