"""What is doubtful in the runs of a diagnosis, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.noise import not_static
from fogml.numerals import percent, short
from fogml.runs.plausible import FACTORS
from fogml.runs.run import Run
from fogml.signals.shared import shared_samples

_UNITS = (FACTORS["deg/h taken for deg/s"], FACTORS["deg/h taken for rad/s"])


def doubts(found: Inference, recalibrated: Foretold, noise_run: Run | None, part: bool) -> tuple[str, ...]:
    """A noise run that is not static, replays of another sign or unit, samples in two runs, runs at one time.

    `part` says that the held-out run is a stretch of a fit run.
    """
    told = (*not_static(noise_run, found.setting.priors.noise), *_against(found, recalibrated))
    return told if part else (*told, *_shared(found), *_at_once(found))


def _against(found: Inference, recalibrated: Foretold) -> Iterator[str]:
    """Where recording and replay are of another sign or unit: as given, and held out."""
    scene = found.scene
    recorded = [r.samples(r.run.gyro_deg_h) for r in scene.runs]
    fit = range(scene.fitted)
    replayed = [recorded[i] - scene.runs[i].gap for i in fit]
    if doubt := other_way([recorded[i] for i in fit], replayed):
        yield f"What the model as given replays is {doubt}."
    for i in range(scene.fitted, len(scene.runs)):
        if doubt := other_way([recorded[i]], [recorded[i] - recalibrated.left_on(i)]):
            yield f"{scene.runs[i].run.name}: what the recalibrated twin replays is {doubt}."


def other_way(
    recorded: Sequence[FloatArray], replayed: Sequence[FloatArray], alike: float = 0.8, factor: float = 1.5
) -> str:
    """In words that replays are of another sign or unit than recordings; empty where not.

    Parameters
    ----------
    recorded, replayed
        Of each run [deg/h], shape (m,); they count about their means.
    alike
        Correlation, of either sign, from which on one is a multiple of the other.
    factor
        A multiple is -1, or one between units, within this factor: constants differ from unit to unit.
    """
    own, other = (np.concatenate([v - v.mean() for v in group]) for group in (recorded, replayed))
    squares = float(own @ own), float(other @ other)
    correlation = float(own @ other) / (squares[0] * squares[1]) ** 0.5 if min(squares) > 1e-18 else 0.0
    if abs(correlation) < alike:
        return ""
    times = (squares[0] / squares[1]) ** 0.5
    sign = "of the other sign" if correlation < 0.0 else ""
    if any(1.0 / factor < ratio < factor for unit in _UNITS for ratio in (times / unit, times * unit)):
        how = f"about {short(max(times, 1.0 / times), 2)} times {'less' if times > 1.0 else 'more'}"
        return f"{how}{f' and {sign}' if sign else ''} than was recorded: a unit may be wrong"
    if sign and 1.0 / factor < times < factor:
        return f"{sign} than what was recorded, and as large: a sign may be wrong"
    return ""


def _shared(found: Inference) -> Iterator[str]:
    scene = found.scene
    for i, j in combinations(range(len(scene.runs)), 2):
        if i >= scene.fitted:
            return
        fit, other = scene.runs[i].run, scene.runs[j].run
        share = shared_samples(other.gyro, fit.gyro)
        if share and j < scene.fitted:
            yield (
                f"{other.name} holds samples of {fit.name} (about {percent(share, 0)}): what they show "
                "counts twice."
            )
        elif share:
            yield (
                f"{other.name} holds samples of the fit run {fit.name} (about {percent(share, 0)}): its "
                "figures say how well the twin was fitted, not how far the gap closes."
            )


def _at_once(found: Inference) -> Iterator[str]:
    """Of runs that state when they started: those that were recorded at the same time by that."""
    scene = found.scene
    if not scene.order_known:
        return
    spans = [
        (begun + float(r.run.time[0]), begun + float(r.run.time[-1]), r)
        for begun, r in zip(scene.begun_s, scene.runs)
    ]
    for (from_s, to_s, a), (since_s, until_s, b) in combinations(spans, 2):
        both_s = min(to_s, until_s) - max(from_s, since_s)
        # A start that is rounded to minutes is no fault.
        if both_s > 60.0 + max(a.row_s, b.row_s):
            yield (
                f"{a.run.name} and {b.run.name} are of one unit and overlap by {short(both_s / 3600.0, 2)} h "
                "by their 'started', which is wrong in one of them: order, ageing and memory rest on it."
            )
