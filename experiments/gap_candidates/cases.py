"""A simulated unit with one effect at a stated size d', and what truth there is to judge by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fogml.gap.how_far import averages
from fogml.gap.model import EffectValue
from fogml.gap.observation import observe
from fogml.gap.result import Found
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.seen_as import AS_CANDIDATE
from fogml.gap.twin_model import TwinModel
from fogml.runs.run import FloatArray, Run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.nominal import PRIOR_SD
from fogml.twin.programme import load_programme
from fogml.twin.quantities import Quantity
from fogml.twin.registry import effect
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin
from fogml.yaml_text import read_yaml

CONFIG: dict[str, Any] = read_yaml(Path(__file__).with_name("config.yaml"))
_ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Case:
    """Runs of a unit with one effect.

    Attributes
    ----------
    fit, held_out
        The runs.
    amplitude, d_prime
        Size of the effect, in its unit and as a whitened length beside the constants.
    share
        Part of its whitened length that is left beside the constants.
    unit
        The twin that made them.
    """

    id: str
    fit: tuple[Run, ...]
    held_out: Run
    amplitude: float
    d_prime: float
    share: float
    unit: Twin


class Bench:
    """The unit, its runs without an effect, and lengths beside the constants."""

    def __init__(self) -> None:
        self.nominal = load_twin(CONFIG["twin"])
        rng = np.random.default_rng(CONFIG["seed"])
        drawn = {name: float(sd * rng.standard_normal()) for name, sd in asdict(PRIOR_SD).items()}
        self.unit = self.nominal.with_nominal(**drawn)
        self.values = drawn
        self.model = TwinModel(self.nominal)
        self.plain = [self._run(self.unit, number) for number in range(3)]
        noise = self.nominal.noise
        observations = [observe(run, self.model) for run in self.plain[:2]]
        self.observations = observations
        model = NoiseModel(noise.N, noise.B, noise.K)
        self._whiteners = [RunWhitener(model, o, drawn) for o in observations]
        columns = [o.model.columns() for o in observations]
        fixed = self._white(
            [
                np.column_stack([o.averaged(c) for c in held.values()])
                for o, held in zip(observations, columns)
            ]
        )
        self._constants = np.linalg.qr(fixed / np.linalg.norm(fixed, axis=0))[0]
        soak = load_programme([f"soak at 25 degC for {CONFIG['static_h']} h"])
        still = self.unit.simulate(soak, sample_s=CONFIG["sample_s"], seed=CONFIG["seed"] + 90).run
        self.static = replace(still, name="static")

    def case(self, id: str) -> Case:
        """The unit with an effect whose size is that of the configuration, or as near as limits allow."""
        declared = effect(id)
        shape = {q.name: _typical(q, self.nominal.grade) for q in declared.shape}
        amplitude, held = declared.amplitude.typical(self.nominal.grade), 0.0
        for _ in range(_ROUNDS):
            twin = self.unit.with_effect(id, amplitude, **shape)
            runs = [self._run(twin, number) for number in range(2)]
            signal = self._signal(runs)
            raw, held = float(np.linalg.norm(signal)), float(np.linalg.norm(self._beside(signal)))
            share = held / raw if raw > 0.0 else 0.0
            if share < CONFIG["least_share"] or abs(held / CONFIG["d_prime"] - 1.0) < 0.02:
                break
            amplitude = float(np.clip(amplitude * CONFIG["d_prime"] / held, *declared.amplitude.limits))
        runs.append(self._run(twin, 2))
        amplitude = twin.settings[id].amplitude
        return Case(id, tuple(runs[:2]), runs[2], amplitude, held, share, twin)

    def closed_by_truth(self, case: Case, recalibrated: float, floor: float) -> float:
        """What the true constants and the true effect close on the held-out run."""
        o = observe(case.held_out, self.model)
        setting = case.unit.settings[case.id]
        true = EffectValue(case.id, setting.amplitude, dict(setting.shape))
        gap = averages(o).of(o.recorded - o.averaged(o.model.output(self.values, (true,))))
        return float((recalibrated**2 - np.mean(gap**2)) / (recalibrated**2 - floor**2))

    def likeness(self, case: Case, found: Found) -> float:
        """Absolute cosine of a found effect with the true contribution, beside the constants.

        A line has a phase of its own on every run: that of its best fit.
        """
        if getattr(AS_CANDIDATE.get(found.effect), "drawn_per_run", False):
            return self._likeness_of_line(case, found)
        shape = effect(found.effect).default_shape() | {k: v.value for k, v in found.parameters.items()}
        named = EffectValue(found.effect, found.amplitude.value, shape)
        parts = [
            o.averaged(o.model.output(self.values, (named,)) - o.model.output(self.values))[:, None]
            for o in self.observations
        ]
        a, b = self._beside(self._white(parts)[:, 0]), self._beside(self._signal(list(case.fit)))
        return float(abs(a @ b) / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-300))

    def _likeness_of_line(self, case: Case, found: Found) -> float:
        shape = {name: estimate.value for name, estimate in found.parameters.items()}
        columns = []
        for place in range(len(self.observations)):
            for phase in (0.0, 90.0):
                parts = [
                    o.averaged(o.model.response(found.effect, shape | {"phase": phase}, self.values))
                    * (number == place)
                    for number, o in enumerate(self.observations)
                ]
                columns.append(self._beside(self._white([part[:, None] for part in parts])[:, 0]))
        signal, held = self._beside(self._signal(list(case.fit))), np.linalg.qr(np.column_stack(columns))[0]
        return float(np.linalg.norm(held.T @ signal) / max(np.linalg.norm(signal), 1e-300))

    def _run(self, twin: Twin, number: int) -> Run:
        name = [*CONFIG["fit"], CONFIG["held_out"]][number]
        run = twin.simulate(name, sample_s=CONFIG["sample_s"], seed=CONFIG["seed"] + number).run
        return replace(run, name=name, facts=run.facts.model_copy(update={"unit": "unit"}))

    def _signal(self, runs: Sequence[Run]) -> FloatArray:
        """What an effect makes of recorded less replayed: with it less without, noise the same; whitened."""
        return self._white(
            [
                self._gap(run, o)[:, None] - self._gap(plain, o)[:, None]
                for run, plain, o in zip(runs, self.plain, self.observations)
            ]
        )[:, 0]

    def _gap(self, run: Run, o: Any) -> FloatArray:
        """Recorded less replayed at the true constants, on the rows of an observation."""
        output = self.model.on(run).output(self.values)
        gap = np.interp(o.run.time, run.time, run.gyro_deg_h - output)
        return np.asarray(o.averaged(gap))

    def _white(self, columns: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate([w.whiten(c) for w, c in zip(self._whiteners, columns)])

    def _beside(self, signal: FloatArray) -> FloatArray:
        return np.asarray(signal - self._constants @ (self._constants.T @ signal))


def _typical(quantity: Quantity, grade: Any) -> float:
    """The usual value; where either sign is as usual half of the largest, since none is often nothing."""
    low, high = quantity.range(grade)
    return 0.5 * high if low == -high and quantity.default is None else quantity.typical(grade)


def plain_values(mapping: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers rounded for a results file."""
    return {k: round(v, 4) if isinstance(v, float) else v for k, v in mapping.items()}
