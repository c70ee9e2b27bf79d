"""The runs of a diagnosis: which may go together, and what is held out where no run is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.gap.catalogue import families_of
from fogml.gap.field import Columns, Field, Member
from fogml.gap.frame import Setting, gap_length, setting_of, with_form_errors
from fogml.gap.linear_gaussian import log_evidence
from fogml.gap.model import AnyModel, TwinModel
from fogml.gap.noise import NoisePoints, first_noise, noise_points, prior_of
from fogml.gap.own_simulator import candidates_of, plant_of
from fogml.gap.reading import Unusable, rows_of
from fogml.gap.rows import Rows
from fogml.gap.scene import Scene, outstanding_lines
from fogml.gap.search import Explanation, Search
from fogml.gap.settings import Priors
from fogml.gap.step_settings import RowSettings
from fogml.numerals import short
from fogml.runs.checks import refuse_dead
from fogml.runs.run import Run
from fogml.runs.turning import turning
from fogml.signals.large import empty
from fogml.signals.noise_model import NoiseModel
from fogml.twin.twin import Twin


def check_runs(fit: Sequence[Run], held_out: Sequence[Run], noise: Run | None) -> None:
    """Refuse runs that can't be diagnosed together."""
    if not fit:
        raise InputError("no run to diagnose is given")
    static = () if noise is None else (noise,)
    every = (*fit, *held_out, *static)
    refuse_dead(every)
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
    if noise is not None and noise.hash in held:
        role, _ = held[noise.hash]
        raise InputError(
            f"{noise.name}: given as a {role} run and as the noise run too; give a static run of its own"
        )
    units = {run.facts.unit: run.name for run in every if run.facts.unit}
    axes = {run.facts.axis: run.name for run in every if run.facts.axis}
    for what, stated in (("unit", units), ("axis", axes)):
        if len(stated) > 1:
            listed = ", ".join(f"{name} is {what} {value}" for value, name in stated.items())
            raise InputError(f"the runs are of different {what}s ({listed}); diagnose one {what} at a time")


def keep_back(
    fit: Sequence[Run], share: float = RowSettings.kept_back
) -> tuple[Sequence[Run], Sequence[Run]]:
    """Fit runs less the last stretch of the last one, a share of it, and that."""
    last = fit[-1]
    cut = int(len(last) * (1.0 - share))
    return [*fit[:-1], last[:cut]], [last[cut:]]


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
    search
        At the noise that fits best.
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

    @property
    def scene(self) -> Scene:
        """Its runs."""
        return self.setting.scene

    def meeting(self, values: Mapping[str, float]) -> Inference:
        """The same with effects' forms as they meet the output of other constants."""
        search, held = copy(self.search), copy(self.field)
        held.setting = self.setting.at(values)
        search.field = held
        return replace(self, setting=held.setting, search=search)

    def put_away(self) -> Inference:
        """The same with all columns in temporary files, for when it is one of many."""
        for key in [key for key in self.scene.cache if key[0] == "loops"]:
            del self.scene.cache[key]  # of which the columns are made
        columns = replace(self.columns, by_run=tuple(map(_put_away, self.columns.by_run)))
        search, held = copy(self.search), copy(self.field)
        held.columns, held.white = columns, _put_away(held.white)
        search.field, search.cached_rows = held, {}
        return replace(self, columns=columns, search=search)

    def kind(self, member: Member) -> str:
        """Kind of a member's family."""
        return self.columns.families[member.family].kind


def infer(
    model: AnyModel,
    fit: Sequence[Run],
    held_out: Sequence[Run],
    noise: Run | None,
    without: Iterable[str],
    priors: Priors,
    tell: Progress = lambda what: None,
    since_s: float = -math.inf,
) -> Inference:
    """The posterior of the causes behind the fit runs; held-out ones are judged from `since_s` on [s].

    Raises
    ------
    InputError
        If runs are too many, none can be used, or no temperature moves.
    """
    tell("reading inputs")
    plant = plant_of(model)
    most = min(priors.most_rows, priors.most_of_all // max(len(fit), 1))
    # The first rows of a run, and those after its gaps, are lost.
    least = 2 * priors.rows.fewest
    if most < least:
        several = priors.most_of_all // least
        raise InputError(f"{len(fit)} runs to fit on: a diagnosis takes {several} at most; give the longest")
    runs, unusable = _rows(fit, model, plant, most, priors.rows)
    if not runs:
        raise InputError("; ".join(reason for _, reason in unusable))
    # A stretch that was kept back has as many rows as a run of its own.
    kept_back = since_s > -math.inf
    most = math.ceil(most / priors.rows.kept_back) if kept_back else most
    held, more = _rows(held_out, model, plant, most, priors.rows, since_s)
    if kept_back:
        # Of a run that is not used its part is none either.
        unused = {name for name, _ in unusable}
        more = [(f"{name}, kept-back part", reason) for name, reason in more if name not in unused]
    scene = Scene((*runs, *held), len(runs), model.grade, (), candidates_of(model), priors.grids)
    _check_motion(scene, priors.rows.least_motion_degc)
    scene = replace(scene, lines_hz=outstanding_lines(scene))
    prior, source = prior_of(model, noise, priors.noise)
    first = first_noise(scene, prior, priors.noise)
    setting = setting_of(model, plant, scene, priors, first)
    length = gap_length(setting, first)
    priors = priors.reaching(length)
    setting = with_form_errors(replace(setting, priors=priors), first, length)
    tell("fitting the noise")
    points = noise_points(setting, prior, source, noise, priors.hopeless)
    setting = setting_of(model, plant, scene, priors, points.fit.model)
    setting = with_form_errors(setting, points.fit.model, length)
    tell("building families")
    columns = Columns.of(families_of(plant, scene, without), setting.scene)
    how, factors = priors.search, priors.noise.white_factors
    search: Search | None = None
    for _ in range(how.rounds):
        tell("searching")
        search = None  # its columns make room for those at the new noise
        best = points.best
        search = Search(Field(setting, columns, points.noises[best]))
        found = search.explanations()
        near = found[0].score - priors.hopeless
        # That nothing acts is asked at every noise: it may be far behind at one alone.
        found = [e for i, e in enumerate(found) if (i < how.rescored and e.score > near) or not e.members]
        # What fast causes make looks like noise until they are known.
        whites = [points.with_white(factor) for factor in factors]
        sure = found[: how.sure]
        # One after the other: each is as large as all rows by all columns.
        beside = (Field(setting, columns, p.noises[best], _nodes(sure)) for p in whites)
        likeliest = over_noises(sure, beside, [0.0] * len(whites))
        scores = np.logaddexp.reduce([e.log_prior + np.array(e.by_noise) for e in likeliest])
        settled = factors[int(np.argmax(scores))] == 1.0
        points = whites[int(np.argmax(scores))]
        points, rescored = _over_all_noises(found, setting, columns, points)
        if settled and points.best == best:
            break
        points = points.within(priors.hopeless)
    assert search is not None
    return Inference(model, plant, setting, columns, points, search, tuple(rescored), (*unusable, *more))


def _check_motion(scene: Scene, least_degc: float) -> None:
    moved = max(float(np.ptp(r.temperature)) for r in scene.fit)
    if moved < least_degc and not any(turning(r.run).any() for r in scene.fit):
        raise InputError(
            f"{', '.join(r.run.name for r in scene.fit)}: temperature moves by {short(moved, 2)} degC in "
            f"all; a diagnosis needs a run in which it moves by {least_degc:g} degC or more"
        )


def foreseen(model: TwinModel, runs: Sequence[Run], noise: NoiseModel, priors: Priors) -> Search:
    """A search on runs that hold no gap: it tells what they would, of noise that is known."""
    most = min(priors.most_rows, priors.most_of_all // len(runs))
    rows = tuple(rows_of(run, model.twin, most, settings=priors.rows) for run in runs)
    scene = Scene(rows, len(rows), model.grade, (), candidates_of(model), priors.grids)
    setting = setting_of(model, model.twin, scene, priors, noise)
    columns = Columns.of(families_of(model.twin, scene), setting.scene)
    return Search(Field(setting, columns, noise))


def _put_away(values: FloatArray) -> FloatArray:
    """A copy in a file of no name, whose memory `fogml.signals.large.release` lets go of."""
    away = empty(values.size, held=0)
    away[:] = values.ravel()
    return np.asarray(away.reshape(values.shape))


def _nodes(explanations: Sequence[Explanation]) -> list[int]:
    return sorted({m.node for e in explanations for m in e.members})


def _rows(
    runs: Sequence[Run],
    model: AnyModel,
    plant: Twin,
    most: int,
    settings: RowSettings,
    since_s: float = -math.inf,
) -> tuple[list[Rows], list[tuple[str, str]]]:
    usable, unusable = [], []
    own = None if isinstance(model, TwinModel) else model
    for run in runs:
        try:
            usable.append(rows_of(run, plant, most, own, settings, since_s=since_s))
        except Unusable as error:
            unusable.append((run.name, str(error)))
    return usable, unusable


def _over_all_noises(
    found: Sequence[Explanation], setting: Setting, columns: Columns, points: NoisePoints
) -> tuple[NoisePoints, list[Explanation]]:
    """Noises as likely as they are beside explanations, and these at each noise, the likeliest first."""
    nodes, told = _nodes(found), [replace(e, by_noise=()) for e in found]
    more: NoisePoints | None = points
    while more is not None:
        fields = (Field(setting, columns, noise, nodes) for noise in more.noises)
        told = over_noises(told, fields, more.log_priors)
        points = points if more is points else points.and_more(more)
        by_noise = np.logaddexp.reduce([e.log_prior + np.array(e.by_noise) for e in told])
        points = replace(points, log_posteriors=by_noise)
        more = points.beyond(setting.priors.slow_noise)
    return points, told


def over_noises(
    explanations: Sequence[Explanation], fields: Iterable[Field], log_priors: Sequence[float]
) -> list[Explanation]:
    """Explanations with their evidence at further noises, the likeliest first."""
    by_noise = [list(e.by_noise) for e in explanations]
    for held, log_prior in zip(fields, log_priors):
        data, first = held.base.data, held.fixed.shape[1]
        square = float(data @ data)
        every = np.concatenate([held.fixed, held.white], axis=1)
        gram, fits = every.T @ every, every.T @ data
        for e, row in zip(explanations, by_noise):
            shown = [(held.at[m.node], m.size) for m in e.members if m.node in held.at]
            places = [np.arange(first + span.start, first + span.stop) for span, _ in shown]
            sizes = [np.full(span.stop - span.start, size) for span, size in shown]
            at = np.concatenate([np.arange(first), *places])
            size = np.concatenate([np.ones(first), *sizes])
            scaled = gram[np.ix_(at, at)] * np.outer(size, size)
            value = log_evidence(scaled, fits[at] * size, square)
            row.append(value + e.spread + log_prior - held.whitening.log_det)
    told = [replace(e, by_noise=tuple(row)) for e, row in zip(explanations, by_noise)]
    return sorted(told, key=lambda e: -e.score)
