"""From runs to a posterior over sets of causes: one way, whatever the runs are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.errors import InputError
from fogml.gap.families.catalogue import families_of
from fogml.gap.families.frame import (
    Columns,
    Field,
    Setting,
    Whitening,
    fixed_columns,
    reading_errors,
)
from fogml.gap.families.linear_gaussian import Posterior
from fogml.gap.families.making_rows import Unusable, rows_of
from fogml.gap.families.noise_points import NoisePoints, first_noise, noise_points
from fogml.gap.families.other_families import LINES
from fogml.gap.families.places import Scene
from fogml.gap.families.priors import Priors
from fogml.gap.families.rows import Rows
from fogml.gap.families.search import Explanation, Search, over_noises
from fogml.gap.families.spectral_lines import outstanding_lines
from fogml.gap.noise import prior_of
from fogml.gap.twin_model import TwinModel
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel

FAR_OFF = 3.0
"""Prior standard deviations from which on a constant is said to be far off, and its prior widened."""
RESCORED = 40
"""Sets whose evidence is taken at every noise."""
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Inference:
    """Everything known of the causes behind the fit runs.

    Attributes
    ----------
    model
        The twin.
    setting, columns, points
        Runs and constants; families' blocks; noises.
    fields
        Whitened by each noise; the one that fits best holds all blocks, others those that are asked for.
    best
        Which noise fits best.
    search
        At that noise.
    explanations
        The likeliest first.
    unusable
        Runs that could not be used, with the reason.
    """

    model: TwinModel
    setting: Setting
    columns: Columns
    points: NoisePoints
    search: Search
    best: int
    explanations: tuple[Explanation, ...]
    unusable: tuple[tuple[str, str], ...]

    @property
    def field(self) -> Field:
        """At the noise that fits best."""
        return self.search.field

    @property
    def probabilities(self) -> np.ndarray:
        """Of each explanation, shape (n,)."""
        scores = np.array([e.score for e in self.explanations])
        weights = np.exp(scores - scores.max())
        return np.asarray(weights / weights.sum())


def infer(
    model: TwinModel,
    fit: Sequence[Run],
    held_out: Sequence[Run],
    noise: Run | None,
    without: Iterable[str],
    priors: Priors,
    tell: Progress = lambda what: None,
) -> Inference:
    """The posterior of the causes behind the fit runs."""
    tell("reading inputs")
    most = min(priors.most_rows, priors.most_of_all // max(len(fit), 1))
    runs, unusable = _rows(fit, model, most)
    if not runs:
        raise InputError("; ".join(reason for _, reason in unusable))
    held, more = _rows(held_out, model, most)
    scene = Scene((*runs, *held), len(runs), model.grade)
    prior, source = prior_of(model, noise)
    setting = _setting(model, scene, priors, prior.centre)
    setting = _setting(model, scene, priors, first_noise(setting, prior))
    tell("fitting the noise")
    points = noise_points(setting, prior, source, noise, 0.5 * priors.hopeless)
    setting = _setting(model, scene, priors, points.fit.model)
    scene = replace(scene, lines_hz=outstanding_lines(scene, LINES))
    setting = replace(setting, scene=scene)
    tell("building families")
    columns = Columns.of(families_of(model.twin, scene, without), scene, setting.values)
    best = points.best
    for _ in range(2):
        tell("searching")
        search = Search(Field(setting, columns, points.noises[best]))
        found = search.explanations()
        found = [e for e in found if e.score > found[0].score - priors.hopeless or not e.members][:RESCORED]
        only = sorted({n for e in found for n, _ in e.nodes})
        fields = [Field(setting, columns, m, only) for m in points.noises]
        rescored = over_noises(found, fields, points.log_priors)
        total = np.array([np.logaddexp.reduce([e.log_prior + e.by_noise[i] for e in rescored])
                          for i in range(len(fields))])  # fmt: skip
        likeliest = int(np.argmax(total))
        if likeliest == best:
            break
        best = likeliest
    return Inference(model, setting, columns, points, search, best, tuple(rescored), (*unusable, *more))


def _rows(runs: Sequence[Run], model: TwinModel, most: int) -> tuple[list[Rows], list[tuple[str, str]]]:
    usable, unusable = [], []
    for run in runs:
        try:
            usable.append(rows_of(run, model.twin, most))
        except Unusable as error:
            unusable.append((run.name, str(error)))
    return usable, unusable


def _setting(model: TwinModel, scene: Scene, priors: Priors, noise: NoiseModel) -> Setting:
    """Constants fitted beside nothing, those widened that are far off, and the fixed block at them."""
    constants = model.constants
    values = {c.name: c.mean for c in constants}
    widened: dict[str, float] = {}
    for _ in range(3):
        errors = [
            reading_errors(r, values, float(np.sqrt(noise.white_density / r.row_s)))
            for r in scene.runs[: scene.fitted]
        ]
        ends = np.cumsum([0, *(e.shape[1] for e in errors)])
        blocks = []
        for i, r in enumerate(scene.runs):
            wide = np.zeros((len(r), int(ends[-1])))
            if i < scene.fitted:
                wide[:, ends[i] : ends[i + 1]] = errors[i]
            own = fixed_columns(r, i, scene, model.twin, constants, widened, values, priors)
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
