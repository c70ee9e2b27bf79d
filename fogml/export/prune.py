"""A model made to fit a byte budget: the centres, or terms, that explain most of its drift.

Centres are chosen by orthogonal least squares (Chen, Cowan & Grant 1991) against the model's own
drift over the trained box, or against the training runs where they are given; output weights and
linear part are then solved again. Nothing but training data is looked at.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.export.plan import Plan
from fogml.export.storage import design, weight_bytes
from fogml.features.parse import parse_features
from fogml.features.terms import composition_plan
from fogml.models.rbf.centres import orthogonal_least_squares


def pruned(
    plan: Plan, budget: int, dtype: str, c_code: bool, columns: FloatArray, target: FloatArray
) -> Plan:
    """The plan with as many centres, or terms, as fit the budget.

    Parameters
    ----------
    plan
        The whole model.
    budget
        Bytes that its numbers may take.
    dtype, c_code
        Number format, and whether for C code; they tell the bytes of a number.
    columns, target
        Feature columns (n, k) and the drift that is wanted there (n,) [deg/h].

    Raises
    ------
    InputError
        If not even the smallest form fits.
    """
    if weight_bytes(plan, dtype, c_code) <= budget:
        return plan
    if plan.centres:
        return _fewer_centres(plan, budget, dtype, c_code, columns, target)
    if plan.names and not plan.gives_rate:
        return _fewer_terms(plan, budget, dtype, c_code, columns, target)
    raise InputError(
        f"export: the model's numbers take {weight_bytes(plan, dtype, c_code)} bytes in {dtype}, and a model "
        f"of kind '{plan.kind}' has none to leave out; give --bytes that much, or a smaller --dtype"
    )


def _fewer_centres(
    plan: Plan, budget: int, dtype: str, c_code: bool, columns: FloatArray, target: FloatArray
) -> Plan:
    def bytes_of(count: int) -> int:
        return weight_bytes(_with_centres(plan, np.arange(count)), dtype, c_code)

    most = next((count for count in range(plan.centres, -1, -1) if bytes_of(count) <= budget), -1)
    if most < 0:
        raise _too_small(plan, budget, dtype, bytes_of(0))
    whole = design(plan, columns)
    # The linear part and the constant stay; the centres stand after them.
    ordered = np.hstack([whole[:, plan.centres :], whole[:, : plan.centres]])
    forced = ordered.shape[1] - plan.centres
    chosen = _chosen(ordered, target, forced + most, forced)
    kept = np.sort(chosen[chosen >= forced] - forced)
    fewer = _with_centres(plan, kept)
    solved = _solved(design(fewer, columns), target)
    arrays = {
        **fewer.arrays,
        "weights": solved[: len(kept)],
        "linear": solved[len(kept) : -1],
        "constant": solved[-1:],
    }
    return fewer.with_arrays(arrays)


def _with_centres(plan: Plan, kept: IndexArray) -> Plan:
    arrays = {
        name: values[kept] if name in ("centres", "widths", "weights") else values
        for name, values in plan.arrays.items()
    }
    return plan.with_arrays(arrays)


def _fewer_terms(
    plan: Plan, budget: int, dtype: str, c_code: bool, columns: FloatArray, target: FloatArray
) -> Plan:
    def cut(count: int) -> Plan:
        return plan.with_arrays({**plan.arrays, "linear": plan.arrays["linear"][:count]})

    sizes = range(len(plan.names), 0, -1)
    most = next((count for count in sizes if weight_bytes(cut(count), dtype, c_code) <= budget), 0)
    if most == 0:
        raise _too_small(plan, budget, dtype, weight_bytes(cut(1), dtype, c_code))
    ordered = np.hstack([np.ones((len(columns), 1)), columns])
    kept = np.sort(_chosen(ordered, target, most + 1, 1)[1:] - 1)
    solved = _solved(np.hstack([columns[:, kept], np.ones((len(columns), 1))]), target)
    fewer = _with_terms(plan, [plan.names[i] for i in kept])
    return fewer.with_arrays({"linear": solved[:-1], "constant": solved[-1:]})


def _with_terms(plan: Plan, names: list[str]) -> Plan:
    """The plan with some of its features, their limits as they were."""
    features = parse_features(", ".join(names))
    places = [plan.atoms.index(atom) for atom in features.atoms]
    return replace(
        plan,
        sensors=features.sensors,
        atoms=features.atoms,
        steps=composition_plan(features.terms, features.atoms),
        names=tuple(names),
        limits=plan.limits.of_atoms(places),
    )


def _chosen(columns: FloatArray, target: FloatArray, count: int, forced: int) -> IndexArray:
    """Places of the columns chosen, the forced ones first."""
    size = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(size > 0.0, size, 1.0)
    return orthogonal_least_squares(
        lambda i: np.asarray(scaled[:, i] @ scaled),
        np.einsum("ij,ij->j", scaled, scaled),
        target @ scaled,
        count,
        forced,
    )


def _solved(columns: FloatArray, target: FloatArray) -> FloatArray:
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    solution, *_ = np.linalg.lstsq(columns / size, target, rcond=1e-10)
    return np.asarray(solution / size)


def _too_small(plan: Plan, budget: int, dtype: str, least: int) -> InputError:
    return InputError(
        f"export: --bytes {budget} is too few: the smallest form of this '{plan.kind}' takes {least} bytes "
        f"in {dtype}; give at least that, or a smaller --dtype"
    )
