"""A drift model whose drift is given, so that judgements have known answers."""

from __future__ import annotations

import numpy as np

from fogml.models.base import DriftModel, Evaluation
from fogml.models.card import checked_runs, training_card
from fogml.models.intervals import intervals_from_residuals


class KnownDrift(DriftModel):
    """Drift as a given function of the run; windows full from ``full_from_s`` on."""

    form = "known"

    def __init__(self, law=None, full_from_s=0.0, hottest=np.inf, half_width=1.0):
        self.law = law
        self.full_from_s = full_from_s
        self.hottest = hottest
        self.half_width = half_width
        self.kind = "known"

    def fit(self, runs):
        group = checked_runs(runs)
        self.card_ = training_card(group, hashes=lambda: [run.hash for run in group], rows=1)
        self.intervals_ = intervals_from_residuals(np.full(100, self.half_width), 100.0, "none")
        return self

    def evaluate(self, run):
        drift = np.zeros(len(run)) if self.law is None else np.asarray(self.law(run), dtype=float)
        outside = run.temperature("T") > self.hottest
        full = run.time - run.time[0] >= self.full_from_s
        return Evaluation(drift, full, np.ones_like(full), outside, lambda: np.where(outside, 0.1, 0.0))

    def weights(self):
        return {}

    def parameter_count(self):
        return 0

    def to_saved(self):
        return {}, {}

    @classmethod
    def from_saved(cls, values, arrays, card):
        return cls()
