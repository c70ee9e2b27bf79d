"""From runs to a posterior over sets of causes: one way, whatever the runs are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.errors import InputError
from fogml.gap.families.catalogue import families_of
from fogml.gap.families.frame import Columns, Field, Setting, Whitening, fixed_columns
from fogml.gap.families.linear_gaussian import Posterior, size_gains
from fogml.gap.families.making_rows import Unusable, rows_of
from fogml.gap.families.noise_points import NoisePoints, noise_points
from fogml.gap.families.other_families import LINES
from fogml.gap.families.places import Scene
from fogml.gap.families.priors import Priors
from fogml.gap.families.rows import Rows
from fogml.gap.families.search import Explanation, Search, over_noises
from fogml.gap.families.spectral_lines import outstanding_lines
from fogml.gap.families.unknown import unknown_families
from fogml.gap.noise import prior_of
from fogml.gap.twin_model import TwinModel
from fogml.runs.run import Run

FAR_OFF = 3.0
"""Prior standard deviations from which on a constant is said to be far off, and its prior widened."""
RESCORED = 50
"""Sets whose evidence is taken at every noise."""
SMOOTH = ("time_7200", "time_2400", "temperature_25", "past")
"""Unknowns beside which the first noise is chosen."""
SMOOTH_PRICE = 5.0
"""What one of them costs there [nats]: sizes and odds."""
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
    runs, unusable = _rows(fit, model, priors)
    if not runs:
        raise InputError("; ".join(reason for _, reason in unusable))
    held, more = _rows(held_out, model, priors)
    scene = Scene((*runs, *held), len(runs), model.grade)
    prior, source = prior_of(model, noise)
    setting = _setting(model, scene, priors, prior.centre)
    tell("fitting the noise")
    points = noise_points(setting, prior, source)
    setting = _setting(model, scene, priors, points.fit.model)
    scene = replace(scene, lines_hz=outstanding_lines(scene, LINES))
    setting = replace(setting, scene=scene)
    tell("building families")
    columns = Columns.of(families_of(model.twin, scene, without), scene, setting.values)
    best = likeliest_noise(setting, points)
    for _ in range(2):
        tell("searching")
        search = Search(Field(setting, columns, points.noises[best]))
        found = search.explanations()[:RESCORED]
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


def likeliest_noise(setting: Setting, points: NoisePoints) -> int:
    """The noise that explains the runs best beside smooth unknowns."""
    scene = setting.scene
    smooth = [f for f in unknown_families() if f.id in SMOOTH]
    columns = Columns.of(smooth, scene, setting.values)
    scores = []
    for noise, log_prior in zip(points.noises, points.log_priors):
        held = Field(setting, columns, noise)
        evidence = [held.base.log_evidence]
        for i in held.at:
            block = held.block(i)
            gains = size_gains(held.base.gram(block), held.base.fits(block), setting.priors.lengths)
            evidence.append(held.base.log_evidence + float(np.logaddexp.reduce(gains)) - SMOOTH_PRICE)
        scores.append(float(np.logaddexp.reduce(evidence)) + log_prior - held.whitening.log_det)
    return int(np.argmax(scores))


def _rows(runs: Sequence[Run], model: TwinModel, priors: Priors) -> tuple[list[Rows], list[tuple[str, str]]]:
    usable, unusable = [], []
    for run in runs:
        try:
            usable.append(rows_of(run, model.twin, priors))
        except Unusable as error:
            unusable.append((run.name, str(error)))
    return usable, unusable


def _setting(model: TwinModel, scene: Scene, priors: Priors, noise: object) -> Setting:
    """Constants fitted beside nothing, those widened that are far off, and the fixed block at them."""
    constants = model.constants
    values = {c.name: c.mean for c in constants}
    widened: dict[str, float] = {}
    for _ in range(3):
        fixed = tuple(
            fixed_columns(r, i, scene, model.twin, constants, widened, values, priors)
            for i, r in enumerate(scene.runs)
        )
        setting = Setting(scene, constants, priors, fixed, values, widened)
        whitening = Whitening(noise, setting)  # type: ignore[arg-type]
        fitted = scene.fitted
        data = whitening.stacked([r.gap for r in scene.runs[:fitted]])
        found = Posterior.of(whitening.stacked(fixed[:fitted]), data)
        sd = setting.deviations
        values = {c.name: float(c.mean + s * x) for c, s, x in zip(constants, sd, found.mean)}
        off = {c.name: abs(values[c.name] - c.mean) / c.sd for c in constants}
        widened |= {name: 2.0 * z for name, z in off.items() if z > FAR_OFF}
    return replace(setting, values=values, fixed=fixed)
