"""What the diagnosis takes for granted, in one place: every number has its reason, and reports print it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, is_dataclass, replace

import numpy as np
from scipy.special import expit

from fogml.arrays import FloatArray
from fogml.gap.shapes import Grids


@dataclass(frozen=True)
class RowSettings:
    """How a recording comes to rows.

    Attributes
    ----------
    fewest, least_full
        Rows of a run, and the share of its samples that a row needs.
    least_motion_degc
        Temperature that does not move by this, nor a table that turns, shows nothing.
    kept_back
        Share of the last run that is held out where no run is.
    short_gap
        Readings are linear over a gap of this share of the model's memory; a longer one is left out.
    saturated, distinct
        Neighbouring samples at the greatest or least value of all from which on it is a limit, in an output
        of more values than that.
    rougher
        Share of the smoothing's penalty under which noise of the readings shows.
    slope_step_degc
        Temperatures of a laboratory's own simulator are moved by so much, up and down, for its slope.
    """

    fewest: int = 16
    least_full: float = 0.5
    least_motion_degc: float = 2.0
    kept_back: float = 0.25
    short_gap: float = 0.25
    saturated: int = 3
    distinct: int = 50
    rougher: float = 0.03
    slope_step_degc: float = 0.5


@dataclass(frozen=True)
class NoiseSettings:
    """How the noise is judged.

    Attributes
    ----------
    unit_factor
        Noise of a unit from one run to another, as a factor.
    most_rows, static_rows
        Rows of a static run at most: for its own fit, whose likelihood is exact, and for that of each noise.
    fewest_samples, static_motion_degc
        A static run has as many samples; temperature that moves by more in it is fitted.
    free_deg_h
        Prior standard deviation of a static run's constant and of what goes with its temperature: free.
    smooth, smooth_price
        Unknowns beside which noise is judged before anything else is known, and what one costs there [nats]:
        sizes and odds.
    white_steps
        Factors by which white noise is searched, coarse and fine.
    white_factors
        White noise beside what was found, over that beside nothing.
    noiseless
        Share of the white noise expected under which none is: a simulation without noise is judged at that.
    longest_runs
        Flicker goes on to this many run lengths: what is slower sets runs apart by a constant.
    least_error
        Whitened length under which an error of the readings is left out.
    form_waves
        Half waves of a run that an error of a form may be smooth over.
    in_constants
        A block that keeps less of its energy beside the constants lies in their span.
    far_off
        Prior standard deviations from which on a constant is said to be far off, and its prior widened.
    """

    unit_factor: float = 1.3
    most_rows: int = 1500
    static_rows: int = 1000
    fewest_samples: int = 64
    static_motion_degc: float = 0.05
    free_deg_h: float = 1e3
    smooth: tuple[str, ...] = ("time_7200", "time_2400", "temperature_25", "past")
    smooth_price: float = 5.0
    white_steps: tuple[float, ...] = (1.3, 1.06)
    white_factors: tuple[float, ...] = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1)
    noiseless: float = 1e-3
    longest_runs: float = 30.0
    least_error: float = 0.3
    form_waves: int = 24
    in_constants: float = 1e-4
    far_off: float = 3.0


@dataclass(frozen=True)
class SearchSettings:
    """How far the search for sets of causes goes: more finds the same sets, later.

    Attributes
    ----------
    refined
        Sets of each number of causes whose members are chosen again beside each other.
    alternatives
        Sets without a name that each round asks what it could be instead.
    rounds
        Searches, each at the noise that the one before found likeliest.
    sure, rescored
        Sets by which white noise is judged again, and sets whose evidence is taken at every noise.
    wide
        Columns from which on a block is met through its eigenvectors, which are worked out once.
    """

    refined: int = 12
    alternatives: int = 3
    rounds: int = 3
    sure: int = 5
    rescored: int = 24
    wide: int = 40


@dataclass(frozen=True)
class Reported:
    """From when on things are said, and how figures are told.

    Attributes
    ----------
    surely_not_nothing
        Probability that nothing acts under which there is a gap, whatever makes it.
    listed, possible, nearest
        Causes are listed, and candidates possible, from these probabilities on; so many of the nearest known
        ones are told.
    near_share
        Share of the gap from which on a nearest cause is part of the headline.
    shown
        Squared whitened length from which on a run alone shows a cause.
    disagree
        Chance of sizes as unlike as those of the runs under which they don't agree.
    grows
        Standard errors from 0 of the change of a size with time from which on it grows or fades.
    onsets
        Times in each run at which a cause may have begun.
    card_nodes, card_starts
        Shapes of a card that are tried at most, and how many of the best least squares go on from.
    averaging_s
        Averaging time of figures that are told.
    fewest_checked
        Held-out rows under which the noise can't be checked.
    draws, noises
        Draws of coefficients and of noises behind an interval.
    least_gap
        A floor that is uncertain leaves this share of the gap above it, at least, in an interval.
    least_part
        A run or regime with less of all that is taken away is left out: nothing can be told of it.
    segment_s, bin_degc, significant
        Shortest stretch, width of a bin of temperature, and standard deviations from which on an excess is
        one of the gap: one in a hundred.
    shown_share
        Share of the noise floor that an effect of its usual size has to make of some run to be drawn.
    suspected
        A cause is kept in a twin as suspected from this probability on.
    feature_window_s, loop_powers, near_waves
        Features of a drift model: window of rates and differences, as in the nominal twin; powers of a play,
        densities of relays up to a parabola; waves that stand for one, apart in cycles over the range of
        temperature: half of the grid's step.
    """

    surely_not_nothing: float = 0.02
    listed: float = 0.02
    possible: float = 0.05
    nearest: int = 5
    near_share: float = 0.2
    shown: float = 9.0
    disagree: float = 0.01
    grows: float = 3.0
    onsets: int = 8
    card_nodes: int = 400
    card_starts: int = 3
    averaging_s: float = 100.0
    fewest_checked: int = 64
    draws: int = 40
    noises: int = 200
    least_gap: float = 0.2
    least_part: float = 0.03
    segment_s: float = 600.0
    bin_degc: float = 10.0
    significant: float = 2.6
    shown_share: float = 0.05
    suspected: float = 0.05
    feature_window_s: float = 64.0
    loop_powers: int = 3
    near_waves: tuple[float, ...] = (-0.2, 0.0, 0.2)


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
