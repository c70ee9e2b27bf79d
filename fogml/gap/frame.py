"""All runs as whitened rows, and every family's blocks over them, at one noise."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from fogml.gap.linear_gaussian import LinearGaussian
from fogml.gap.model import Constant
from fogml.gap.rows import Rows, slopes, through_nominal
from fogml.gap.scene import Family, Scene, rate, steps_are_coarse
from fogml.gap.settings import Priors
from fogml.runs.run import FloatArray
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener
from fogml.twin.nominal import DELTA
from fogml.twin.twin import Twin

LONGEST_RUNS = 30.0
"""Flicker goes on to this many run lengths: what is slower sets runs apart by a constant."""
LEAST_ERROR = 0.3
"""Whitened length under which an error of the readings is left out."""
FORM_WAVES = 24
"""Half waves of a run that an error of a form may be smooth over."""
IN_CONSTANTS = 1e-4
"""A block that keeps less of its energy beside the constants lies in their span."""


@dataclass(frozen=True)
class Node:
    """A block of a family over all runs: where its columns are, its shape, weight's logarithm and sign."""

    family: int
    start: int
    stop: int
    shape: Mapping[str, Any]
    log_weight: float
    positive: bool = False


@dataclass(frozen=True, eq=False)
class Columns:
    """Blocks of all families on each run, not whitened.

    ``by_run`` has shape (m_r, k) for each run of the scene, held-out ones too.
    """

    families: tuple[Family, ...]
    nodes: tuple[Node, ...]
    by_run: tuple[FloatArray, ...]

    @classmethod
    def of(cls, families: Sequence[Family], scene: Scene, constants: Mapping[str, float]) -> Columns:
        """Every family's blocks."""
        nodes: list[Node] = []
        parts: list[list[FloatArray]] = [[] for _ in scene.runs]
        at = 0
        for f, family in enumerate(families):
            by_run = [list(family.build(rows, scene, constants)) for rows in scene.runs]
            # Blocks whose weights add to less are the part of a grid that stands out.
            total = max(sum(b.weight for b in by_run[0]), 1.0)
            for blocks in zip(*by_run):
                width = blocks[0].columns.shape[1]
                wide = width * (scene.fitted if family.drawn_per_run else 1)
                for r, (block, held) in enumerate(zip(blocks, parts)):
                    if not family.drawn_per_run:
                        held.append(block.columns)
                        continue
                    spread = np.zeros((len(block.columns), wide))
                    if r < scene.fitted:
                        spread[:, r * width : (r + 1) * width] = block.columns
                    held.append(spread)
                weight = float(np.log(max(blocks[0].weight, 1e-300) / total))
                nodes.append(Node(f, at, at + wide, blocks[0].shape, weight, blocks[0].positive))
                at += wide
        return cls(tuple(families), tuple(nodes), tuple(np.concatenate(held, axis=1) for held in parts))


@dataclass(frozen=True, eq=False)
class Setting:
    """What all noises share: the scene, the fixed block of constants and nuisances, and the columns.

    Attributes
    ----------
    fixed
        Responses to one prior standard deviation, shape (m_r, p) for each run; constants first.
    widened
        Factors on the standard deviations of constants that are far off, by name.
    values
        The constants as fitted beside nothing.
    """

    scene: Scene
    constants: tuple[Constant, ...]
    priors: Priors
    fixed: tuple[FloatArray, ...]
    values: Mapping[str, float]
    widened: Mapping[str, float] = field(default_factory=dict)

    @property
    def deviations(self) -> FloatArray:
        """Prior standard deviations of the constants, widened ones so, shape (c,)."""
        return np.array([c.sd * self.widened.get(c.name, 1.0) for c in self.constants])

    @property
    def spans(self) -> tuple[slice, ...]:
        """Rows of each fit run in what is stacked."""
        edges = np.cumsum([0, *(len(r) for r in self.scene.runs[: self.scene.fitted])])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(edges))


def whitener_of(noise: NoiseModel, rows: Rows) -> Whitener:
    """The whitener of a run's rows at a noise."""
    span = float(rows.end_s[-1] - rows.end_s[0]) + rows.row_s
    return Whitener(noise, rows.end_s, rows.row_s, noise.ladder(rows.row_s, LONGEST_RUNS * span))


class Whitening:
    """Whitens series over the rows of the fit runs by one noise; readings' noise adds to it."""

    def __init__(self, noise: NoiseModel, setting: Setting) -> None:
        self.noise = noise
        self._whiteners, self._weights = [], []
        for rows in setting.scene.runs[: setting.scene.fitted]:
            held = whitener_of(noise, rows)
            extra = (1.0 / rows.weight**2 - 1.0) * noise.white_density / rows.row_s
            self._whiteners.append(held)
            self._weights.append(1.0 / np.sqrt(1.0 + extra / held.deviation**2))

    def stacked(self, series: Sequence[FloatArray]) -> FloatArray:
        """Series of each fit run, shape (m_r, ...), whitened and one after the other."""
        parts = []
        for values, whitener, weight in zip(series, self._whiteners, self._weights):
            white = whitener.whiten(np.ascontiguousarray(values))
            parts.append(white * (weight if white.ndim == 1 else weight[:, None]))
        return np.concatenate(parts)

    @cached_property
    def log_det(self) -> float:
        """Half the logarithm of the determinant of the rows' covariance."""
        return float(
            sum(w.log_det - np.sum(np.log(weight)) for w, weight in zip(self._whiteners, self._weights))
        )


def reading_errors(rows: Rows, constants: Mapping[str, float], noise_deg_h: float) -> FloatArray:
    """What errors of the smoothed readings make of the replay, columns of unit priors, shape (m, k).

    Those far under the noise of a row given those before it, `noise_deg_h`, are left out.
    """
    told = slopes(rows, constants)
    steepest = sum(float(np.abs(slope).max()) * (2.0 if n == DELTA else 1.0) for n, slope in told.items())
    columns = []
    for name, smoothness in rows.smoothness.items():
        if name not in ("T", "T_in", "T_out"):
            continue
        # The waves are of length 1: none makes more than the steepest slope of it.
        if smoothness.noise * steepest < LEAST_ERROR * noise_deg_h:
            continue
        found = through_nominal(rows, told, {name: smoothness.errors(len(rows.kept))})
        columns.append(found[:, np.sum(found**2, axis=0) > (LEAST_ERROR * noise_deg_h) ** 2])
    return np.concatenate([np.zeros((len(rows), 0)), *columns], axis=1)


def fixed_columns(
    rows: Rows,
    run: int,
    scene: Scene,
    twin: Twin,
    constants: Sequence[Constant],
    widened: Mapping[str, float],
    values: Mapping[str, float],
    priors: Priors,
) -> FloatArray:
    """One standard deviation of each constant, and of what sensors of ordinary quality miss, shape (m, p).

    Each sensor is late by a little, and its readings may be what acted, rather than the smooth course.
    Where they come in coarser steps than the twin's, the constants meet them as they were read, as a replay
    does. What the twin itself has that each run draws anew is another one on each.
    """
    coarse = steps_are_coarse(scene, twin)
    sd = np.array([c.sd * widened.get(c.name, 1.0) for c in constants])
    told, time = slopes(rows, values), rows.even.time
    columns = [rows.constants * sd]
    hidden = {n: v - rows.even.temperatures[n] for n, v in rows.readings.items()}
    if coarse:
        columns[0] = columns[0] + _through_each(rows, constants, hidden) * sd
    lag_s = math.hypot(priors.missed_lag, twin.sensors.common.lag)
    for names in (("T", "T_in"), ("T_out",)):
        own = [n for n in names if n in rows.readings]
        late = {n: lag_s / 60.0 * rate(time, rows.even.temperatures[n]) for n in own}
        columns.append(through_nominal(rows, told, late)[:, None])
        errors = {n: hidden[n] for n in own}
        columns.append(through_nominal(rows, told, {} if coarse else errors)[:, None])
    columns.append(rows.replay_errors * np.array([lag_s, 1.0]))
    for declared, setting in twin.on:
        if declared.drawn_per_run:
            own_column = np.zeros((len(rows), scene.fitted))
            if run < scene.fitted:
                response = rows.response(declared, setting.shape, None, values)
                own_column[:, run] = setting.amplitude * response
            columns.append(own_column)
    off = {i: r.own.nuisances(values) for i, r in enumerate(scene.runs) if r.own is not None}
    for name in sorted({name for held in off.values() for name in held}):
        mine = off[run].get(name)
        columns.append((np.zeros(len(rows)) if mine is None else rows.samples(mine))[:, None])
    return np.concatenate(columns, axis=1)


def with_form_errors(setting: Setting, noise: NoiseModel, length: float) -> Setting:
    """With what no form holds of a gap of a whitened length: its share, smooth in each run's time.

    Where that is too short to be seen there is none.
    """
    share = setting.priors.form_error * length
    if share < 1.0:
        return setting
    runs, fitted = setting.scene.runs, setting.scene.fitted
    waves = []
    for i, rows in enumerate(runs):
        held = np.zeros((len(rows), FORM_WAVES * fitted))
        if i < fitted:
            phase = (
                np.pi
                * (rows.time_s - rows.end_s[0] + rows.row_s)
                / (rows.end_s[-1] - rows.end_s[0] + rows.row_s)
            )
            own = slice(i * FORM_WAVES, (i + 1) * FORM_WAVES)
            held[:, own] = np.cos(phase[:, None] * np.arange(1, FORM_WAVES + 1))
        waves.append(held)
    white = Whitening(noise, setting).stacked(waves[:fitted])
    scale = share / np.sqrt(float(FORM_WAVES * fitted) * np.sum(white**2, axis=0))
    return replace(
        setting, fixed=tuple(np.concatenate([f, w * scale], axis=1) for f, w in zip(setting.fixed, waves))
    )


def _through_each(rows: Rows, constants: Sequence[Constant], errors: Mapping[str, FloatArray]) -> FloatArray:
    """What readings differ by from the smooth course in the response to each constant, shape (m, c)."""
    zeros = {c.name: 0.0 for c in constants}
    return np.column_stack(
        [
            through_nominal(rows, slopes(rows, zeros | {c.name: 1.0}), errors)
            if c.name not in ("e0", "b0")
            else np.zeros(len(rows))
            for c in constants
        ]
    )


class Field:
    """Whitened data, fixed block and columns at one noise, each block scaled to a whitened length of 1."""

    def __init__(
        self, setting: Setting, columns: Columns, noise: NoiseModel, only: Sequence[int] | None = None
    ):
        self.setting, self.columns = setting, columns
        self.whitening = Whitening(noise, setting)
        fitted = setting.scene.fitted
        data = self.whitening.stacked([r.gap for r in setting.scene.runs[:fitted]])
        self.fixed = self.whitening.stacked(setting.fixed[:fitted])
        self.base = LinearGaussian.of(data).beside(self.fixed)
        picked = list(range(len(columns.nodes)) if only is None else only)
        spans = [(columns.nodes[i].start, columns.nodes[i].stop) for i in picked]
        raw = columns.by_run[:fitted]
        if only is not None:
            places = np.concatenate([np.arange(*span) for span in spans] or [np.arange(0)])
            raw = tuple(values[:, places] for values in raw)
        white = self.whitening.stacked(raw)
        edges = np.cumsum([0, *(stop - start for start, stop in spans)])
        whole = np.sum(white**2, axis=0)
        kept = whole - np.sum((self.base.basis.T @ white) ** 2, axis=0)
        whole, kept = (np.add.reduceat(v, edges[:-1]) if picked else v for v in (whole, kept))
        shown = kept > np.maximum(IN_CONSTANTS * whole, 1e-18)
        scales = np.where(shown, 1.0 / np.sqrt(np.where(shown, kept, 1.0)), 0.0)
        white *= np.repeat(scales, np.diff(edges))
        self.scale = {i: float(s) for i, s in zip(picked, scales) if s}
        self.at = {
            i: slice(int(a), int(b)) for i, (a, b), s in zip(picked, pairwise(edges.tolist()), scales) if s
        }
        self.in_constants = {i for i in picked if i not in self.at}
        self.white = white

    def block(self, node: int) -> FloatArray:
        """Whitened columns of a node of whitened length 1, shape (n, k)."""
        return self.white[:, self.at[node]]

    def design(self, nodes: Sequence[tuple[int, float]]) -> FloatArray:
        """Fixed block and nodes with their sizes, shape (n, q)."""
        return np.concatenate([self.fixed, *(size * self.block(i) for i, size in nodes)], axis=1)

    def beside(self, nodes: Sequence[tuple[int, float]]) -> LinearGaussian:
        """The data beside the fixed block and nodes with their sizes."""
        held = self.base
        for i, size in nodes:
            held = held.beside(self.block(i), size)
        return held
