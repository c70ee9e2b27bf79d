"""A fitted model made small, written in one form, compared with the model, and refused if too far off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.export.c_program import CProgram, cortex_m4_size, instructions_per_sample, write_files
from fogml.export.c_source import RUST_FILE, c_source, number_of, project_files, rust_bindings
from fogml.export.check import (
    Difference,
    c_difference,
    direction_flip,
    expected_outputs,
    pipeline_difference,
    plan_error,
    value_difference,
)
from fogml.export.documentation import DOCUMENTATION_FILE, card_lines, documentation, export_card
from fogml.export.false_readings import false_reading_lines, false_readings
from fogml.export.fixed_bound import fixed_point_error, fixed_point_lines
from fogml.export.fixed_scales import output_bits
from fogml.export.layout import layout
from fogml.export.losses import TrainingRows, accuracy_loss, training_rows
from fogml.export.plan import Plan
from fogml.export.points import box_points, reached_points
from fogml.export.prune import pruned
from fogml.export.settings import (
    ExportSettings,
    check_settings,
    hold_within,
    report_head,
    report_tail,
    tolerance_of,
)
from fogml.export.sklearn_graph import export_graph, is_graph_alone
from fogml.export.storage import stored_plan, weight_bytes
from fogml.models.base import DriftModel
from fogml.numerals import ascii_number, short
from fogml.outputs import scratch_folder
from fogml.runs.run import Run

CLOCK = {"unit": "us", "wraps": True, "longest_uptime_s": None}
"""C code's clock: unsigned, of which only differences are taken, so that uptime is unlimited (None)."""
_PLAN_NOISE = 1e-9


def export_model(
    model: DriftModel, folder: Path, settings: ExportSettings, train: Sequence[Run] = ()
) -> dict[str, Any]:
    """Write a fitted model's compact form into a folder, once it has been compared with the model.

    Parameters
    ----------
    model
        The model.
    folder
        An existing folder.
    settings
        What is wanted.
    train
        The model's training runs, for pruning, for the loss of accuracy on them, and for C to be compared on
        their times and readings; may be left out.

    Returns
    -------
    dict
        The content of ``export.json``.

    Raises
    ------
    InputError
        If the form can't hold the model, or differs from it by more than the tolerance.
    """
    graph_alone = settings.to == "onnx" and is_graph_alone(model)
    dtype = settings.dtype or ("float32" if settings.to == "c" or graph_alone else "float64")
    check_settings(settings, dtype)
    if graph_alone:
        return export_graph(model, folder, dtype, settings)
    whole = Plan.of(model, settings.sample_s)
    if settings.to == "c":
        # What C can't hold is refused before anything is computed: its histories may be endless.
        layout(whole, number_of(dtype))
        if number_of(dtype) == "fixed":
            asked = (tolerance_of(model, one, dtype) for one in (settings, replace(settings, tolerance=None)))
            whole = replace(whole, output_bits=output_bits(min(asked)))
    _agreeing(whole, model, settings.seed)
    rows = training_rows(model, whole, train) if train else None
    plan, pruning = _pruned(whole, settings, dtype, rows)
    card = export_card(model, plan, pruning)
    if settings.to == "c":
        recorded = train if settings.sample_s in (None, model.card_.sample_s) else ()
        report, exported = _write_c(plan, folder, dtype, card, settings.seed, recorded)
    else:
        report, exported = _write_numbers(plan, folder, dtype, settings, card, rows)
    difference: Difference = report.pop("difference")
    tolerance = tolerance_of(model, settings, dtype, bool(report.get("bins")))
    total = difference.inside + (
        pruning["largest_difference"] if pruning and settings.tolerance is not None else 0.0
    )
    hold_within(total, difference, tolerance, settings, dtype)
    (folder / DOCUMENTATION_FILE).write_text(documentation(model, plan), encoding="ascii")
    size = weight_bytes(plan, dtype, settings.to == "c")
    head = report_head(
        settings, dtype, plan, difference, tolerance, weight_bytes=size, operations=plan.operations
    )
    return {
        **head,
        **({"pruning": pruning} if pruning else {}),
        "accuracy": accuracy_loss(whole, exported, rows, model.intervals_.averaging_s, settings.seed),
        **report,
        **report_tail(folder),
    }


def _agreeing(plan: Plan, model: DriftModel, seed: int) -> None:
    """Hold that the plan is the model: otherwise every check against the plan would be void."""
    error = plan_error(plan, model, seed)
    size = 1.0 + float(np.abs(plan.network.weights).sum())
    if not error <= _PLAN_NOISE * size:
        raise InputError(
            f"export: the model's plain form differs from the model by {short(error)} deg/h; it is too badly "
            "conditioned to be written down: train it again with fewer terms"
        )


def _pruned(
    whole: Plan, settings: ExportSettings, dtype: str, rows: TrainingRows | None
) -> tuple[Plan, dict[str, Any] | None]:
    if settings.budget is None:
        return whole, None
    points, where = reached_points(whole, settings.seed) if rows is None else (rows.atoms, "training runs")
    columns = whole.full_columns(points)
    target = whole.value(columns, np.zeros(len(columns))) if rows is None or whole.gives_rate else rows.target
    plan = pruned(whole, settings.budget, dtype, settings.to == "c", columns, target)
    if plan is whole:
        return whole, None
    atoms = points[:, [whole.atoms.index(atom) for atom in plan.atoms]]
    off = plan.value(plan.full_columns(atoms)) - whole.value(columns)
    return plan, {
        "bytes_asked": settings.budget,
        "bytes_whole": weight_bytes(whole, dtype, settings.to == "c"),
        "chosen_on": where,
        "centres": [whole.centres, plan.centres],
        "terms": [len(whole.names), len(plan.names)],
        "rms_difference": float(np.sqrt(np.mean(off**2))),
        "largest_difference": float(np.max(np.abs(off))),
        "model_deviation": float(np.std(whole.value(columns))),
    }


def _write_c(
    plan: Plan, folder: Path, dtype: str, card: dict[str, Any], seed: int, recorded: Sequence[Run]
) -> tuple[dict[str, Any], Plan]:
    false = false_readings(plan, seed)
    proven, flip = None, direction_flip(plan, seed)
    lines = [*card_lines(card, plan, dtype), *false_reading_lines(false)]
    if flip is not None:
        lines.append(f"directions    told otherwise about a dead band make up to {ascii_number(flip)} deg/h")
    if number_of(dtype) == "fixed":
        windows = layout(plan, "fixed")
        proven = fixed_point_error(plan, windows, dtype)
        lines += fixed_point_lines(proven, plan, windows)
    source = c_source(plan, dtype, lines)
    with scratch_folder() as scratch:
        source = source.with_expected(*expected_outputs(source, scratch))
        program = CProgram(source, scratch)
        if program.self_test() != 0:
            raise InputError("export: the generated C fails its own self-test on this machine")
        difference = c_difference(plan, source, program, seed, recorded)
        files = {
            **source.files,
            **project_files("fogml_model"),
            RUST_FILE: rust_bindings(source, program.state_bytes()),
        }
        size = cortex_m4_size(source, scratch)
        if size is not None:
            size["instructions_per_sample"] = instructions_per_sample(source, scratch)
    write_files(files, folder)
    fixed = source.numbers["fixed"]
    clock = {**CLOCK, "bits": source.layout.clock_bits}
    report: dict[str, Any] = {"difference": difference, "cortex_m4": size, "clock": clock}
    report |= {} if false is None else {"false_readings": false}
    report |= {} if flip is None else {"direction_flip_deg_h": flip}
    windows = source.layout
    if windows.binned:
        report["bins"] = {"held": windows.ring, "seconds": windows.bin_samples * plan.sample_s}
    if plan.centres:
        report["exp_error"] = source.numbers["exp_error"]
    if fixed:
        report["fixed_point"] = {
            "temperature_unit_degc": fixed["temperature_value"],
            "gyro_unit": fixed["gyro_value"],
            "compensated_unit_deg_h": fixed["compensated_value"],
            "largest_difference_proven": proven,
        }
    return report, plan


def _write_numbers(
    plan: Plan,
    folder: Path,
    dtype: str,
    settings: ExportSettings,
    card: dict[str, Any],
    rows: TrainingRows | None,
) -> tuple[dict[str, Any], Plan]:
    from fogml.export import number_files
    from fogml.export.onnx_graph import BEYOND

    inputs = box_points(plan, settings.seed) if rows is None else rows.atoms_of(plan)
    columns = plan.full_columns(inputs)
    stored, exported = stored_plan(plan, dtype, columns)
    seed = settings.seed
    if settings.to == "onnx":
        difference = _write_onnx(plan, folder, dtype, settings, stored, card)
        if settings.pipeline:
            # A history gets to few corners of the box.
            difference = difference.with_points(value_difference(plan, exported.value, seed))
        return {"difference": difference, "beyond_the_box": BEYOND[settings.pipeline]}, exported
    if settings.to == "json":
        number_files.write_json(folder, plan, stored, dtype, card)
        read = [*number_files.read_json(folder, plan)]
    else:
        number_files.write_mat(folder, plan, stored, dtype, card)
        read = [number_files.read_mat(folder, plan)]
    differences = [value_difference(plan, lambda c, g, p=p: p.value(c, g), seed) for p in read]  # type: ignore[misc]
    return {"difference": max(differences, key=lambda difference: difference.inside)}, exported


def _write_onnx(
    plan: Plan, folder: Path, dtype: str, settings: ExportSettings, stored: Any, card: dict[str, Any]
) -> Difference:
    from fogml.export.onnx_graph import ONNX_FILE, onnx_model, session_of, window_weights

    model = onnx_model(plan, stored, dtype, settings.pipeline, "\n".join(card_lines(card, plan, dtype)))
    data = model.SerializeToString()
    session = session_of(data)
    real = np.float64 if dtype == "float64" else np.float32

    def run(inputs: FloatArray, gyro: FloatArray) -> FloatArray:
        feed = {"temperatures" if settings.pipeline else "features": inputs.astype(real)}
        if plan.gives_rate:
            feed["gyro"] = gyro.astype(real)
        drift = np.asarray(session.run(["drift"], feed)[0], dtype=np.float64)
        return gyro - drift if plan.gives_rate and not settings.pipeline else drift

    if settings.pipeline:
        difference = pipeline_difference(plan, run, len(window_weights(plan)), settings.seed)
    else:
        difference = value_difference(plan, run, settings.seed)
    (folder / ONNX_FILE).write_bytes(data)
    return difference
