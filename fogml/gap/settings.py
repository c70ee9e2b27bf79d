"""What the diagnosis takes for granted, in one place: every number has its reason, and reports print it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, is_dataclass, replace

import numpy as np
from scipy.special import expit

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.gap.step_settings import NoiseSettings, Reported, RowSettings, SearchSettings
from fogml.settings_check import check_numbers, check_rising


@dataclass(frozen=True)
class Grids:
    """Grids of the families' shapes and places. Numbers in seconds, degC or counts, as their names say.

    Lags and widths go in steps of about two, between which a response is like one of both neighbours; they
    reach from what a row resolves to what a run of some hours shows.

    Attributes
    ----------
    mixes, place_lags_s, same_degc
        Where a cause may sit: shares of the outer face in its temperature (within, inner, outer, beyond the
        inner one), lags behind that; places that stay so near to one before drive alike.
    electronics_mixes
        The same for the optics and electronics where a slope in temperature is all that acts.
    direction_degc_min
        Rates under this [degC/min] are no direction.
    coarse_step_degc
        Steps of a good sensor are no coarser: part of any recording.
    drift_s, line_spacing, line_neighbours, outstanding_lines
        Lines that stand out: what is slower is drift and taken out first; spacing in cycles over the longest
        run; frequencies beside one that tell what power is usual; how many are looked at closely.
    half_widths_degc, sharp_degc, relays, densities
        Loops: half widths of a Preisach plane's relays, and those that all of them may share; relays of one
        half width, and smooth densities over their centres.
    warm_ups_s
        Decays since power-on.
    periods_degc, cycles_apart, most_periods
        Waves over temperature: shortest and longest period; spacing in cycles over the range, at which the
        cosine to a wave between two is over 0.9; how many at most.
    transition_step_degc, transition_widths_degc
        Transitions of a polymer: spacing of their centres, and widths.
    node_lags_s, relaxations_s, product_lags_s, shupe_lags_s, ageing_s
        Lags of a hidden node, of relaxing stress, of a rate product and of the winding's faces; time scales
        of logarithmic ageing: an hour, six, a day.
    modulator_s, behind_s
        How late a modulator's second loop is; how far a node may lag behind the place it is near.
    machine_lags_s, plant_lags_s, lead_lags_s, moisture_s
        Lags of a chamber's machines, of another plant's nodes, of the coil and the can as leads pass them,
        and of a coil that takes up the air's moisture.
    sensor_lag_s, placement_lag_s
        Scale of a sensor's second lag; lag of a place behind a sensor; skews of the clock.
    cycle_s
        Shortest and longest period of a chamber's own cycle.
    grid_nodes, line_cycles, whole, narrow, beyond, most_lines, place_degc
        A shape of any effect: nodes of each parameter by how many need a grid; spacing of lines in cycles
        over the longest run; parameters that are whole numbers; a usual range of no more than the factor
        `narrow` is a rule of thumb, and a grid of it alone goes `beyond` it by a factor; lines at most;
        spacing of places on the temperature scale.
    smooth_s, steps, single_steps, temperature_bumps, past_s, creeps_s, heals_s, turn_degc
        The unknown: shortest half periods of what is smooth in time; steps in a run, many or a single one;
        bumps of temperature; lags of what remembers it, of what creeps while hot or cold, decays after its
        turns, which are turns once it came back by twice `turn_degc`.
    rows_each
        Rows of a run, at least, for each half wave, step or strength of what is in its own time: what
        long and many runs cost stays that of all their rows, and faster courses are hardly other than noise.
    unknown_lines, line_weight, starts_s
        The unknown: lines, each one among as many as a run of some hours holds between its start and its
        rows; from when to when after the start something may be settling.
    slack_degc, largest_reading_degc, reading_heals_s, reading_steps, reading_single_steps, reading_waves
        A thermometer's unknown error: what one that sticks has to move by before it moves on, as it errs by
        as much and more would be seen; its usual most, class A of IEC 60751 between -40 and 70 degC; how it
        heals; steps in a run, many or a single one, and waves.
    """

    mixes: tuple[float, ...] = (0.5, 0.0, 1.0, -0.5)
    place_lags_s: tuple[float, ...] = (0.0, 600.0, 1800.0)
    same_degc: float = 0.3
    electronics_mixes: tuple[float, ...] = (0.5,)
    direction_degc_min: float = 0.05
    coarse_step_degc: float = 0.0101
    drift_s: float = 3000.0
    line_spacing: float = 0.25
    line_neighbours: int = 41
    outstanding_lines: int = 10
    half_widths_degc: tuple[float, ...] = (1.5, 3.0, 6.0, 10.0, 16.0, 24.0)
    sharp_degc: tuple[float, ...] = tuple(float(x) for x in np.geomspace(1.5, 26.0, 14))
    relays: int = 48
    densities: int = 5
    warm_ups_s: tuple[float, ...] = (100.0, 200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0)
    periods_degc: tuple[float, float] = (1.5, 40.0)
    cycles_apart: float = 0.4
    most_periods: int = 56
    transition_step_degc: float = 5.0
    transition_widths_degc: tuple[float, ...] = (2.5, 5.0, 10.0)
    node_lags_s: tuple[float, ...] = (600.0, 1200.0, 2400.0, 3600.0)
    relaxations_s: tuple[float, ...] = (900.0, 2000.0, 4500.0, 9000.0, 15000.0)
    product_lags_s: tuple[float, ...] = (0.0, 200.0)
    shupe_lags_s: tuple[float, ...] = (0.0, 60.0, 200.0)
    ageing_s: tuple[float, ...] = (3600.0, 21600.0, 86400.0)
    modulator_s: tuple[float, ...] = (30.0, 300.0, 1000.0)
    behind_s: tuple[float, ...] = (300.0, 1200.0)
    machine_lags_s: tuple[float, ...] = (0.0, 40.0, 150.0)
    plant_lags_s: tuple[float, ...] = (40.0, 100.0, 250.0)
    lead_lags_s: tuple[float, float] = (600.0, 1800.0)
    moisture_s: tuple[float, ...] = (1800.0, 7200.0, 36000.0, 144000.0, 600000.0)
    sensor_lag_s: float = 60.0
    placement_lag_s: float = 600.0
    cycle_s: tuple[float, float] = (60.0, 1500.0)
    grid_nodes: tuple[int, int, int] = (9, 5, 4)
    line_cycles: float = 0.3
    whole: tuple[str, ...] = ("harmonic",)
    narrow: float = 3.0
    beyond: float = 1.3
    most_lines: int = 6000
    place_degc: float = 4.0
    smooth_s: tuple[float, ...] = (7200.0, 2400.0, 900.0, 400.0)
    steps: int = 40
    single_steps: int = 24
    temperature_bumps: tuple[int, int] = (25, 60)
    past_s: tuple[float, ...] = (600.0, 1800.0, 5400.0, 16200.0)
    creeps_s: tuple[float, ...] = (1800.0, 7200.0, 30000.0)
    heals_s: tuple[float, ...] = (900.0, 3000.0, 9000.0, 1e9)
    turn_degc: float = 1.0
    rows_each: float = 4.0
    unknown_lines: int = 3
    line_weight: float = 0.01
    starts_s: tuple[float, float] = (30.0, 30000.0)
    slack_degc: tuple[float, ...] = (0.1, 0.3, 1.0)
    largest_reading_degc: float = 0.3
    reading_heals_s: tuple[float, ...] = (1800.0, 7200.0, 30000.0)
    reading_steps: int = 20
    reading_single_steps: int = 12
    reading_waves: int = 12

    def __post_init__(self) -> None:
        check_numbers(
            self,
            signed=("mixes", "electronics_mixes"),
            may_be_0=(
                "place_lags_s",
                "product_lags_s",
                "shupe_lags_s",
                "machine_lags_s",
                "direction_degc_min",
            ),
            above_1=("narrow", "beyond", "line_neighbours"),
        )
        for name in ("periods_degc", "cycle_s", "starts_s", "lead_lags_s"):
            check_rising(self, name)


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
