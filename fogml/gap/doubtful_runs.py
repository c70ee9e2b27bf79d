"""What is doubtful in the runs of a diagnosis, in sentences."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from fogml.gap.inference import Inference
from fogml.gap.noise import not_static
from fogml.numerals import percent, short
from fogml.runs.run import Run
from fogml.signals.shared import shared_samples


def doubts(found: Inference, noise_run: Run | None, part: bool) -> tuple[str, ...]:
    """A noise run that is no static one, samples in two runs, runs of one unit at the same time.

    `part` says that the held-out run is a stretch of a fit run.
    """
    told = not_static(noise_run, found.setting.priors.noise)
    return told if part else (*told, *_shared(found), *_at_once(found))


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
