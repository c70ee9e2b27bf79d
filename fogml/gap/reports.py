"""What a diagnosis reports beside its verdict: candidates, constants, noise, series, amplitudes by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.special import logsumexp

from fogml.gap.basis import Basis
from fogml.gap.fitting import Fit
from fogml.gap.how_far import averages
from fogml.gap.model import Candidate, EffectValue, GyroModel
from fogml.gap.observation import Observation
from fogml.gap.result import (
    CandidateEvidence,
    ConstantFit,
    Found,
    NoiseReport,
    RunAmplitude,
    RunSeries,
)
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.search import Search
from fogml.signals.noise_expectation import floor_square
from fogml.signals.whiteness import whiteness

if TYPE_CHECKING:
    from fogml.gap.classes import Ranking
    from fogml.gap.preparing import Prepared

INCONSISTENT = 0.6
"""What is left of the probability of an effect whose runs disagree on its size."""
LEAST_LENGTH = 3.0
"""Whitened length under which an effect can't be shown."""


def candidate_evidence(
    search: Search,
    ranking: Ranking,
    basis: Basis,
    candidates: Mapping[str, Candidate],
    found: Sequence[Found],
) -> tuple[CandidateEvidence, ...]:
    """Each candidate alone, what the runs can show of it, and what became of it."""
    gains = search.field_.condition([]).node_gains()
    probability = {m: r.probability for r in ranking.effects for m in r.members}
    named = {m for f in found if f.named for m in f.members}
    rows = []
    for id, declared in candidates.items():
        status: Literal["named", "possible", "no_sign", "undetectable", "in_constants"]
        if id not in search.places:
            rows.append(CandidateEvidence(id, declared.title, declared.stage, 0.0, 0.0, 0.0, "in_constants"))
            continue
        nodes = search.places[id]
        usual = float(np.median([basis.nodes[i].usual for i in nodes]))
        held = probability.get(id, 0.0)
        if id in named:
            status = "named"
        elif usual < LEAST_LENGTH:
            status = "undetectable"
        else:
            status = "possible" if held >= 0.05 else "no_sign"
        gain = float(logsumexp(gains[nodes]))
        rows.append(CandidateEvidence(id, declared.title, declared.stage, gain, held, usual, status))
    return tuple(sorted(rows, key=lambda r: -r.gain))


def constant_fits(model: GyroModel, fit: Fit) -> tuple[ConstantFit, ...]:
    """The constants, before and after."""
    errors = fit.standard_errors
    return tuple(
        ConstantFit(c.name, c.unit, c.mean, c.sd, fit.constants[c.name], float(errors[c.name]))
        for c in model.constants
    )


def noise_report(p: Prepared, after: Fit) -> NoiseReport:
    """The noise, and whether the held-out runs' innovations are white by it."""
    model, errors = p.noise.model, p.noise.fit.standard_errors
    coefficients = {"N": model.N, "B": model.B, "K": model.K}
    spread = dict(zip("NBK", map(float, errors)))
    parts, rows = [], 0
    for o in p.held_out:
        whitener = RunWhitener(model, o, after.constants)
        gap = o.recorded - o.averaged(o.model.output(after.constants, after.effects))
        parts.append(whitener.whiten(gap - np.mean(gap)))
        rows += len(o)
    if rows < 64:
        return NoiseReport(coefficients, spread, p.noise.source)
    step = p.held_out[0].row_s
    check = whiteness(parts, sample_s=step)
    return NoiseReport(
        coefficients,
        spread,
        p.noise.source,
        bool(check.white),
        float(check.p_value),
        tuple(check.failed),
        tuple(float(x) * step for x in check.lags),
        tuple(map(float, check.autocorrelation)),
        tuple(float(x) * step for x in check.scales),
        tuple(map(float, check.variance_ratio)),
        rows,
    )


def run_series(p: Prepared, after: Fit) -> tuple[RunSeries, ...]:
    """Averages of every run for drawing."""
    return tuple(
        _series(p, o, role, after) for role, held in (("fit", p.fit), ("held_out", p.held_out)) for o in held
    )


def _series(p: Prepared, o: Observation, role: str, after: Fit) -> RunSeries:
    windows = averages(o)
    means = {c.name: c.mean for c in p.model.constants}
    reference = o.averaged(o.run.reference_deg_h)
    replays = {
        "before": o.averaged(o.model.output(means)),
        "recalibrated": o.averaged(o.model.output(p.recalibrated.constants, p.recalibrated.effects)),
        "after": o.averaged(o.model.output(after.constants, after.effects)),
    }
    temperature = windows.of(o.temperature)
    rate = (
        60.0 * np.gradient(temperature, windows.time) if len(temperature) > 1 else np.zeros(len(temperature))
    )
    return RunSeries(
        run=o.run.name,
        role="fit" if role == "fit" else "held_out",
        averaging_s=windows.window_s,
        time_s=windows.time,
        temperature_degc=temperature,
        rate_degc_min=rate,
        regime=o.regime[windows.starts[windows.full]],
        recorded=windows.of(o.recorded - reference),
        replayed_before=windows.of(replays["before"] - reference),
        replayed_recalibrated=windows.of(replays["recalibrated"] - reference),
        replayed_after=windows.of(replays["after"] - reference),
        gap_before=windows.of(o.recorded - replays["before"]),
        gap_recalibrated=windows.of(o.recorded - replays["recalibrated"]),
        gap_after=windows.of(o.recorded - replays["after"]),
        floor=floor_square(p.noise.fit.model, windows.time, windows.window_s) ** 0.5,
        gyro=o.run.facts.unit,
        axis=o.run.facts.axis,
        note=o.run.facts.notes or "",
    )


def with_run_amplitudes(p: Prepared, after: Fit, found: Sequence[Found]) -> tuple[Found, ...]:
    """Effects with their amplitude from each run alone, and whether those agree."""
    out = []
    for f in found:
        if f.effect not in {e.id for e in after.effects}:
            out.append(f)
            continue
        rows = [_amplitude(o, w, after, f) for o, w in zip(p.fit, p.whiteners)]
        shown = tuple(r for r in rows if r is not None)
        out.append(replace(f, by_run=shown, consistent=_agree(shown)))
    return tuple(out)


def _amplitude(o: Observation, whitener: RunWhitener, after: Fit, f: Found) -> RunAmplitude | None:
    """The amplitude that one run asks for, constants free, the rest as found."""
    own = next(e for e in after.effects if e.id == f.effect)
    step = 0.01 * own.amplitude or 1e-6
    moved = tuple(
        EffectValue(e.id, e.amplitude + step, e.shape) if e.id == f.effect else e for e in after.effects
    )
    output = o.model.output(after.constants, after.effects)
    response = whitener.whiten(o.averaged(o.model.output(after.constants, moved) - output) / step)
    left = whitener.whiten(o.recorded - o.averaged(output))
    columns = o.model.columns()
    fixed = whitener.whiten(np.column_stack([o.averaged(c) for c in columns.values()]))
    scale = np.linalg.norm(fixed, axis=0)
    basis, _ = np.linalg.qr(fixed[:, scale > 0.0] / scale[scale > 0.0])
    beside = response - basis @ (basis.T @ response)
    size = float(beside @ beside)
    if size <= 1e-4 * float(response @ response) or size * own.amplitude**2 < LEAST_LENGTH**2:
        return None
    return RunAmplitude(o.run.name, own.amplitude + float(beside @ left) / size, size**-0.5)


def _agree(rows: Sequence[RunAmplitude]) -> bool:
    """Whether amplitudes agree in sign and size, a tenth of their size allowed for what shapes differ."""
    if len(rows) < 2:
        return True
    values = np.array([r.value for r in rows])
    errors = np.array([r.se for r in rows])
    mean = float(np.average(values, weights=errors**-2))
    spread = np.hypot(errors, 0.1 * abs(mean))
    square = float(np.sum(((values - mean) / spread) ** 2))
    return bool(
        np.all(np.sign(values[np.abs(values) > 2.0 * errors]) == np.sign(mean)) and square < 4.0 * len(rows)
    )


def weighed_by_runs(found: Sequence[Found]) -> tuple[Found, ...]:
    """Effects that differ from run to run are less probable by `INCONSISTENT`."""
    return tuple(f if f.consistent else replace(f, probability=INCONSISTENT * f.probability) for f in found)
