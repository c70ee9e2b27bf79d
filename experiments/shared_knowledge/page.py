"""The page of results: the table of hours, and what a check of a short run can tell."""

from __future__ import annotations

from typing import Any

import numpy as np

from fogml import __version__

Row = dict[str, Any]
HARM = 1.05
"""Ratio of what is left with the fleet to that without above which the fleet does harm."""
NAMES = {1.0: "like the fleet", 3.0: "odd, 3 times", 6.0: "odd, 6 times"}
COVERING_HOURS = 1.5
"""Shortest run that covers enough of the fleet's temperatures to be drawn to it."""
WHOLE_HOURS = 6.0
"""Shortest run that shows all of the fleet's temperatures."""
_MORE = 0.2


def page(rows: list[Row], *, fleet: int, averaging_s: float) -> str:
    """The page, in Markdown."""
    seeds = sorted({row["seed"] for row in rows})
    lines = [
        "# Chamber hours that a new unit needs, with and without its fleet",
        "",
        f"fogml {__version__}. **Synthetic**: {fleet} units of a fleet with a full cycle of 11 h each; then "
        f"{len(seeds)} new units like them (seeds {seeds[0]} to {seeds[-1]}), and as many odd ones whose "
        "constants are drawn 3 and 6 times as far out. "
        "Each is trained on the first hours of a cycle at 1 degC/min and judged on a full cycle at "
        f"0.8 degC/min: bias stability of {averaging_s:g} s averages, deg/h. `alone` is the mixed-effects "
        "model of the fleet's form without the fleet, `drawn` the same with the fleet's prior of its shared "
        "part, `auto` the automatic model without the fleet; `left` is the share of units that were left to "
        "their own run, as odd or as too short. "
        "(`python -m experiments.shared_knowledge`)",
        "",
        "The check for odd units sees training rows alone. It and the prior were fixed on other units (seeds "
        "below 9100); those of this page were looked at once.",
        "",
        "| units | hours | before, median | auto, median | alone, median | drawn, median | "
        f"drawn / alone, median | drawn / alone, largest | above {HARM:g} | left | floor, median |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for far, name in NAMES.items():
        for hours in _hours(rows):
            some = [row for row in rows if row["far"] == far and row["hours"] == hours]
            middle = {
                key: np.median([row[key] for row in some])
                for key in ("before", "auto", "alone", "drawn", "floor")
            }
            ratio = _ratios(some)
            lines.append(
                f"| {name} | {hours:g} | {middle['before']:.3f} | {middle['auto']:.3f} | "
                f"{middle['alone']:.3f} | {middle['drawn']:.3f} | "
                f"{np.median(ratio):.2f} | {ratio.max():.2f} | {np.sum(ratio > HARM)} of {len(ratio)} | "
                f"{np.mean([row['left'] for row in some]):.0%} | {middle['floor']:.3f} |"
            )
    return "\n".join([*lines, "", *_benefit(rows), "", *_harm(rows), "", *_told(rows), ""])


def _hours(rows: list[Row]) -> list[float]:
    return sorted({row["hours"] for row in rows})


def _ratios(rows: list[Row], key: str = "drawn") -> np.ndarray:
    return np.array([row[key] / row["alone"] for row in rows])


def _benefit(rows: list[Row]) -> list[str]:
    like = [row for row in rows if row["far"] == 1.0]
    hours = _hours(rows)

    def needed(key: str) -> float:
        medians = {h: np.median([row[key] for row in like if row["hours"] == h]) for h in hours}
        return next(h for h in hours if medians[h] <= 1.1 * medians[hours[-1]])

    ratio, whole = _ratios(like), np.array([row["rms_drawn"] / row["rms_alone"] for row in like])
    return [
        f"To come within 10 % of what the longest run leaves, the median unit needs {needed('alone'):g} h "
        f"alone and {needed('drawn'):g} h drawn to its fleet. Of {len(ratio)} cases of units like the fleet "
        f"the fleet made {np.sum(ratio < 1 / HARM)} better by more than 5 % and {np.sum(ratio > HARM)} "
        f"worse, at most {ratio.max():.2f} times. Of the rms, the constant included, it made "
        f"{np.sum(whole < 1 / HARM)} better and {np.sum(whole > HARM)} worse, at most "
        f"{whole.max():.2f} times.",
    ]


def _harm(rows: list[Row]) -> list[str]:
    odd = [row for row in rows if row["far"] > 1.0 and row["hours"] >= COVERING_HOURS]
    kept = [row for row in odd if not row["left"]]
    ratio, harmed = _ratios(kept), [row for row in kept if row["drawn"] > HARM * row["alone"]]
    partly = [row for row in kept if row["told"]]
    shown = np.array([row["shown_drawn"] / row["shown_alone"] for row in kept])
    return [
        "## Odd units",
        "",
        f"Runs of {COVERING_HOURS:g} h and more of odd units: {len(odd)}. {len(odd) - len(kept)} were left "
        f"to their own run, where the fleet can do nothing. {len(kept)} were not told from the fleet, "
        f"{len(partly)} of them with temperatures that their run had not shown. Of those {len(kept)} the "
        f"fleet made {np.sum(ratio < 1 / HARM)} better by more than 5 % and {len(harmed)} worse; median "
        f"{np.median(ratio):.2f}, geometric mean {np.exp(np.log(ratio).mean()):.2f}, largest "
        f"{ratio.max():.2f} times what the unit's own run alone left.",
        "",
        "*Where the unit has been*, over the samples of the test run within what its own run showed, the "
        f"fleet made {np.sum(shown > HARM)} of {len(shown)} worse by more than 5 %, at most "
        f"{shown.max():.2f} times. The harm is at temperatures that rest on the fleet alone; the model's "
        f"card and `from_fleet_` name them, in {sum(row['told'] for row in harmed)} of the {len(harmed)} "
        "cases.",
    ]


def _told(rows: list[Row]) -> list[str]:
    """The check beside the best possible one, and the units that both cannot tell."""
    lines = [
        "## What no check of the run can tell",
        "",
        "The ideal check knows the distributions that ordinary and odd units are drawn from, and the noise, "
        "and takes the likelihood ratio of the two for the run's rows: by Neyman and Pearson none that "
        "leaves as many ordinary units to themselves finds more odd ones. Its level is set for each width "
        "and number of hours on the very ordinary units of this page. The mean of the two models' drifts is "
        "what half a belief in the fleet would do.",
        "",
        f"| check, runs of {COVERING_HOURS:g} h and more | ordinary left | odd left | odd made worse | worst "
        f"| ordinary, drawn / alone: mean | at {COVERING_HOURS:g} h, median |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    some = [row for row in rows if row["hours"] >= COVERING_HOURS]
    lines += [
        _check("fogml's", some, {id(row): bool(row["left"]) for row in some}),
        _check(f"fogml's at {_MORE:.0%}", some, {id(row): bool(row["agreement"] < _MORE) for row in some}),
        _check("ideal, as many ordinary left as fogml's", some, _ideal(some, None)),
        _check(f"ideal, {_MORE:.0%} of ordinary left", some, _ideal(some, _MORE)),
        _check(
            "fogml's, mean of drawn and alone", some, {id(row): bool(row["left"]) for row in some}, "half"
        ),
        _check("none: always drawn", some, {id(row): False for row in some}),
    ]
    harmed = [row for row in some if row["far"] > 1.0 and row["drawn"] > HARM * row["alone"]]
    likely = sum(row["nats"][f"{row['far']:g}"] < 0.0 for row in harmed)
    whole = [row for row in some if row["far"] > 1.0 and row["hours"] >= WHOLE_HOURS]
    lines += [
        "",
        f"Every case in which fogml's check let the fleet do harm. In {likely} of these {len(harmed)} the "
        "likelihood ratio itself speaks for the fleet (negative nats): whoever knew all that the run tells "
        "would take the unit for an ordinary one, as what is odd of it lies where the run has not been. "
        "Harm can then be ruled out only by not following the fleet there, which is the whole benefit at "
        f"{COVERING_HOURS:g} h, or by running there: of {len(whole)} runs of odd units that cover all of the "
        f"fleet's temperatures, {WHOLE_HOURS:g} h and more, {np.sum(_ratios(whole) > HARM)} were made worse, "
        f"at most {_ratios(whole).max():.2f} times.",
        "",
        "Nats for odd are the logarithm of the likelihood ratio for the unit's true width; agreement is "
        "fogml's own; odder is the share of ordinary units whose run of that length looks odder still to "
        "the ideal check.",
        "",
        "| seed | odd, times | hours | drawn / alone | where shown | agreement | nats for odd | odder |",
        "|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in harmed:
        key = f"{row['far']:g}"
        ordinary = [o["nats"][key] for o in some if o["far"] == 1.0 and o["hours"] == row["hours"]]
        odder = np.mean(np.array(ordinary) >= row["nats"][key])
        lines.append(
            f"| {row['seed']} | {row['far']:g} | {row['hours']:g} | {row['drawn'] / row['alone']:.2f} | "
            f"{row['shown_drawn'] / row['shown_alone']:.2f} | {row['agreement']:.0%} | "
            f"{row['nats'][key]:.1f} | {odder:.0%} |"
        )
    return lines


def _ideal(rows: list[Row], share: float | None) -> dict[int, bool]:
    """Whether the ideal check leaves each unit to its run; None leaves as many ordinary ones as fogml's."""
    left = {}
    for hours in _hours(rows):
        here = [row for row in rows if row["hours"] == hours]
        ordinary = [row for row in here if row["far"] == 1.0]
        count = sum(row["left"] for row in ordinary) if share is None else round(share * len(ordinary))
        for key in ordinary[0]["nats"]:
            level = sorted((row["nats"][key] for row in ordinary), reverse=True)[count]
            for row in here:
                if f"{row['far']:g}" == key:
                    left[id(row)] = row["nats"][key] > level
        for row in ordinary:
            # Of the two ideal checks, ordinary units are put to the one for the lesser width.
            key = min(row["nats"], key=float)
            level = sorted((other["nats"][key] for other in ordinary), reverse=True)[count]
            left[id(row)] = row["nats"][key] > level
    return left


def _check(name: str, rows: list[Row], left: dict[int, bool], key: str = "anyway") -> str:
    ratio = {id(row): 1.0 if left[id(row)] else row[key] / row["alone"] for row in rows}
    ordinary = [id(row) for row in rows if row["far"] == 1.0]
    odd = [id(row) for row in rows if row["far"] > 1.0]
    shares = " | ".join(f"{np.mean([left[one] for one in some]):.1%}" for some in (ordinary, odd))
    worse = sum(ratio[one] > HARM for one in odd)
    short = [ratio[id(row)] for row in rows if row["far"] == 1.0 and row["hours"] == COVERING_HOURS]
    return (
        f"| {name} | {shares} | {worse} of {len(odd)} | {max(ratio[one] for one in odd):.2f} "
        f"| {np.mean([ratio[one] for one in ordinary]):.3f} | {np.median(short):.2f} |"
    )
