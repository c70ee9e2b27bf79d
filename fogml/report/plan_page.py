"""The page of ``fogml plan``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fogml.gap.result_parts import Rehearsed
from fogml.report.figures_plan import errors_drawing, programme_drawing
from fogml.report.gap_tables_ahead import rehearsal_table
from fogml.report.page import Tile, render
from fogml.report.tables import Row, Table, columns_of
from fogml.report.words import MISSING, listed, number, plural, stated
from fogml.twin.registry import effects


def plan_page(values: Mapping[str, Any]) -> str:
    """The self-contained HTML page of a ``plan.json`` (schema ``fogml.plan/1``)."""
    return render(
        "plan.html",
        title="Plan",
        values=values,
        verdict=_verdict(values),
        tiles=_tiles(values),
        runs=[
            {
                "name": run["programme"],
                "summary": run["summary"],
                "drawing": programme_drawing(run),
                "alternatives": _alternatives(run),
            }
            for run in values["runs"]
        ],
        errors=errors_drawing(values),
        wanted=_wanted(values),
        correlations=_correlations(values),
        separations=_separations(values),
        rehearsal=rehearsal_table(
            [Rehearsed(**{**r, "named_as": tuple(r["named_as"])}) for r in values.get("rehearsal", ())],
            {id: declared.title for id, declared in effects().items()},
        ),
        about=_about(values),
    )


def _verdict(values: Mapping[str, Any]) -> list[str]:
    hidden = [e["name"] for e in values["wanted"] if not e["shown"]]
    close = [s for s in values["separations"] if not s["enough"]]
    shown = [e["name"] for e in values["wanted"] if e["shown"]]
    count = plural(len(values["runs"]), "run")
    sentences = [f"{count} of {number(values['total_hours'])} h in all."]
    if shown:
        sentences.append(f"Known better afterwards: {listed(shown)}.")
    if hidden:
        sentences.append(f"No programme within these hours shows {listed(hidden)}.")
    for item in values["separations"]:
        what = " from ".join(item["separates"]) if len(item["separates"]) < 3 else listed(item["separates"])
        verb = "shows" if len(item["separates"]) == 1 else "tells"
        end = "" if len(item["separates"]) < 3 else " apart"
        doing = verb if item not in close else f"does not {verb[:-1]}"
        sentences.append(f"It {doing} {what}{end} (distance {number(item['distance'])}).")
    return sentences


def _tiles(values: Mapping[str, Any]) -> list[Tile]:
    tiles = [Tile("Chamber time", number(values["total_hours"]), "h", plural(len(values["runs"]), "run"))]
    for item in values["separations"]:
        name = "Distance" if len(item["separates"]) > 1 else "Length"
        kind = "met" if item["enough"] else "missed"
        note = f"{', '.join(item['separates'])}; from {stated(values['least_distance'])} on"
        tiles.append(Tile(name, number(item["distance"]), "", note, kind))
    for error in values["wanted"][:4]:
        tiles.append(Tile(error["name"], number(error["se"]), error["unit"], "expected standard error"))
    return tiles


def _wanted(values: Mapping[str, Any]) -> Table | None:
    if not values["wanted"]:
        return None
    rows = [
        (
            e["name"],
            e["unit"],
            number(e["usual"]),
            number(e["prior_se"]),
            number(e["se"]),
            "yes" if e["shown"] else "no",
        )
        for e in values["wanted"]
    ]
    return Table(
        columns=columns_of(
            "Wanted | Unit | >Taken as | >Standard error before | >Expected standard error | Shown"
        ),
        rows=rows,
        caption="Fitted with the nominal constants under their priors. Shown: a tenth better than before; "
        "of an amplitude, that its usual size is three standard errors.",
    )


def _correlations(values: Mapping[str, Any]) -> Table | None:
    names = [e["name"] for e in values["wanted"]]
    if not 1 < len(names) <= 8:
        return None
    rows = [(name, *(number(c, 2) for c in row)) for name, row in zip(names, values["correlations"])]
    return Table(columns=(*columns_of("Correlation"), *((name, "", "figure") for name in names)), rows=rows)


def _separations(values: Mapping[str, Any]) -> Table | None:
    rows = [
        (pair["true"], pair["taken_for"], number(pair["distance"]), number(item["lengths"][pair["true"]]))
        for item in values["separations"]
        for pair in item["pairs"]
    ]
    rows += [
        (item["separates"][0], MISSING, MISSING, number(item["distance"]))
        for item in values["separations"]
        if not item["pairs"]
    ]
    if not rows:
        return None
    return Table(
        columns=columns_of("If it is | and is taken for | >Distance | >Length beside the constants"),
        rows=rows,
        caption=(
            "In standard deviations of the noise: what the best fit of the other leaves, amplitude and shape "
            "free, and what the constants leave."
        ),
    )


def _alternatives(run: Mapping[str, Any]) -> Table | None:
    if not run["alternatives"]:
        return None
    wanted = [e["name"] for e in run["wanted"]][:5]
    groups = [", ".join(s["separates"]) for s in run["separations"]]

    def row(told: Mapping[str, Any], mark: str) -> Row:
        errors = [number(e["se"]) for e in told["wanted"]][:5]
        apart = [number(s["distance"]) for s in told["separations"]]
        return Row((told["summary"], number(told["hours"]), *errors, *apart), mark)

    return Table(
        columns=(
            *columns_of("Programme | >Hours"),
            *((f"se of {name}", "", "figure") for name in wanted),
            *((f"distance of {group}", "", "figure") for group in groups),
        ),
        rows=(row(run, "chosen"), *(row(told, "") for told in run["alternatives"])),
        caption="The chosen programme and runners-up; their steps are in plan.json.",
    )


def _about(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    noise, low_high = values["noise"], values["limits_degC"]
    words = {"D": "D: volume of the confidence ellipsoid", "A": "A: mean square of the standard errors"}
    return [
        ("twin", f"{values['twin']} ({values['grade']})"),
        ("criterion", words[values["criterion"]]),
        ("longest run", f"{stated(values['hours'])} h"),
        ("temperatures", f"{stated(low_high[0])} to {stated(low_high[1])} °C"),
        ("noise N", f"{number(noise['N'])} deg/√h"),
        ("noise B", f"{number(noise['B'])} deg/h"),
        ("noise K", f"{number(noise['K'])} deg/h/√h"),
        ("sampling of the figures", f"{stated(values['sample_s']['figures'])} s"),
    ]
