"""What ``fogml lab rate`` tells: the values of ``rate.json``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from fogml.errors import InputError
from fogml.lab.rate_errors import nonlinearity_within
from fogml.lab.rate_pieces import Plateaus, find_oscillations, find_plateaus, merged, with_steady_earth
from fogml.lab.rate_response import Gain, Slew, bandwidth, gain_of, slew
from fogml.lab.rate_temperature import by_temperature, temperature_sensitivity
from fogml.lab.rate_tests import (
    Answer,
    Bracket,
    Criteria,
    Line,
    Range,
    dead_zone,
    drift_shown,
    least_seen,
    near_zero,
    scale_line,
    step_answers,
    zero_answers,
)
from fogml.numerals import short
from fogml.runs.findings import of_any_use
from fogml.runs.names import named_apart
from fogml.runs.run import Run
from fogml.runs.settling import LEAST_ROWS
from fogml.runs.thermometers import leading_temperature
from fogml.twin.coil import LayeredCoil, lead_sensitivity, midpoint_sensitivity, radial_sensitivity
from fogml.twin.twin import Twin
from fogml.validation.scale_factor import LEAST_LEVELS

SCHEMA = "fogml.rate/1"


@dataclass(frozen=True)
class _Read:
    """What the runs hold, by kind."""

    ladders: list[tuple[Run, Plateaus]]
    gains: list[Gain]
    slews: list[tuple[float, Slew]]


def rate_json(
    runs: Sequence[Run],
    *,
    source: str,
    settle_s: float | None = None,
    criteria: Criteria | None = None,
    twin: Twin | None = None,
) -> dict[str, Any]:
    """Scale factor, range, threshold, dead zone, resolution, bandwidth, slew and temperature sensitivity.

    Parameters
    ----------
    runs
        Recorded runs with the table's rate; each may hold any of the tests.
    source
        What they are, for the page.
    settle_s
        Left out at the begin of each plateau [s]; as `fogml.lab.rate_pieces.find_plateaus` has it if None.
    criteria
        What counts as following; those of IEEE Std 952 if None.
    twin
        The twin that was tested, where it was one, for what follows from its facts.

    Returns
    -------
    dict
        Schema ``fogml.rate/1``; what the runs do not tell is null, and a note says what it needs.

    Raises
    ------
    InputError
        If no run holds two lasting rates of the table, or an oscillation.
    """
    criteria = Criteria() if criteria is None else criteria
    (runs,) = named_apart(runs)
    read = _read(runs, settle_s)
    greatest = max((float(np.abs(p.rate).max()) for _, p in read.ladders if len(p)), default=0.0)
    main = _main_ladder(read, greatest, criteria)
    line, held, doubts, ladder = (None, None, (), []) if main is None else main
    scale = 1.0 if line is None else line.scale_factor
    small = _small(read, greatest, scale, criteria)
    zero, steps = (_by_size(answers) for answers in small)
    band = bandwidth(read.gains, scale)
    # The run with the closest samples tells it best; of such, the one that changed fastest.
    limit = min(read.slews, key=lambda one: (one[0], -one[1].output_deg_s2), default=(0.0, None))[1]
    followed = greatest if held is None else held.followed
    sensed = temperature_sensitivity([run for run, _ in read.ladders], criteria.small * greatest, followed)
    values: dict[str, Any] = {
        "schema": SCHEMA,
        "kind": "recorded" if twin is None else "simulated",
        "source": source,
        "synthetic": twin is not None or any(run.facts.synthetic for run in runs),
        "runs": [run.name for run in runs],
        "criteria": asdict(criteria),
        "scale_factor": None if line is None else asdict(line),
        "range": _range(held),
        "threshold": _bracket(least_seen(zero, criteria)),
        "dead_zone": _bracket(dead_zone(zero, criteria)),
        "resolution": _bracket(least_seen(steps, criteria)),
        "bandwidth": None if band is None else asdict(band),
        "slew": None if limit is None else asdict(limit),
        "temperature_sensitivity": None
        if sensed is None
        else {
            key: v.tolist() if isinstance(v, np.ndarray) else v
            for key, v in vars(sensed).items()
            if key != "runs"
        },
        "count_arcsec": _count(runs),
        "told_by": {
            "scale_factor": ladder,
            "threshold": list(small[0]),
            "resolution": list(small[1]),
            "temperature_sensitivity": [] if sensed is None else list(sensed.runs),
        },
        "zero_answers": [asdict(one) for one in zero],
        "step_answers": [asdict(one) for one in steps],
        "gains": [asdict(one) for one in read.gains],
        "ladder": [
            {
                "run": run.name,
                "rate_deg_h": plateaus.rate.tolist(),
                "output_deg_h": plateaus.output.tolist(),
                "se_deg_h": plateaus.error.tolist(),
            }
            for run, plateaus in read.ladders
        ],
        "unit": None if twin is None else unit_facts(twin),
    }
    told = () if twin is None else twin.notes
    found = [finding for run in runs for finding in of_any_use(run.name, run.findings)]
    return values | {"notes": [*told, *doubts, *_notes(values)], "findings": found}


def _read(runs: Sequence[Run], settle_s: float | None) -> _Read:
    ladders, gains, slews = [], [], []
    for run in runs:
        if "rate" not in run.columns or not run.rate.any():
            continue
        run = with_steady_earth(run)
        waves = find_oscillations(run)
        gains += [gain_of(run, wave) for wave in waves]
        plateaus = find_plateaus(run, waves, settle_s)
        if len(plateaus) > 1:
            if not np.ptp(plateaus.output) > 0.0:
                raise InputError(
                    f"{run.name}: the column 'gyro' stays at one value over all rates of the table, so it "
                    "has no scale factor; is the gyro connected?"
                )
            ladders.append((run, plateaus))
            found = slew(run, plateaus)
            slews += [] if found is None else [(float(np.median(np.diff(run.time))), found)]
    if not ladders and not gains:
        more = f" beyond the {short(settle_s)} s that are left out" if settle_s else ""
        raise InputError(
            f"{', '.join(run.name for run in runs)}: holds no test on a rate table; the column "
            f"'rate [deg/s]' has to stay at two rates for some samples each{more}, or to go to and fro as "
            "a sine"
        )
    return _Read(ladders, gains, slews)


def _main_ladder(
    read: _Read, greatest: float, criteria: Criteria
) -> tuple[Line, Range, tuple[str, ...], list[str]] | None:
    """Of the run, and the temperature, with the most different large rates against the greatest of all
    [deg/h]; a scale factor that goes with temperature is no nonlinearity. Of several with as many, it is the
    one that stays on them for most samples; by its content where these are as many too, so that no order of
    files decides, and none by what it tells. With what to mind, and the run."""
    best: tuple[Line, Range, Run, Plateaus] | None = None
    most, short_of = (0, 0, ""), dict[str, float]()
    for run, whole in read.ladders:
        for plateaus in by_temperature(run, whole):
            found = scale_line(plateaus, criteria)
            rate = merged(plateaus.rate, plateaus.rate_error)
            levels = len(np.unique(rate[np.abs(rate) >= criteria.small * greatest]))
            if found is not None and found[1].exceeded is not None:
                short_of[run.name] = min(found[1].exceeded, short_of.get(run.name, np.inf))
            told = (levels, int((plateaus.stop - plateaus.start).sum()), run.hash)
            if found is not None and levels and told > most:
                best, most = (*found, run, plateaus), told
    if best is None:
        return None
    line, held, run, plateaus = best
    followed = plateaus[np.abs(plateaus.rate) <= held.followed]
    within = nonlinearity_within(run, followed, line.scale_factor)
    # A range may go with temperature.
    doubts = [
        f"In {name} the output no longer follows {short(rate / 3600.0)} deg/s, which {run.name} follows."
        for name, rate in short_of.items()
        if rate <= held.followed
    ]
    return replace(line, nonlinearity_ci90_ppm=within), held, (*doubts, *_of_drift(run, followed)), [run.name]


def _of_drift(run: Run, plateaus: Plateaus, most: float = 0.1, steady_degC: float = 0.5) -> tuple[str, ...]:
    """What a drift of the scale factor would do, where more than a share `most` of it moves the line's.

    Nothing where the recorded temperature stays within `steady_degC`: of the usual 10 ppm/degC 5 ppm.
    """
    if len(plateaus) < LEAST_LEVELS:
        return ()
    moved, bent = drift_shown(plateaus)
    warmth = leading_temperature(run)
    over = "the temperature is not recorded"
    if warmth is not None:
        span = float(np.ptp(warmth[int(plateaus.start[0]) : int(plateaus.stop[-1])]))
        over = f"the temperature moves by {short(span, 2)} degC"
        moved *= span > steady_degC
    if moved <= most:
        return ()
    return (
        f"The rates grow or fall over the test, and {over}: a scale factor that drifts by 1 ppm meanwhile "
        f"is told {short(moved, 2)} ppm off its middle, with a nonlinearity of {short(bent, 2)} ppm that is "
        "none; no interval holds that. Let the rates come again the other way round.",
    )


def _small(
    read: _Read, greatest: float, scale: float, criteria: Criteria
) -> tuple[dict[str, list[Answer]], dict[str, list[Answer]]]:
    """Answers to rates about zero, and to small steps away from it, by the runs that hold them."""
    zero, steps = {}, {}
    for run, plateaus in read.ladders:
        zero[run.name] = zero_answers(near_zero(plateaus, greatest, criteria), scale, criteria)
        steps[run.name] = step_answers(plateaus, greatest, scale, criteria)
    held = [{name: answers for name, answers in of.items() if answers} for of in (zero, steps)]
    return held[0], held[1]


def _by_size(answers: dict[str, list[Answer]]) -> list[Answer]:
    return sorted(
        (one for of in answers.values() for one in of), key=lambda one: (one.size, one.share, one.se)
    )


def _range(held: Range | None) -> dict[str, Any] | None:
    if held is None:
        return None
    return {f"{key}_deg_s": None if value is None else value / 3600.0 for key, value in asdict(held).items()}


def _bracket(found: Bracket | None) -> dict[str, Any] | None:
    return None if found is None else {"above_deg_h": found.above, "below_deg_h": found.below}


def _count(runs: Sequence[Run]) -> float | None:
    """Angle of a count [arcsec], the finest, where an output is in counts."""
    angles = [
        run.sample_s / abs(run.facts.scale_factor.count_per_deg_h)
        for run in runs
        if run.gyro_unit == "count" and run.facts.scale_factor is not None and len(run) > 1
    ]
    return min(angles, default=None)


def unit_facts(twin: Twin) -> dict[str, Any]:
    """What follows from a twin's coil and receiver.

    Returns
    -------
    dict
        Sagnac constant [s], phase of 1 deg/h [urad], transit time [us], proper frequency [kHz], rate of a
        fringe [deg/s], Shupe sensitivity of the winding to a linear gradient [deg/h per degC/min] and of
        mid-point and leads [the same per metre], settling of a profile across it [s], and the angle random
        walk of its photon noise at 20 uW and a depth of pi / 2 [deg/sqrt(h)].
    """
    coil = twin.coil
    return {
        "twin": twin.name,
        "length_m": coil.length,
        "diameter_m": coil.diameter,
        "wavelength_nm": 1e9 * coil.wavelength,
        "winding": coil.winding,
        "layers": coil.layers,
        "leads_m": [coil.lead_1, coil.lead_2],
        "sagnac_s": coil.sagnac_s,
        "phase_urad_per_deg_h": 1e6 * coil.phase_per_deg_h,
        "transit_us": 1e6 * coil.transit_s,
        "proper_frequency_khz": 1e-3 * coil.proper_frequency_hz,
        "fringe_deg_s": coil.fringe_offset_deg_s,
        "half_fringe_deg_s": 0.5 * coil.fringe_offset_deg_s,
        "winding_deg_h_per_degC_min": radial_sensitivity(coil),
        "winding_settling_s": LayeredCoil(coil).settling_s,
        "midpoint_deg_h_per_degC_min_m": midpoint_sensitivity(coil),
        "lead_deg_h_per_degC_min_m": lead_sensitivity(coil),
        "photon_walk_deg_sqrt_h": twin.receiver.angle_random_walk(coil, 20e-6, 0.5 * np.pi),
    }


def _notes(values: dict[str, Any]) -> list[str]:
    """What each test that is missing needs."""
    needs = {
        "scale_factor": f"scale factor: three stays of over {2 * LEAST_ROWS} samples at rates of both senses",
        "threshold": "threshold and dead zone: rates of both senses about zero, Earth rate turned away",
        "resolution": "resolution: small steps of the rate on top of a larger one",
        "bandwidth": "bandwidth: the table turning to and fro at two frequencies or more",
        "temperature_sensitivity": "temperature sensitivity: turns in soaks at several temperatures",
    }
    missing = [text for key, text in needs.items() if values[key] is None]
    return [f"Not tested here; {text}." for text in missing]
