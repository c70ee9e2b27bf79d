"""How often a fleet calls an ordinary unit odd, and what its prior brings, under white and coloured noise."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import t

from experiments.real_files.section import Section
from fogml.arrays import FloatArray
from fogml.features.parse import parse_features
from fogml.fleet.constants import FORM, FleetConstants, UnitConstants, fleet_constants
from fogml.fleet.shared import ODD, DrawnMember, size_priors
from fogml.models.mixed_effects import fit_mixed_effects
from fogml.models.mixed_effects_model import averages_of, composed
from fogml.models.prior import agreement
from fogml.models.table import run_rows, training_table
from fogml.runs.facts import Facts
from fogml.runs.run import Run

MEAN = np.array([0.2, 4e-3, -3e-5, 4e-7, 0.12, 1.5e-3])
SPREAD = np.array([0.1, 1e-3, 1e-5, 1e-7, 0.03, 4e-4])
"""Of the units' constants: of 1, u, u^2, u^3, dT, u dT with u = T - 25 degC [deg/h, degC, degC/min]."""
SAMPLE_S, WHITE, FLICKER = 30.0, 0.12, 0.02
"""Sample interval [s]; white noise of a sample [deg/h]; amplitude of the flicker's spectrum [deg/h]."""
FLEETS, UNITS, TESTED, ODD_WIDTH, SHORT_HOURS = 8, 24, 20, 3.0, 2.0
"""Fleets; units of each; units tested against each; width of odd ones; hours of a short run."""


def temperatures(rate: float, hours: float | None) -> FloatArray:
    """25 to -40 to 60 to 25 degC with soaks, through a coil's lag of 600 s; rate in degC/min."""
    parts = [np.full(60, 25.0)]
    for begin, end in ((25.0, -40.0), (-40.0, 60.0), (60.0, 25.0)):
        parts += [np.linspace(begin, end, int(abs(end - begin) / rate * 60.0 / SAMPLE_S)), np.full(120, end)]
    air = np.concatenate(parts)
    coil, state, gain = np.empty_like(air), air[0], 1.0 - np.exp(-SAMPLE_S / 600.0)
    for i, value in enumerate(air):
        state += gain * (value - state)
        coil[i] = state
    return coil if hours is None else coil[: int(hours * 3600.0 / SAMPLE_S)]


def flicker(random: np.random.Generator, count: int) -> FloatArray:
    """Noise of a spectrum 1/f, made in frequency."""
    whole = 8192
    cycles = np.fft.rfftfreq(whole)
    parts = random.normal(size=len(cycles)) + 1j * random.normal(size=len(cycles))
    parts[0], parts[1:] = 0.0, parts[1:] / np.sqrt(cycles[1:])
    return np.asarray(FLICKER * np.sqrt(whole / 2.0) * np.fft.irfft(parts, whole)[:count])


def recorded(
    seed: int, far: float, coloured: bool, rate: float = 1.0, hours: float | None = None
) -> tuple[Run, FloatArray]:
    """A unit's run, and its true drift; constants follow from the seed, `far` times as far out."""
    constants = MEAN + far * SPREAD * np.random.default_rng([seed, 11]).normal(size=6)
    random = np.random.default_rng([seed, 5, int(10 * rate)])
    coil = temperatures(rate, hours)
    u, slope = coil - 25.0, np.gradient(coil, SAMPLE_S) * 60.0
    drift = np.column_stack([np.ones_like(u), u, u**2, u**3, slope, u * slope]) @ constants
    gyro = drift + WHITE * random.normal(size=len(u)) + (flicker(random, len(u)) if coloured else 0.0)
    columns = {"time": SAMPLE_S * np.arange(len(u)), "gyro": gyro, "T": coil}
    return Run("run.csv", columns, Facts(unit="unit", axis="x")), drift


def case(fleet: FleetConstants, seed: int, far: float, coloured: bool, hours: float | None) -> dict[str, Any]:
    """One unit: its agreement, and errors from the truth on another cycle."""
    form = parse_features(FORM)
    rows = run_rows(recorded(seed, far, coloured, 1.0, hours)[0], form)
    table = composed(averages_of([rows]), form)
    alone = fit_mixed_effects(table, form.terms).regressor()
    found = fit_mixed_effects(table, form.terms, size_priors(fleet.own, table))
    member = DrawnMember.of(form, found, table, fleet.prior, fleet.own, fleet.noise)
    drawn = member.regressor(table)
    run, drift = recorded(seed, far, coloured, 0.8)
    other = training_table([run], form)
    truth = np.interp(other.time_s, run.time, drift)
    errors = [float(np.sqrt(np.mean((one.predict(other.X) - truth) ** 2))) for one in (alone, drawn)]
    return {"agreement": agreement(*member.told(table), fleet.prior), "alone": errors[0], "drawn": errors[1]}


def section(quick: bool) -> Section:
    """Shares called odd, and errors from the truth with and without the fleet."""
    fleets, tested = (2, 3) if quick else (FLEETS, TESTED)
    rows = []
    for coloured in (True, False):
        known = []
        for fleet in range(fleets):
            units = [UnitConstants.of([recorded(1000 * fleet + k, 1.0, coloured)[0]]) for k in range(UNITS)]
            known.append(fleet_constants(units))
        for hours in (SHORT_HOURS, None):
            for far, count in ((1.0, tested), (ODD_WIDTH, max(tested // 5, 1))):
                found = [
                    [case(constants, 1000 * fleet + 500 + k, far, coloured, hours) for k in range(count)]
                    for fleet, constants in enumerate(known)
                ]
                rows.append(_row(found, coloured, hours, far))
    lines = [
        "## The fleet's test of agreement",
        "",
        f"**Synthetic**: {fleets} fleets of {UNITS} units with a full cycle each; to each fleet {tested} "
        f"ordinary units more, and units whose constants lie {ODD_WIDTH:g} times as far out, with the first "
        f"{SHORT_HOURS:g} h of a "
        f"cycle or all of it. White noise of {WHITE:g} deg/h a sample of {SAMPLE_S:g} s, coloured with "
        "flicker noise beside. The errors are rms from the true drift over another cycle at 0.8 degC/min, "
        f"over that of the unit's own fit alone (median). A unit is called odd below {ODD:.0%}; intervals of "
        "95 % from the scatter of the fleets, which differ by more than their units' chance alone.",
        "",
        "| noise | run | units | number | called odd | 95 % | error, as shipped | error, none rejected |",
        "|---|---|---|---:|---:|---|---:|---:|",
    ]
    for row in rows:
        lines.append(
            f"| {row['noise']} | {row['run']} | {row['units']} | {row['count']} | {row['odd']:.1%} | "
            f"{row['odd_ci'][0]:.1%} to {row['odd_ci'][1]:.1%} | {row['shipped']:.2f} | {row['drawn']:.2f} |"
        )
    lines += [
        "",
        "What moves a unit's rows beside its constants is white noise, flicker, a random walk and a run's "
        "shift (`fogml.models.generalised_least_squares`).",
    ]
    return Section("\n".join(lines), {"rows": rows})


def _row(
    found: list[list[dict[str, Any]]], coloured: bool, hours: float | None, far: float
) -> dict[str, Any]:
    by_fleet = np.array([np.mean([one["agreement"] < ODD for one in fleet]) for fleet in found])
    every = [one for fleet in found for one in fleet]
    odd = np.array([one["agreement"] < ODD for one in every])
    alone, drawn = (np.array([one[key] for one in every]) for key in ("alone", "drawn"))
    share = float(by_fleet.mean())
    reach = float(t.ppf(0.975, len(found) - 1) * by_fleet.std(ddof=1) / np.sqrt(len(found)))
    return {
        "noise": "coloured" if coloured else "white",
        "run": "full" if hours is None else f"{hours:g} h",
        "units": "ordinary" if far == 1.0 else f"odd, {far:g} times",
        "fleets": len(found),
        "count": len(every),
        "odd": share,
        "odd_ci": [max(share - reach, 0.0), min(share + reach, 1.0)],
        "shipped": float(np.median(np.where(odd, alone, drawn) / alone)),
        "drawn": float(np.median(drawn / alone)),
    }
