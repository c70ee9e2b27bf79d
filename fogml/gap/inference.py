"""The runs of a diagnosis: which may go together, and what is held out where no run is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.errors import InputError
from fogml.gap.catalogue import families_of
from fogml.gap.frame import (
    Columns,
    Field,
    Setting,
    Whitening,
    fixed_columns,
    reading_errors,
    whitener_of,
    with_form_errors,
)
from fogml.gap.linear_gaussian import LinearGaussian, Posterior, log_evidence
from fogml.gap.model import AnyModel, TwinModel
from fogml.gap.noise import NoisePoints, first_noise, noise_points, prior_of
from fogml.gap.other_families import LINES
from fogml.gap.own_simulator import candidates_of, plant_of
from fogml.gap.reading import Unusable, rows_of
from fogml.gap.rows import Rows
from fogml.gap.scene import Scene, outstanding_lines
from fogml.gap.search import Explanation, Search
from fogml.gap.settings import Priors
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.twin import Twin

LEAST_MOTION_DEGC = 2.0
KEPT_BACK = 0.25
"""Share of the last run that is held out where no run is."""


def check_runs(fit: Sequence[Run], held_out: Sequence[Run], noise: Run | None) -> None:
    """Refuse runs that can't be diagnosed together.

    Raises
    ------
    InputError
        If there is no fit run, a run is used twice, or runs are of different units or axes.
    """
    if not fit:
        raise InputError("no run to diagnose is given")
    held: dict[str, tuple[str, str]] = {}
    for role, runs in (("fit", fit), ("held-out", held_out)):
        for run in runs:
            if run.hash in held:
                other, name = held[run.hash]
                if other == role:
                    raise InputError(f"{run.name}: the same samples as {name}; give each run once")
                raise InputError(
                    f"{run.name}: given as a {role} run and as a {other} run ({name}) too; a held-out run "
                    "must be one that the fit has not seen"
                )
            held[run.hash] = role, run.name
    units = {run.facts.unit: run.name for run in (*fit, *held_out) if run.facts.unit}
    axes = {run.facts.axis: run.name for run in (*fit, *held_out) if run.facts.axis}
    for what, stated in (("unit", units), ("axis", axes)):
        if len(stated) > 1:
            listed = ", ".join(f"{name} is {what} {value}" for value, name in stated.items())
            raise InputError(f"the runs are of different {what}s ({listed}); diagnose one {what} at a time")


def keep_back(fit: Sequence[Run]) -> tuple[Sequence[Run], Sequence[Run]]:
    """Fit runs less the last stretch of the last one, and that."""
    last = fit[-1]
    cut = int(len(last) * (1.0 - KEPT_BACK))
    return [*fit[:-1], last[:cut]], [last[cut:]]


FAR_OFF = 3.0
"""Prior standard deviations from which on a constant is said to be far off, and its prior widened."""
MOST_ROUNDS = 3
"""Searches, each at the noise that the one before found likeliest."""
WHITE_FACTORS = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1)
"""White noise beside what was found, over that beside nothing."""
SURE = 5
"""Sets by which white noise is judged again."""
RESCORED = 24
"""Sets whose evidence is taken at every noise."""
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Inference:
    """Everything known of the causes behind the fit runs.

    Attributes
    ----------
    model
        The twin, or another in its place.
    plant
        The twin whose plant and sensors count.
    setting, columns, points
        Runs and constants; families' blocks; noises.
    fields
        Whitened by each noise; the one that fits best holds all blocks, others those that are asked for.
    search
        At that noise.
    explanations
        The likeliest first.
    unusable
        Runs that could not be used, with the reason.
    shared
        What other units of the kind say of a set of known causes [nats], where there are some.
    """

    model: AnyModel
    plant: Twin
    setting: Setting
    columns: Columns
    points: NoisePoints
    search: Search
    explanations: tuple[Explanation, ...]
    unusable: tuple[tuple[str, str], ...]
    shared: Callable[[frozenset[str]], float] | None = None

    def with_others(self, explanations: Iterable[Explanation]) -> list[Explanation]:
        """Sets with what other units say of the causes that they name."""
        if self.shared is None:
            return list(explanations)
        families, names = self.columns.families, self.search.names
        return [
            replace(e, shared=self.shared(frozenset(families[f].id for f in names(e)))) for e in explanations
        ]

    @property
    def field(self) -> Field:
        """At the noise that fits best."""
        return self.search.field


def infer(
    model: AnyModel,
    fit: Sequence[Run],
    held_out: Sequence[Run],
    noise: Run | None,
    without: Iterable[str],
    priors: Priors,
    tell: Progress = lambda what: None,
) -> Inference:
    """The posterior of the causes behind the fit runs.

    Raises
    ------
    InputError
        If no run can be used, or no temperature moves.
    """
    tell("reading inputs")
    plant = plant_of(model)
    most = min(priors.most_rows, priors.most_of_all // max(len(fit), 1))
    runs, unusable = _rows(fit, model, plant, most)
    if not runs:
        raise InputError("; ".join(reason for _, reason in unusable))
    held, more = _rows(held_out, model, plant, most)
    scene = Scene((*runs, *held), len(runs), model.grade, candidates=candidates_of(model))
    _check_motion(scene)
    prior, source = prior_of(model, noise)
    setting = _setting(model, plant, scene, priors, prior.centre)
    first = first_noise(setting, prior)
    setting = _setting(model, plant, scene, priors, first)
    length = _gap_length(setting, first)
    priors = priors.reaching(length)
    setting = with_form_errors(replace(setting, priors=priors), first, length)
    tell("fitting the noise")
    points = noise_points(setting, prior, source, noise, priors.hopeless)
    setting = _setting(model, plant, scene, priors, points.fit.model)
    setting = with_form_errors(setting, points.fit.model, length)
    scene = replace(scene, lines_hz=outstanding_lines(scene, LINES))
    setting = replace(setting, scene=scene)
    tell("building families")
    columns = Columns.of(families_of(plant, scene, without), scene, setting.values)
    for _ in range(MOST_ROUNDS):
        tell("searching")
        best = points.best
        search = Search(Field(setting, columns, points.noises[best]))
        found = search.explanations()
        found = [e for e in found if e.score > found[0].score - priors.hopeless or not e.members][:RESCORED]
        # What fast causes make looks like noise until they are known.
        whites = [points.with_white(factor) for factor in WHITE_FACTORS]
        beside = [Field(setting, columns, p.noises[best], _nodes(found[:SURE])) for p in whites]
        likeliest = over_noises(found[:SURE], beside, [0.0] * len(beside))
        scores = np.logaddexp.reduce([e.log_prior + np.array(e.by_noise) for e in likeliest])
        settled = WHITE_FACTORS[int(np.argmax(scores))] == 1.0
        points = whites[int(np.argmax(scores))]
        fields = [Field(setting, columns, m, _nodes(found)) for m in points.noises]
        rescored = over_noises(found, fields, points.log_priors)
        by_noise = np.logaddexp.reduce([e.log_prior + np.array(e.by_noise) for e in rescored])
        points = points.judged(by_noise)
        if settled and points.best == best:
            break
        points = points.within(priors.hopeless)
    return Inference(model, plant, setting, columns, points, search, tuple(rescored), (*unusable, *more))


def _check_motion(scene: Scene) -> None:
    fit = scene.runs[: scene.fitted]
    moved = max(float(np.ptp(r.temperature)) for r in fit)
    if moved < LEAST_MOTION_DEGC and not any(np.any(r.run.rate) for r in fit):
        raise InputError(
            f"{', '.join(r.run.name for r in fit)}: temperature moves by {moved:.2g} degC in all; "
            f"a diagnosis needs a run in which it moves by {LEAST_MOTION_DEGC:g} degC or more"
        )


def _gap_length(setting: Setting, noise: NoiseModel) -> float:
    """Whitened length of the gap beside the constants, above noise."""
    whitening, fitted = Whitening(noise, setting), setting.scene.fitted
    data = whitening.stacked([r.gap for r in setting.scene.runs[:fitted]])
    left = LinearGaussian.of(data).beside(whitening.stacked(setting.fixed[:fitted])).gram(data[:, None])
    return math.sqrt(max(float(left[0, 0]) - len(data), 0.0))


def foreseen(model: TwinModel, runs: Sequence[Run], noise: NoiseModel, priors: Priors) -> Search:
    """A search on runs that hold no gap: it tells what they would, of noise that is known."""
    most = min(priors.most_rows, priors.most_of_all // len(runs))
    rows = tuple(rows_of(run, model.twin, most) for run in runs)
    scene = Scene(rows, len(rows), model.grade, candidates=candidates_of(model))
    setting = _setting(model, model.twin, scene, priors, noise)
    columns = Columns.of(families_of(model.twin, scene, ()), scene, setting.values)
    return Search(Field(setting, columns, noise))


def _nodes(explanations: Sequence[Explanation]) -> list[int]:
    return sorted({n for e in explanations for n, _ in e.nodes})


def _rows(
    runs: Sequence[Run], model: AnyModel, plant: Twin, most: int
) -> tuple[list[Rows], list[tuple[str, str]]]:
    usable, unusable = [], []
    own = None if isinstance(model, TwinModel) else model
    for run in runs:
        try:
            usable.append(rows_of(run, plant, most, own))
        except Unusable as error:
            unusable.append((run.name, str(error)))
    return usable, unusable


def _setting(model: AnyModel, plant: Twin, scene: Scene, priors: Priors, noise: NoiseModel) -> Setting:
    """Constants fitted beside nothing, those widened that are far off, and the fixed block at them."""
    constants = model.constants
    values = {c.name: c.mean for c in constants}
    widened: dict[str, float] = {}
    noises = [float(np.median(whitener_of(noise, r).deviation)) for r in scene.runs[: scene.fitted]]
    for _ in range(3):
        errors = [reading_errors(r, values, by) for r, by in zip(scene.runs[: scene.fitted], noises)]
        ends = np.cumsum([0, *(e.shape[1] for e in errors)])
        blocks = []
        for i, r in enumerate(scene.runs):
            wide = np.zeros((len(r), int(ends[-1])))
            if i < scene.fitted:
                wide[:, ends[i] : ends[i + 1]] = errors[i]
            own = fixed_columns(r, i, scene, plant, constants, widened, values, priors)
            blocks.append(np.concatenate([own, wide], axis=1))
        fixed = tuple(blocks)
        setting = Setting(scene, constants, priors, fixed, values, widened)
        whitening = Whitening(noise, setting)
        fitted = scene.fitted
        data = whitening.stacked([r.gap for r in scene.runs[:fitted]])
        found = Posterior.of(whitening.stacked(fixed[:fitted]), data)
        sd = setting.deviations
        values = {c.name: float(c.mean + s * x) for c, s, x in zip(constants, sd, found.mean)}
        off = {c.name: abs(values[c.name] - c.mean) / c.sd for c in constants}
        widened |= {name: 2.0 * z for name, z in off.items() if z > FAR_OFF}
    return replace(setting, values=values, fixed=fixed)


def over_noises(
    explanations: Sequence[Explanation], fields: Sequence[Field], log_priors: Sequence[float]
) -> list[Explanation]:
    """Explanations with their evidence at each noise, the likeliest first."""
    by_noise: list[list[float]] = [[] for _ in explanations]
    for held, log_prior in zip(fields, log_priors):
        data, first = held.base.data, held.fixed.shape[1]
        square = float(data @ data)
        every = np.concatenate([held.fixed, held.white], axis=1)
        gram, fits = every.T @ every, every.T @ data
        for e, row in zip(explanations, by_noise):
            places = [np.arange(first)] + [
                np.arange(first + held.at[n].start, first + held.at[n].stop)
                for n, _ in e.nodes
                if n in held.at
            ]
            size = np.concatenate(
                [np.ones(first), *(np.full(held.block(n).shape[1], s) for n, s in e.nodes if n in held.at)]
            )
            at = np.concatenate(places)
            scaled = gram[np.ix_(at, at)] * np.outer(size, size)
            value = log_evidence(scaled, fits[at] * size, square)
            row.append(value + e.spread + log_prior - held.whitening.log_det)
    told = [replace(e, by_noise=tuple(row)) for e, row in zip(explanations, by_noise)]
    return sorted(told, key=lambda e: -e.score)
