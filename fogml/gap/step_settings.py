"""How closely each step of a diagnosis looks, and from when on it says something; numbers with reasons."""

from __future__ import annotations

from dataclasses import dataclass

from fogml.settings_check import check_numbers


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

    def __post_init__(self) -> None:
        check_numbers(
            self, shares=("least_full", "rougher"), chances=("kept_back",), may_be_0=("least_motion_degc",)
        )


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
    thermal_degc
        A noise run in which temperature moves by as much [degC] is said to be no static one: more than a
        laboratory's day, and what a drift is told from.
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
    thermal_degc: float = 5.0
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

    def __post_init__(self) -> None:
        check_numbers(
            self,
            above_1=("unit_factor", "white_steps"),
            may_be_0=("static_motion_degc", "smooth_price", "noiseless", "least_error", "in_constants"),
        )


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

    def __post_init__(self) -> None:
        check_numbers(self, may_be_0=("alternatives",))


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
        Draws of coefficients and of noises behind an interval: so many coefficients tell an end to a tenth of
        their deviation.
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
    draws: int = 400
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

    def __post_init__(self) -> None:
        check_numbers(
            self,
            signed=("near_waves",),
            chances=("surely_not_nothing", "listed", "possible", "disagree", "suspected"),
            shares=("near_share", "least_gap", "least_part", "shown_share"),
        )
