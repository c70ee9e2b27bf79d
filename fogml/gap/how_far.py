"""How far the gap closes on held-out runs with causes as their families foretell them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.card_form import Form
from fogml.gap.field import Member
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import Posterior
from fogml.gap.noise import white_noise
from fogml.gap.posterior import Cause
from fogml.gap.result_parts import HowFar
from fogml.gap.where import Averages, averages
from fogml.intervals import TAILS, Z90
from fogml.numerals import listed, short
from fogml.signals.distributions import root_of
from fogml.signals.noise_expectation import Fitted, expected_mean_square, floor_square, mean_square_draws
from fogml.signals.noise_model import NoiseModel
from fogml.twin.effect import Effect
from fogml.twin.twin import EffectSetting


@dataclass(frozen=True, eq=False)
class Foretold:
    """Constants and causes fitted together, and what they make of every run.

    Attributes
    ----------
    found
        The inference.
    members
        Causes that are fitted as their families have them.
    posterior
        Of coefficients: fixed block first, then each member's, then how far each form's unknowns are off.
    forms
        Effects that are fitted in their cards' form, by id, and their unknowns.
    replaced
        Effects of the model whose place forms take.
    """

    found: Inference
    members: tuple[Member, ...]
    posterior: Posterior
    forms: Mapping[str, tuple[Form, FloatArray]] = field(default_factory=dict)
    replaced: tuple[tuple[Effect, EffectSetting], ...] = ()

    @classmethod
    def of(cls, found: Inference, members: Sequence[Member]) -> Foretold:
        """Constants and members fitted together."""
        posterior = Posterior.of(found.field.design(members), found.field.base.data)
        return cls(found, tuple(members), posterior)

    def design(self, run: int) -> FloatArray:
        """Responses of the coefficients of constants and members on a run of the scene, (m, q) [deg/h]."""
        held = self.found.field
        parts = [self.found.setting.fixed[run]]
        for m in self.members:
            node = self.found.columns.nodes[m.node]
            parts.append(
                m.size * held.scale[m.node] * self.found.columns.by_run[run][:, node.start : node.stop]
            )
        return np.concatenate(parts, axis=1)

    def on(self, run: int) -> FloatArray:
        """What is foretold [deg/h], shape (m,); of a fit run with what errors of its readings made."""
        design, rows = self.design(run), self.found.scene.runs[run]
        total = np.asarray(design @ self.posterior.mean[: design.shape[1]])
        for form, unknowns in self.forms.values():
            total = total + form.on(run, unknowns)
        for declared, had in self.replaced:
            total = total - rows.made(declared, had.amplitude, had.shape, self.found.setting.values)
        if run < self.found.scene.fitted:
            total = total + self.found.field.whitening.runs[run].errors_in(rows.gap - total)
        return total

    def left_on(self, run: int) -> FloatArray:
        """Recorded less what is foretold [deg/h], shape (m,); of a held-out run beside `anew`."""
        return self._beside_anew(run, self.found.scene.runs[run].gap - self.on(run))

    @property
    def anew(self) -> list[str]:
        """Titles of causes of which each power cycle has a constant of its own: no run tells another's."""
        families, candidates = self.found.columns.families, self.found.scene.candidates
        held = [candidates.get(families[m.family].id) for m in self.members]
        drawn = (one.title for one in held if one is not None and one.family == "power_cycles")
        return list(dict.fromkeys(drawn))

    def _beside_anew(self, run: int, values: FloatArray) -> FloatArray:
        """Values on a run, shape (m, ...), less the mean of each power cycle of a held-out one."""
        if run < self.found.scene.fitted or not self.anew:
            return values
        rows = self.found.scene.runs[run]
        cycle = rows.even.power_cycle[rows.kept]
        means = {c: values[cycle == c].mean(axis=0) for c in np.unique(cycle).tolist()}
        return np.asarray(values - np.array([means[c] for c in cycle.tolist()]))

    def drawn_on(self, run: int, windows: Averages, rng: np.random.Generator) -> FloatArray:
        """Draws of what is foretold less what is, averaged over windows [deg/h], shape (k, draws)."""
        slopes = [form.slopes_on(run, unknowns) for form, unknowns in self.forms.values()]
        drawn = self.drawn(rng)
        columns = self._beside_anew(run, np.concatenate([self.design(run), *slopes], axis=1))
        return np.asarray(windows.of(columns) @ (drawn[:, 1:] - drawn[:, :1]))

    def of_cause(self, run: int, cause: Cause) -> FloatArray:
        """What one cause makes on a run [deg/h], with what the model has of it, shape (m,)."""
        if cause.ids[0] in self.forms:
            form, unknowns = self.forms[cause.ids[0]]
            return form.on(run, unknowns)
        rows, values = self.found.scene.runs[run], self.found.setting.values
        had = [
            rows.made(d, s.amplitude, s.shape, values) for d, s in self.found.plant.on if d.id == cause.ids[0]
        ]
        return np.asarray(np.sum([*had, *(self.of_member(run, m) for m in cause.members)], axis=0))

    def of_member(self, run: int, member: Member) -> FloatArray:
        """What one member makes on a run [deg/h], shape (m,)."""
        at = self.found.field.places(self.members)[self.members.index(member)]
        return np.asarray(self.design(run)[:, at] @ self.posterior.mean[at])

    def drawn(self, rng: np.random.Generator) -> FloatArray:
        """The mean of the coefficients, then draws from their posterior, shape (q, 1 + draws)."""
        draws = self.found.setting.priors.reported.draws
        root = root_of(self.posterior.covariance)
        off = np.concatenate([np.zeros((len(root), 1)), rng.standard_normal((len(root), draws))], axis=1)
        return np.asarray(self.posterior.mean[:, None] + root @ off)


class HeldOut:
    """One held-out run: what is common to all that is asked of it.

    `members` are causes of the likeliest set: what they make is no noise. `seed` is of draws behind
    intervals.
    """

    def __init__(
        self, found: Inference, run: int, recalibrated: Foretold, members: Sequence[Member], seed: int
    ) -> None:
        self.run, self.rows = run, found.setting.scene.runs[run]
        self._settings = settings = found.setting.priors.reported
        self._rng = np.random.default_rng([seed, run])
        self._windows = windows = averages(self.rows, settings.averaging_s)
        model, self._noisier = _own_noise(found, run, members)
        self._before = _square(windows.of(self.rows.gap))
        left = windows.of(recalibrated.left_on(run))
        self._recalibrated = _square(left)
        self._floor = float(floor_square(model, windows.time, windows.window_s))
        as_much = model.N / found.field.whitening.noise.N
        drawn = found.points.fit.draw(self._rng, settings.draws)
        models = [replace(m, N=as_much * m.N) for m in drawn]
        self._floors = np.array([floor_square(m, windows.time, windows.window_s) for m in models])
        self._noises = self._drawn(model, None)
        # Of what the twin has and each run draws anew a replay holds one deviation; the run has its own.
        own = [(d, s) for d, s in found.plant.on if d.drawn_per_run]
        self._anew = [d.title for d, _ in own]
        deviations = [self.rows.made(d, s.amplitude, s.shape, found.setting.values) for d, s in own]
        apart = self._rng.standard_normal((len(self._noises), len(own))) - 1.0
        self._noises = self._noises + apart**2 @ np.array([_square(windows.of(one)) for one in deviations])
        self._loudest = float(self._noises.mean()) + Z90 * float(np.std(self._noises))
        level = self._recalibrated > self._loudest
        # Slow noise moves a run's mean more than its shape, which may show a gap where the level doesn't.
        about = self._drawn(model, Fitted(np.ones((len(windows.time), 1)), ordinary=True))
        varied = float(np.var(left))
        shape = varied - self._floor > Z90 * float(np.std(about))
        self._at_floor = not level and not shape

    def _drawn(self, model: NoiseModel, fitted: Fitted | None) -> FloatArray:
        """Mean squares of noises on the run's windows, their mean the expected one."""
        windows = self._windows
        expected = expected_mean_square(model, windows.time, windows.window_s, fitted=fitted)
        count = self._settings.noises
        drawn = mean_square_draws(model, windows.time, windows.window_s, count, self._rng, fitted=fitted)
        # One window about its own mean leaves nothing.
        return np.asarray(drawn / (float(drawn.mean()) or 1.0) * expected)

    def how_far(self, after: Foretold) -> HowFar:
        """Before, recalibrated, after and floor, and what is closed.

        With nothing named, `after` is constants alone. The interval holds errors of what is fitted and an
        uncertain floor.
        """
        windows, rec, floor = self._windows, self._recalibrated, self._floor
        left = after.left_on(self.run)
        aft = _square(windows.of(left))
        closed, interval = None, None
        draws, least = self._settings.draws, self._settings.least_gap
        within = "at the floor within its noise"
        if rec > floor and self._anew:
            within = f"within noise and what is drawn anew on each run ({listed(self._anew)})"
        said = [self._noisier] if self._noisier else []
        if self._at_floor:
            said.append(f"the recalibrated twin is {within}: what is closed can't be told")
        else:
            if after.anew:
                said.append(f"beside a constant of the run's own ({listed(after.anew)})")
            if aft > rec:
                said.append("the run is foretold worse with what was found than without")
            gap = rec - floor
            closed = (rec - aft) / gap
            moved = np.zeros(draws)
            if after.members or after.forms:
                if rec >= aft > self._loudest:
                    said.append(
                        "what is left is beyond noise; against the twin that is written more may be named"
                    )
                off = after.drawn_on(self.run, windows, self._rng)
                moved = np.mean((windows.of(left)[:, None] - off) ** 2, axis=0) - aft
            room = np.maximum(aft - self._rng.choice(self._noises, draws), 0.0)
            closing = rec - aft + np.minimum(moved, room)
            drawn = closing / np.maximum(rec - self._rng.choice(self._floors, draws), least * gap)
            low, high = np.quantile(drawn, TAILS)
            interval = min(float(low), closed), max(float(high), closed)
        return HowFar(
            run=self.rows.run.name,
            averaging_s=windows.window_s,
            before=self._before**0.5,
            recalibrated=rec**0.5,
            after=aft**0.5,
            floor=floor**0.5,
            closed=closed,
            closed_ci90=interval,
            note="; ".join(said),
        )


def _own_noise(found: Inference, run: int, members: Sequence[Member]) -> tuple[NoiseModel, str]:
    """The noise of a held-out run, white as it is itself where that differs beyond chance.

    And words where the fit runs' own differs, too: what no form holds of a cause may count as noise there.
    """
    model, scene = found.field.whitening.noise, found.setting.scene
    settings = found.setting.priors.noise
    nodes = [found.columns.nodes[m.node] for m in members]

    def white(i: int) -> tuple[float, int]:
        made = [found.columns.by_run[i][:, n.start : n.stop] for n in nodes]
        return white_noise(scene.runs[i], settings.noiseless * found.points.prior.centre.N, made)

    own, count = white(run)
    # The median of so many second differences is told to about 1.4 over their root.
    chance = 3.0 * 1.4 / math.sqrt(count) if count else math.inf
    least = max(chance, math.log(settings.unit_factor))
    if abs(math.log(own / model.N)) < least:
        return model, ""
    times = own / float(np.median([white(i)[0] for i in range(scene.fitted)]))
    if abs(math.log(times)) < least:
        return replace(model, N=own), ""
    apart = f"{'' if times > 1.0 else 'only '}{short(times, 2)} times"
    said = f"white noise of this run is {apart} that of the others; its floor is its own"
    return replace(model, N=own), said


def _square(values: FloatArray) -> float:
    return float(np.mean(values**2))
