"""The page of ``fogml inspect``: what is in the runs, before any model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fogml.report.figures_inspect import recording
from fogml.report.page import Drawing, Tile, render
from fogml.report.shading import in_order, regime_word
from fogml.report.tables import Noticed, Row, Table, noticed
from fogml.report.words import MISSING, duration, listed, number, percent, plural, stated
from fogml.runs.run import Run
from fogml.validation.inspection import inspection_json

_REGIMES_LISTED = 40
_GAPS_LISTED = 12


@dataclass(frozen=True)
class InspectedRun:
    """What the page shows of one run."""

    name: str
    anchor: str
    verdict: str
    tiles: list[Tile]
    drawing: Drawing
    columns: Table
    regimes: Table | None
    regimes_more: int
    gaps: Table | None
    gaps_more: int
    findings: list[Noticed]
    about: list[tuple[str, str]]


def inspect_page(runs: Run | Sequence[Run], inspection: Mapping[str, Any] | None = None) -> str:
    """The self-contained HTML page of what is in runs.

    Parameters
    ----------
    runs
        The runs, for the figures.
    inspection
        Their values in schema ``fogml.inspect/1``; made from the runs where not given.
    """
    runs = [runs] if isinstance(runs, Run) else list(runs)
    values = inspection_json(runs) if inspection is None else inspection
    inspected = [
        _inspected(index, run, told)
        for index, (run, told) in enumerate(zip(runs, values["runs"], strict=True), start=1)
    ]
    name = listed([run.name for run in runs])
    return render("inspect.html", title=f"{name} – what is in it", name=name, runs=inspected)


def _inspected(index: int, run: Run, told: Mapping[str, Any]) -> InspectedRun:
    segments, gaps = told["regimes"]["list"], told["gaps"]["list"]
    return InspectedRun(
        name=run.name,
        anchor=f"run-{index}",
        verdict=_verdict(told),
        tiles=_tiles(told),
        drawing=recording(run),
        columns=_columns(told),
        regimes=_regimes(segments[:_REGIMES_LISTED]),
        regimes_more=max(int(told["regimes"]["count"]) - _REGIMES_LISTED, 0),
        gaps=_gaps(gaps[:_GAPS_LISTED]),
        gaps_more=max(int(told["gaps"]["count"]) - _GAPS_LISTED, 0),
        findings=noticed(told["findings"]),
        about=_about(told),
    )


def _verdict(told: Mapping[str, Any]) -> str:
    spans = [
        f"{name} from {number(found['least'])} to {number(found['greatest'])} °C"
        for name, found in told["temperatures"].items()
    ]
    seconds = told["regimes"]["seconds"]
    total = sum(seconds.values())
    spent = [
        f"{regime_word(name)} {percent(seconds[name] / total)}"
        for name in in_order(name for name, time in seconds.items() if time and total)
    ]
    parts = [f"{plural(told['rows'], 'sample')} over {duration(told['span_s'])}"]
    parts.append(listed(spans, 6) if spans else "no temperature recorded")
    if spent:
        parts.append(listed(spent, 6))
    found = len(told["findings"])
    return (
        "; ".join(parts) + ". " + (f"{plural(found, 'finding')} below." if found else "Nothing was noticed.")
    )


def _tiles(told: Mapping[str, Any]) -> list[Tile]:
    gaps = told["gaps"]
    rates = [found for found in told["temperatures"].values() if found["fastest_rise"] is not None]
    tiles = [
        Tile("Span", duration(told["span_s"]), note=plural(told["rows"], "sample")),
        Tile("Sample interval", duration(told["sample_s"]), note="median"),
        Tile(
            "Gaps",
            str(gaps["count"]),
            "",
            f"the longest {duration(gaps['longest_s'])}" if gaps["count"] else "over 3 median intervals",
        ),
    ]
    if told["temperatures"]:
        widest = max(told["temperatures"].items(), key=lambda item: item[1]["span"])
        tiles.append(Tile("Temperature span", number(widest[1]["span"]), "°C", widest[0]))
    if rates:
        rise, fall = max(r["fastest_rise"] for r in rates), min(r["fastest_fall"] for r in rates)
        tiles.append(
            Tile(
                "Fastest change",
                number(max(rise, -fall)),
                "°C/min",
                f"rise {number(rise)}, fall {number(fall)}",
            )
        )
    return tiles


def _columns(told: Mapping[str, Any]) -> Table:
    rows = [
        Row(
            (
                column["name"],
                column["unit"] or MISSING,
                *(number(column[key], 4) for key in ("least", "greatest", "mean", "standard_deviation")),
                column["meaning"],
            )
        )
        for column in told["columns"]
    ]
    return Table(
        (
            ("Column", "", "text"),
            ("Unit", "", "text"),
            ("Least", "", "figure"),
            ("Greatest", "", "figure"),
            ("Mean", "", "figure"),
            ("Standard deviation", "", "figure"),
            ("What it is", "", "text"),
        ),
        tuple(rows),
    )


def _regimes(segments: Sequence[Mapping[str, Any]]) -> Table | None:
    if not segments:
        return None
    with_temperature = "temperature_from" in segments[0]
    columns = [
        ("Regime", "", "text"),
        ("From", "s", "figure"),
        ("To", "s", "figure"),
        ("Lasts", "", "figure"),
    ]
    if with_temperature:
        columns += [("T from", "°C", "figure"), ("T to", "°C", "figure"), ("T mean", "°C", "figure")]
    rows = []
    for segment in segments:
        cells = [
            regime_word(segment["regime"]),
            stated(round(segment["from_s"], 3)),
            stated(round(segment["to_s"], 3)),
            duration(segment["to_s"] - segment["from_s"]),
        ]
        if with_temperature:
            cells += [number(segment[f"temperature_{end}"], 4) for end in ("from", "to", "mean")]
        rows.append(Row(tuple(cells)))
    return Table(tuple(columns), tuple(rows))


def _gaps(gaps: Sequence[Mapping[str, Any]]) -> Table | None:
    if not gaps:
        return None
    rows = [
        Row((str(gap["row"]), stated(round(gap["after_s"], 3)), duration(gap["length_s"]))) for gap in gaps
    ]
    return Table(
        (("First row after the gap", "", "figure"), ("Begins after", "s", "figure"), ("Lasts", "", "figure")),
        tuple(rows),
    )


def _about(told: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = [(key.replace("_", " "), str(value)) for key, value in told["facts"].items()]
    earth = told["earth_rate_deg_h"]
    known = "not known; latitude and input_axis in the side file tell it" if earth is None else ""
    rows.append(("Earth rate along the input axis", known or f"{number(earth, 5)} deg/h"))
    rows.append(("SHA-256 of the columns", str(told["sha256"])))
    return rows
