"""What the diagnosis takes for granted, in one place: every number has its reason, and reports print it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, is_dataclass, replace

import numpy as np
from scipy.special import expit

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.gap.grids import Grids
from fogml.gap.step_settings import NoiseSettings, Reported, RowSettings, SearchSettings
from fogml.settings_check import check_numbers


@dataclass(frozen=True)
class Priors:
    """Priors, grids and prices of a diagnosis.

    Attributes
    ----------
    expected_causes
        Of the catalogue that act beside the model, on average: a gap that somebody diagnoses mostly has one.
    unknown
        Probability that a cause acts that no catalogue holds: about one gap in four.
    other_plant
        Probability that heat flows otherwise than the model's plant says, beyond what constants take up: no
        plant of a few nodes is a gyro, and in one unit of five it shows.
    mixed_forms
        Probability that it takes two members of its family to hold a known cause, or two families an unknown
        one: a real cause is a distribution over forms, which is often narrow.
    least_size, greatest_size, sizes
        Whitened length of what a cause does: log-uniform, in so many values. Under 3 none can be told from
        noise; no cause makes more than all of the gap, and where that is longer than 60, values go on in the
        same steps.
    plant_size
        Greatest whitened length of another plant: unbounded it would do what Shupe's effect does.
    beyond_range
        A size this many times the card's range is one standard deviation less likely, in its logarithm.
    form_error
        No form is known more exactly than to this share of its size: what a few per cent of a large gap are
        like is nobody's knowledge.
    most_causes
        Of one explanation: more than four have not been told apart by any run.
    beam
        Explanations that each round of the search goes on from.
    hopeless
        Explanations this far behind the best are not gone on from [nats].
    exchange
        Members of a class cost less than this to be exchanged [nats of evidence]: one in twenty.
    trust
        Logarithms of odds are multiplied by it, since no form is quite known. Fitted with the next one.
    surest
        Logarithm of the odds of a name that all evidence is for and that makes all that any cause makes; of
        one that makes a share of it, by energy, the odds are that share of these: what a form does not hold
        of one cause looks like another, smaller one. Both by likelihood on 130 names listed in 112
        cases of three realities (seed 1000102), as ``python -m experiments.families --calibrate`` does.
    slow_noise
        Prior standard deviations from the median at which random walk is integrated over; flicker at all but
        the last. Far above, since a short static run shows little of a walk.
    missed_lag
        Lag of an ordinary sensor on the coil, a standard deviation [s].
    most_rows, most_of_all
        Rows of a run, enough for 30 s in ten hours, as no thermal effect is faster; and of all fit runs.
    least_detectable
        Whitened length under which an effect counts as undetectable.
    rows, noise, grids, search, reported
        How closely each step looks.
    """

    expected_causes: float = 1.0
    unknown: float = 0.25
    other_plant: float = 0.2
    mixed_forms: float = 0.3
    least_size: float = 3.0
    greatest_size: float = 60.0
    sizes: int = 6
    plant_size: float = 8.0
    beyond_range: float = 3.0
    form_error: float = 0.04
    most_causes: int = 4
    beam: int = 6
    hopeless: float = 12.0
    exchange: float = 3.0
    trust: float = 0.23
    surest: float = 2.3
    slow_noise: tuple[float, ...] = (-1.0, 0.0, 0.6, 1.2, 2.0)
    missed_lag: float = 0.7
    most_rows: int = 1200
    most_of_all: int = 3000
    least_detectable: float = 3.0
    rows: RowSettings = field(default_factory=RowSettings)
    noise: NoiseSettings = field(default_factory=NoiseSettings)
    grids: Grids = field(default_factory=Grids)
    search: SearchSettings = field(default_factory=SearchSettings)
    reported: Reported = field(default_factory=Reported)

    def __post_init__(self) -> None:
        check_numbers(
            self,
            signed=("slow_noise",),
            chances=("unknown", "other_plant", "mixed_forms"),
            may_be_0=("form_error", "missed_lag", "exchange"),
            above_1=("sizes", "beyond_range"),
        )
        if not self.least_size < self.greatest_size:
            raise InputError(
                f"Priors: sizes from {self.least_size:g} to {self.greatest_size:g} were asked for; "
                "'greatest_size' is above 'least_size'"
            )

    @property
    def lengths(self) -> FloatArray:
        """The values of a cause's size, shape (sizes,)."""
        return np.geomspace(self.least_size, self.greatest_size, self.sizes)

    def reaching(self, length: float) -> Priors:
        """With sizes that go on, in the same steps, to a whitened length."""
        step = math.log(self.greatest_size / self.least_size) / (self.sizes - 1)
        more = max(math.ceil(math.log(max(length, 1.0) / self.greatest_size) / step), 0)
        greatest = self.greatest_size * math.exp(more * step)
        return replace(self, greatest_size=greatest, sizes=self.sizes + more)

    @property
    def plant_lengths(self) -> FloatArray:
        """The values of another plant's size, shape (sizes,)."""
        return np.geomspace(self.least_size, self.plant_size, self.sizes)

    def log_usual(self, times_usual: FloatArray) -> FloatArray:
        """Logarithm of how likely sizes are, over the greatest usual one, against such within their range."""
        over = np.log(np.maximum(times_usual, 1.0)) / math.log(self.beyond_range)
        return np.asarray(-0.5 * over**2)

    def believed(self, *log_odds: float, log_share: float = 0.0) -> float:
        """Probability of a name, from its odds against each other way to explain what it does.

        Odds against it add up: those of each way by the evidence, and those that a cause which makes such a
        share of all, a logarithm, is what another one's form does not hold.
        """
        against = [-self.trust * odds for odds in log_odds] + [-self.surest - log_share]
        return float(expit(-np.logaddexp.reduce(against)))

    def log_odds(self, probability: float) -> float:
        """Of a cause that acts with a probability."""
        return math.log(probability / (1.0 - probability))

    def described(self) -> tuple[str, ...]:
        """Each number of its own in a line, for reports."""
        told = [(f.name, getattr(self, f.name)) for f in fields(self)]
        return tuple(f"{name.replace('_', ' ')}: {value}" for name, value in told if not is_dataclass(value))


STANDARD = Priors()
"""What a diagnosis takes for granted unless told otherwise."""
