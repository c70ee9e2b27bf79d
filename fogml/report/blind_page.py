"""The page of ``fogml blind score``: every figure against what is wanted, and what lies behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fogml.numerals import MISSING, against, listed, number, percent, plural, stated
from fogml.report.blind_tables import (
    by_form_table,
    by_reality_table,
    confusion_plot,
    figure_text,
    headline,
    kind_words,
    open_set_plot,
    reality_words,
    reliability_plot,
    spanned,
    strata_plot,
    value_text,
    wanted_text,
)
from fogml.report.page import render
from fogml.report.tables import Row, Table, columns_of

_ORACLE = "oracle"
_STRATA_DRAWN = ("one_exact", "two_exact", "unknown_wrong_name", "mixed_known_kept", "mixed_false_name")


def blind_page(values: Mapping[str, Any]) -> str:
    """The self-contained HTML page of a ``score.json``."""
    methods = values["methods"]
    name = headline(methods)
    judged, rows = methods[name], methods[name]["rows"]
    by_key = {row["key"]: row for row in rows}
    areas = {m: {r["key"]: r["value"] for r in v["rows"]}["auroc"] for m, v in methods.items()}
    return render(
        "blind.html",
        title=f"{name} – the check on withheld effects",
        method=name,
        values=values,
        verdict=_verdict(name, rows, values),
        warnings=_warnings(rows, values, judged),
        by_reality=by_reality_table(judged["by_reality"]),
        by_form=by_form_table(judged["by_form"]) if judged["by_form"] else None,
        figures=figures_table(rows, values),
        others=_others(methods, name) if len(methods) > 1 else None,
        by_kind=Table("Kind | >Cases", ((kind_words(kind), str(n)) for kind, n in values["kinds"].items())),
        strata=_strata(rows),
        strata_plot=strata_plot([by_key[key] for key in _STRATA_DRAWN if key in by_key]),
        reliability=reliability_plot(judged["reliability"], by_key["calibration_error"]["value"]),
        open_set=open_set_plot({m: v["open_set"] for m, v in methods.items()}, areas),
        confusion=confusion_plot(judged["confusion"]) if judged["confusion"]["true"] else None,
        left_out=_left_out(judged["left_out"]) if judged["left_out"] else None,
        worst=_worst(judged["worst"]),
        gates=gates_table(values["gates"]),
        uses=_uses(values["final_uses"]) if values["final_uses"] else None,
        suite_parts=_parts(values["parts"]) if len(values["parts"]) > 1 else None,
        about=_about(values),
    )


def _verdict(name: str, rows: Sequence[Mapping[str, Any]], values: Mapping[str, Any]) -> list[str]:
    held = [row for row in rows if row["met"] is not None]
    met = [row for row in held if row["met"]]
    missed = [row["words"] for row in held if not row["met"]]
    first = (
        f"The {name} meets {len(met)} of {plural(len(held), 'wanted figure')} on "
        f"{plural(values['cases'], 'blind case')}."
    )
    return [first, *([f"Not met: {listed(missed, 6)}."] if missed else [])]


def _warnings(
    rows: Sequence[Mapping[str, Any]], values: Mapping[str, Any], judged: Mapping[str, Any]
) -> list[str]:
    found = []
    thin = [row["words"] for row in rows if row["met"] is not None and not row["enough"]]
    if thin:
        found.append(f"These rest on fewer than 400 cases: {listed(thin, 5)}.")
    if not values["final"]:
        found.append("The seed is one to develop on: these are no final figures.")
    if not values["mix"]:
        found.append("No case is drawn from the whole mix: every figure is one of the kinds that there are.")
    if len(values["realities"]) < 2:
        found.append(
            "All cases are of one reality: what is found here holds for its plant and its forms alone."
        )
    several = [f"{m} ({len(v['code'])})" for m, v in values["methods"].items() if len(v["code"]) > 1]
    if several:
        found.append(f"Answers were given by several states of the code: {listed(several, 9)}.")
    if judged["failed"]:
        count = plural(len(judged["failed"]), "case")
        found.append(f"{count} failed, and count as wrong: {judged['failed'][0]['reason']}")
    return found


def figures_table(rows: Sequence[Mapping[str, Any]], values: Mapping[str, Any]) -> Table:
    """A method's figures with what is wanted of them."""
    caption = "n is what a figure rests on: cases, named effects, listed effects or intervals."
    if 0 < values["mix"] < values["cases"]:
        caption += (
            f" The {plural(values['cases'] - values['mix'], 'case')} outside the mix count in the figures of "
            "their kind alone."
        )
    return Table(
        "Figure | >Reached [95 % interval] | >Wanted | Outcome | >n | >Cases | >Prototype",
        (
            (
                row["words"],
                figure_text(row),
                wanted_text(row),
                {True: "✓ met", False: "✗ not met", None: ""}[row["met"]],
                str(row["n"]),
                str(row["cases"]),
                row["prototype"],
            )
            for row in rows
        ),
        caption=caption,
    )


def _others(methods: Mapping[str, Any], name: str) -> Table:
    order = [name, *(m for m in methods if m not in (name, _ORACLE)), *(m for m in methods if m == _ORACLE)]
    columns = [*columns_of("Figure | >Wanted"), *((m, "", "figure") for m in order)]
    tables = {m: {row["key"]: row for row in methods[m]["rows"]} for m in order}
    rows = []
    for row in methods[name]["rows"]:
        cells = (value_text(tables[m][row["key"]]["value"], row["format"]) for m in order)
        rows.append((row["words"], wanted_text(row), *cells))
    answered: dict[int, list[str]] = {}
    for m in order:
        answered.setdefault(tables[m]["failed"]["cases"], []).append(m)
    told = "The same cases and the same scorer for every method."
    if len(answered) > 1:
        shares = (f"{listed(found, len(order))}: {count}" for count, found in answered.items())
        told = f"The same scorer for every method. Cases of the mix that were answered: {'; '.join(shares)}."
    return Table(columns, rows, told)


def _strata(rows: Sequence[Mapping[str, Any]]) -> Table:
    names = list(dict.fromkeys(name for row in rows for name in row["by_stratum"]))
    names.sort(key=lambda name: (name.startswith("over"), not name.startswith("under"), _first(name)))
    shown = [row for row in rows if row["by_stratum"]]
    return Table(
        columns=(*columns_of("Figure"), *((f"d′ {spanned(name)}", "", "figure") for name in names)),
        rows=(
            (
                row["words"].replace(", d′ > 10", ""),
                *(_part(row, row["by_stratum"].get(n)) for n in names),
            )
            for row in shown
        ),
        caption="By d′ of a case's weakest missing effect; n in brackets.",
    )


def _first(name: str) -> float:
    return float("".join(c if c.isdigit() or c == "." else " " for c in name).split()[0])


def _part(row: Mapping[str, Any], part: Mapping[str, Any] | None) -> str:
    if part is None or part["value"] is None:
        return MISSING
    return f"{value_text(part['value'], row['format'])} ({part['n']})"


def _left_out(parts: Sequence[Mapping[str, Any]]) -> Table:
    rows = []
    for part in parts:
        flagged, wrong = part["flagged"], part["wrong_name"]
        names = [f"{name} {count}" for name, count in part["wrong_names"].items()]
        relatives = [f"{name} {count}" for name, count in part["relatives"].items()]
        rows.append(
            (
                part["effect"],
                "left out" if part["in_library"] else "in no library",
                str(flagged["n"]),
                number(part["d_prime"]),
                percent(flagged["value"]),
                percent(wrong["value"]),
                listed(names, 3) or MISSING,
                listed(relatives, 3) or MISSING,
            )
        )
    return Table(
        "Unknown | Kind | >Cases | >d′ [median] | >Seen as unknown | >Wrong name | Wrong names | "
        "Relatives named",
        rows,
        caption="A relative's best-fitted signature can't be told from the unknown: its name is not wrong.",
    )


def _worst(cases: Sequence[Mapping[str, Any]]) -> Table:
    rows = []
    for case in cases:
        named = [f"{listed(item['class'], 4)} ({number(item['probability'], 2)})" for item in case["named"]]
        cells = (
            case["case"],
            kind_words(case["kind"]),
            number(case["d_prime"]) if case["true"] else MISSING,
            listed(case["true"], 4) or "nothing",
            listed(case["left_out"], 4) or MISSING,
            "; ".join(named) or "nothing",
            number(case["unknown"], 2),
            case["wrong"],
        )
        rows.append(Row(cells, link=case.get("report") or ""))
    columns = "Case | Kind | >d′ | Truly missing | No candidate | Named | >Unknown | What is wrong"
    return Table(columns, rows)


def gates_table(gates: Sequence[Mapping[str, Any]]) -> Table | None:
    """Which gates are met; None where there are none."""
    if not gates:
        return None
    return Table(
        "Gate | >Limit | >Reached | Outcome",
        (
            (
                one["key"],
                f"{'≥' if one['at_least'] else '≤'} {stated(one['limit'])}",
                against(one["value"], one["limit"]),
                "✓ met" if one["met"] else "✗ not met",
            )
            for one in gates
        ),
    )


def _uses(uses: Sequence[Mapping[str, Any]]) -> Table:
    return Table(
        "When [UTC] | >Seed | >Cases | Methods | Hash of the truth [first digits]",
        (
            (u["when"], str(u["seed"]), str(u["cases"]), listed(list(u["figures"]), 9), u["truth"][:12])
            for u in uses
        ),
        caption="Every use of a final seed so far. A seed that was used once is no longer fresh.",
    )


def _parts(parts: Sequence[Mapping[str, Any]]) -> Table:
    return Table(
        "Marks | >Cases | >Numbers | Kinds | Hash of the truth [first digits]",
        (
            (
                part["file"],
                str(part["cases"]),
                f"{part['first']} … {part['last']}",
                ", ".join(f"{kind_words(kind)} {n}" for kind, n in part["kinds"].items()),
                part["truth"][:12],
            )
            for part in parts
        ),
    )


def _about(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    runs = ", ".join(f"{n} with {count}" for count, n in values["fit_runs"].items())
    whole = values["mix"] == values["cases"]
    return [
        ("data", values["data"]),
        *((f"{name} reality", reality_words(name)) for name in values["realities"]),
        ("cases", f"{values['cases']}, {'all' if whole else values['mix']} of them from the whole mix"),
        ("seed", f"{values['seed']} ({'final' if values['final'] else 'to develop on'})"),
        ("sample interval", ", ".join(f"{number(s)} s" for s in values["sample_s"])),
        ("fit runs", runs),
        ("with table rates", str(values["turning"])),
        ("hash of the truth", values["truth"]),
    ]
