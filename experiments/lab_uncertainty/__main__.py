"""Whether stated uncertainties hold: ``python -m experiments.lab_uncertainty``."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from experiments.lab_uncertainty import (
    cards,
    certificates,
    fleets,
    floors,
    joint,
    lines,
    misalignment,
    models,
    monitor,
    north,
    planning,
    rate,
    response,
    service,
    terms,
)
from experiments.results import write_results
from fogml import __version__

HERE = Path(__file__).parent
SEED = 5
PARTS: tuple[tuple[str, ModuleType, int, str], ...] = (
    (
        "North (`lab north --positions`)",
        north,
        200,
        "Azimuth and latitude at random, 4 × 60 s at 1 Hz unless told, a steady bias unless told. "
        "Errors of the table's angles are in no standard error.",
    ),
    (
        "Rate table (`lab rate`)",
        rate,
        200,
        "Rates of 5 to 100 deg/s either way, a minute each, table and gyro settling with 0.3 s. Of "
        "a gyro that is not linear the misfit counts as scatter, and three rates leave one degree "
        "of freedom: both are wide. Nonlinearity is none but where the case says so; rates of the table that "
        "are off each time they come look like a bend of the gyro's.",
    ),
    (
        "Small rates, oscillations, turns (`lab rate`, certificates)",
        response,
        200,
        "Before, a lag of 1 s put the scale factor off by 128 ppm. A threshold is told at two "
        "standard errors.",
    ),
    (
        "Misalignment in four states (`lab misalignment`)",
        misalignment,
        100,
        "Intervals of 95 %. Four tilts, rates of 10, 50 and 100 deg/s either way, 4 h at 1 Hz, Earth rate, a "
        "fixture off by up to 0.3 deg. A drift of the scale factor that is too small to show is in no "
        "interval.",
    ),
    (
        "Deviations on certificates and in acceptance",
        certificates,
        400,
        "The truth is the mean square over all runs. Figures are compared with limits as they are, so that "
        "noise lets units pass which miss a limit: stated is chi-square's share.",
    ),
    (
        "Coefficients of drift models (`train`)",
        joint,
        100,
        "Cycles of 6 + 5 soaks from −40 to 60 °C; thermometers of 1/16 °C. The truth is of the "
        "temperature at the coil: where the recorded one lags by minutes or is rounded to degrees, "
        "the coefficient of its rate is another one, and no interval holds that. Nor does one that four "
        "nearly alike thermometers are read with errors, which shows beside a quiet gyro.",
    ),
    (
        "Prediction intervals on another run (`train`)",
        models,
        60,
        "Runs up and down at rates and with noise of their own; the mean share of averages over all "
        "runs, as averages of one run are alike. One run says nothing of how the next one differs.",
    ),
    (
        "A run in service (`monitor`)",
        service,
        200,
        "Figures of a run beyond its model, and the trend over a unit's runs. A run of less than "
        "an hour tells little of its noise. Units that gave an alarm are left out of the trend.",
    ),
    (
        "Noise terms (`noise`)",
        terms,
        60,
        "Of B and R that are none an interval begins at 0. Before, R was told where there is none in "
        "27 % of runs of navigation grade at 10 Hz over 4 h, as its error left out a random walk that hardly "
        "shows; N lay above its interval in 10 % of runs of white noise, as other terms, which cannot be "
        "negative, were taken for free to be so.",
    ),
    (
        "Noise floors of a judgement (`train`, `compare`)",
        floors,
        40,
        "The truth is what noise leaves in averages of a run as long, its mean taken off; under ramps "
        "without a random walk, which counts as drift. Before, intervals knew nothing of slow noise that a "
        "run does not tell: wrong were 20 % of tactical and navigation grade still, 22 to 42 % under ramps.",
    ),
    (
        "Promises of a plan (`plan`)",
        planning,
        100,
        "Fits of runs of a programme of 8 h beside the promised standard errors, twin *tactical*. Here "
        "signals are fogml's: the twin's replay at constants drawn from its priors, under noise in plain "
        "NumPy. Of a pair as far apart as `plan` takes to be enough the normal distribution has the other "
        "one fit better in the share stated.",
    ),
    (
        "Sizes and shapes of causes (`diagnose`)",
        cards,
        10,
        "Effects put into runs in the catalogue's own form, d′ 30, shapes drawn from its priors; the cause's "
        "name, the noise and all else are known. So fogml's signatures are fitted to themselves: real forms "
        "are others. That no form is known more exactly than to 4 % makes intervals of amplitudes wide here. "
        "Told alone are effects whose intervals hold too little.",
    ),
    (
        "A next unit drawn to its fleet (`fleet`)",
        fleets,
        200,
        "Coefficients and prediction intervals of the model of a next unit, shared among ten fleets a case, "
        "and constants of these fleets' own units, of cycles of 7 h, in the columns of `fleet.json`; units' "
        "constants are normal. Units that are left to their own runs are not counted.",
    ),
    (
        "A line of units (`fleet`)",
        lines,
        200,
        "Shares and constants of units drawn at random; told of a fleet in which no unit is odd.",
    ),
    (
        "Alarms (`monitor`)",
        monitor,
        200,
        f"{monitor.RUNS} runs of a unit, an alarm past {monitor.LIMIT:.0f}; stated is at most. "
        "Sizes and shapes are those of the first alarm after the change, as the runs since tell it.",
    ),
)


def measured(repeats: int | None = None, only: Sequence[str] = ()) -> dict[str, list[dict[str, Any]]]:
    """Rows of every part, or of `only` those modules; with other `repeats` than the page's where given."""
    return {
        title: [row for case in part.CASES for row in part.measured(case, repeats or usual, SEED)]
        for title, part, usual, _ in PARTS
        if not only or _name(part) in only
    }


def _name(part: ModuleType) -> str:
    return part.__name__.rpartition(".")[2]


def page(rows: dict[str, list[dict[str, Any]]], before: dict[str, float]) -> str:
    """The result page."""
    parts = [
        f"# Do stated uncertainties hold?\n\nfogml {__version__}. **Synthetic**, in plain NumPy, "
        "nothing of fogml's simulator: white noise, flicker and a random walk of tactical (0.02 "
        "deg/√h, 0.05 deg/h, 0.05 deg/h/√h) and navigation grade (0.001, 0.002, 0.005), counts, "
        "dropped rows, thermometers that lag, settling; truths at random. *Held*: share of 90 % "
        "intervals that hold the truth, with its 95 % interval by Wilson; *before*: as the version "
        "before this measurement held. Errors are over the stated standard error. `python -m "
        "experiments.lab_uncertainty`.\n"
    ]
    for title, _, _, words in PARTS:
        lines = [
            f"\n## {title}\n\n{words}\n",
            "| case | of | runs | held | before | mean error | rms error |",
        ]
        lines.append("|---|---|---:|---:|---:|---:|---:|")
        verdicts = ["| case | verdict | runs | wrong | stated at most |", "|---|---|---:|---:|---:|"]
        for row in rows[title]:
            low, high = (f"{100.0 * end:.0f}" for end in row.get("wilson95", (0.0, 0.0)))
            if "wrong" in row:
                share = f"{100.0 * row['wrong']:.0f} % ({low} to {high})"
                stated = f"{100.0 * row['stated']:.0f} %"
                verdicts.append(f"| {row['case']} | {row['quantity']} | {row['runs']} | {share} | {stated} |")
                continue
            told = "not stated" if row["held"] is None else f"{100.0 * row['held']:.0f} % ({low} to {high})"
            old = before.get(f"{row['case']}: {row['quantity']}")
            errors = (_signed(row.get(key), sign) for key, sign in (("mean_z", "+"), ("rms_z", "")))
            runs = str(row["runs"]) if row["stated"] == row["runs"] else f"{row['stated']} of {row['runs']}"
            was = "" if old is None else f"{100.0 * old:.0f} %"
            lines.append(
                f"| {row['case']} | {row['quantity']} | {runs} | {told} | {was} | {' | '.join(errors)} |"
            )
        parts.append("\n".join(lines if len(lines) > 3 else lines[:1]) + "\n")
        if len(verdicts) > 2:
            parts.append("\n" + "\n".join(verdicts) + "\n")
    return "".join(parts)


def _signed(value: float | None, sign: str) -> str:
    return "" if value is None else f"{value:{sign}.2f}".replace("-", "\N{MINUS SIGN}")


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--repeats", type=int, default=None, help="fewer than the page's, which is not written"
    )
    parser.add_argument(
        "--part",
        action="append",
        default=[],
        choices=[_name(part) for _, part, *_ in PARTS],
        help="what to measure anew; the rest stands as it was",
    )
    given = parser.parse_args()
    held = json.loads((HERE / "results.json").read_text(encoding="utf-8")) if given.part else {}
    rows = held | measured(given.repeats, given.part)
    text = page(rows, json.loads((HERE / "before.json").read_text(encoding="utf-8")))
    if given.repeats is None:
        write_results(HERE, {title: rows[title] for title, *_ in PARTS}, text)
    print(text)


if __name__ == "__main__":
    main()
