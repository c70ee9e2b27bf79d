"""Surprise: its moments against whole matrices, and against draws of what was found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.gap.evidence import Field, Term
from fogml.gap.surprise import LEAST_SPREAD, surprise
from tests.gap.test_search import BEND, CUBE, searched


def terms(field: Field, candidate: str, length: float) -> list[Term]:
    node = next(n for n in field.basis.nodes if n.candidate == candidate)
    return [Term(node.columns, length)]


def beside_constants(field: Field) -> np.ndarray:
    """Rows brought to where the data less what was found are of unit variance, constants drawn."""
    rows, fixed = field.basis.rows, field.basis.rows[:, field.basis.constants]
    values, axes = np.linalg.eigh(np.eye(len(rows)) + fixed @ fixed.T)
    return (axes / np.sqrt(values)) @ (axes.T @ rows)


def columns_of(rows: np.ndarray, held: list[Term]) -> np.ndarray:
    return rows[:, [c for t in held for c in t.columns]]


def with_data(field: Field, data: np.ndarray) -> Field:
    return Field(replace(field.basis, rows=np.column_stack([data, field.basis.rows[:, 1:]])))


def unknown(field: Field) -> list[Term]:
    return [Term(tuple(int(c) for c in field.basis.groups["temperature"]), 10.0)]


def test_moments_are_those_of_whole_matrices():
    field = searched((BEND, CUBE)).field_
    found, other = [*terms(field, "bend", 20.0), *terms(field, "cube", 20.0)], unknown(field)
    rows = beside_constants(field)
    y, own = rows[:, 0], columns_of(rows, found)
    scaled = columns_of(rows, other) * other[0].length
    seen = scaled @ np.linalg.solve(np.eye(scaled.shape[1]) + scaled.T @ scaled, scaled.T)
    away = np.eye(len(y)) - own @ np.linalg.pinv(own)
    signal = own @ np.linalg.solve(own.T @ own + np.eye(own.shape[1]) / 20.0**2, own.T @ y)
    mean = signal @ seen @ signal + np.trace(seen @ away)
    left = seen @ away @ seen
    variance = 4.0 * signal @ left @ signal + 2.0 * np.trace(left @ away)
    told = 0.5 * (y @ seen @ y - mean) / np.sqrt(0.25 * variance + LEAST_SPREAD**2)
    assert surprise(field, found, other) == pytest.approx(told, rel=1e-6)


def test_what_is_true_surprises_as_chance_has_it_and_what_is_not_does():
    field = searched((BEND,)).field_
    found, other = terms(field, "bend", 20.0), unknown(field)
    rng = np.random.default_rng(3)
    rows, fixed = field.basis.rows, field.basis.rows[:, field.basis.constants]
    made = 15.0 * columns_of(rows, found)[:, 0] / np.linalg.norm(columns_of(rows, found)[:, 0])
    told, more = [], 12.0 * columns_of(rows, other).sum(axis=1)
    for _ in range(200):
        noise = rng.standard_normal(len(rows)) + fixed @ rng.standard_normal(fixed.shape[1])
        told.append([surprise(with_data(field, made + m + noise), found, other) for m in (0.0, more)])
    true, false = np.array(told).T
    # The least spread makes it less than one standard deviation, never more.
    assert abs(true.mean()) < 0.2 and 0.5 < true.std() < 1.1
    assert np.median(false) > np.quantile(true, 0.99)


def test_nothing_found_or_nothing_else_surprises_nobody():
    field = searched((BEND,)).field_
    assert surprise(field, [], unknown(field)) == 0.0
    assert surprise(field, unknown(field), []) == 0.0
