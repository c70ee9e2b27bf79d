"""Every wanted figure of the final seed in one table: reached, allowed by the data, reached by baselines.

``python -m experiments.gap_blind.results`` writes ``results.md`` from ``score.json`` and what
``limits.py``, ``forms.py``, ``one_or_unknown.py`` and ``beside_unknown.py`` measured of the same seed.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from experiments.gap_blind import beside_unknown, one_or_unknown
from experiments.gap_blind.per_case import HERE, of_seed, write_page
from experiments.gap_blind.reach import (
    MISSED_FORMS,
    SHOWN_NATS,
    STRONG,
    UNKNOWNS,
    Figure,
    effects_and_wrong,
    false_names,
    left_by_right_forms,
    open_set_reach,
    shown,
    wrongly_named,
)
from fogml.report.blind_words import figure_text, value_text, wanted_text
from fogml.report.words import MISSING, plural

MEASURED = ("limits", "forms", "one_or_unknown", "beside_unknown")
DIAGNOSIS, ORACLE = "diagnosis", "oracle"
NO_RIVALS = (DIAGNOSIS, ORACLE, "abstain", "gp-discrepancy")
"""Methods that are no rival in naming: what is judged, what knows the truth, and what names nothing."""
BY_ORACLE = ("closed_ratio", "overlap")
ONE, UNKNOWN = Figure("", ("one",), STRONG), Figure("", UNKNOWNS, STRONG)
Row = Mapping[str, Any]


def main() -> None:
    """Write the table of the seed whose score is kept."""
    values = json.loads((HERE / "score.json").read_text(encoding="utf-8"))
    limits, forms, alone, beside = (of_seed(name, values["seed"]) for name in MEASURED)
    told = [one_or_unknown.sentence([row for row in alone if row])] if alone else []
    told += [beside_unknown.sentence([row for case in beside for row in case], limits)] if beside else []
    write_page("results", _page(values, limits, [row for case in forms for row in case], told))


def allowed(cases: Sequence[Row]) -> dict[str, float]:
    """What of each figure's value one reaches who knows the true forms, by the score's keys.

    Parameters
    ----------
    cases
        What ``limits.py`` measured.
    """
    effects, wrong = effects_and_wrong(cases)
    asked = [case["asked"] for case in cases]
    known = [row for row in effects if row["known"]]
    both = Figure("", ("unknown_and_known",), 0.0, alone=False)
    shares = {
        "one_top": shown(effects, ONE),
        "one_exact": shown(effects, ONE),
        "two_exact": shown(effects, Figure("", ("two",), 0.0)),
        "mixed_known_kept": shown(effects, both),
        "unknown_wrong_name": wrongly_named(effects, wrong, UNKNOWN),
        "mixed_false_name": wrongly_named(effects, wrong, both),
        "false_discovery": false_names(known, wrong, {row["case"] for row in asked if row["mix"]}),
    }
    found = {key: share.allowed for key, share in shares.items() if share is not None}
    if (open_set := open_set_reach(effects, asked, 0.0)) is not None:
        found |= dict(zip(("auroc", "fpr95"), open_set.allowed))
    return found


def _page(
    values: Row, cases: Sequence[Row], forms: Sequence[dict[str, Any]], told: Iterable[str] = ()
) -> str:
    tables = {m: {row["key"]: row for row in held["rows"]} for m, held in values["methods"].items()}
    within = allowed(cases)
    if ORACLE in tables:
        within |= {key: tables[ORACLE][key]["value"] for key in BY_ORACLE}
    rivals = {m: rows for m, rows in tables.items() if m not in NO_RIVALS}
    wanted = [row for row in tables[DIAGNOSIS].values() if wanted_text(row) and row["value"] is not None]
    met = sum(bool(row["met"]) for row in wanted)
    lines = [
        "# The diagnosis on withheld effects",
        "",
        f"{plural(values['cases'], 'synthetic case')} of a reality that is not the twin, at 10 s sampling, "
        f"of a seed that nothing was developed on; {met} of {len(wanted)} wanted figures are met. The data "
        f"allow: what one reaches who knows the true forms, names what adds {SHOWN_NATS:g} nats or more, "
        "errs only where the truth is nearer than that, and closes with the true form. The best baseline is "
        "chosen for each figure by itself; each is good at one at the price of others. The time at 1 Hz "
        "stands among the benchmarks.",
        "",
        "| figure | wanted | reached (95 % interval) | n | outcome | the data allow | distance to that | "
        "best baseline |",
        "|---|---:|---:|---:|---|---:|---:|---:|",
        *(_line(row, within.get(row["key"]), rivals) for row in wanted),
        "",
        _forms_unknown(cases, forms),
        *(line for sentence in told for line in ("", sentence)),
    ]
    return "\n".join(lines) + "\n"


def _forms_unknown(cases: Sequence[Row], forms: Sequence[dict[str, Any]]) -> str:
    """What wrong names for an unknown come to for one who does not know the true forms either."""
    left = left_by_right_forms(forms)
    found = wrongly_named(*effects_and_wrong(cases), UNKNOWN, left)
    if found is None:
        return ""
    further = found.reached - found.allowed
    return (
        "The diagnosis does not know the true forms, and has to bear with what the right form of the "
        f"catalogue leaves of an effect: more than {left:.0f} nats in {MISSED_FORMS:.0%} of "
        f"{plural(len(forms), 'effect')} (`forms.md`). In {found.allowed:.1%} of the "
        f"{plural(found.cases, 'case')} with an unknown of d′ > {STRONG:g} a wrong name is no further from "
        f"the truth than that, in {further:.1%} it is."
    )


def _line(row: Row, within: float | None, rivals: Mapping[str, Mapping[str, Row]]) -> str:
    form = row["format"]
    distance = MISSING if within is None else value_text(abs(row["value"] - within), form)
    cells = (
        row["words"],
        wanted_text(row),
        figure_text(row),
        str(row["n"]),
        _outcome(row),
        value_text(within, form),
        distance,
        _best(row, rivals),
    )
    return f"| {' | '.join(cells)} |"


def _outcome(row: Row) -> str:
    if row["met"]:
        return "met"
    if row["low"] is None:
        return "not met"
    low, high = (row["wanted"][end] for end in ("low", "high"))
    inside = (low is None or row["high"] >= low) and (high is None or row["low"] <= high)
    return "not met, within chance" if inside else "not met"


def _best(row: Row, rivals: Mapping[str, Mapping[str, Row]]) -> str:
    low, high = (row["wanted"][end] for end in ("low", "high"))
    held = {m: rows[row["key"]]["value"] for m, rows in rivals.items()}
    given = {m: value for m, value in held.items() if value is not None}
    if not given:
        return MISSING

    def miss(method: str) -> float:
        value = given[method]
        if low is not None and high is not None:
            return max(low - value, value - high)
        return -value if low is not None else value

    best = min(given, key=miss)
    return f"{value_text(given[best], row['format'])} ({best})"


if __name__ == "__main__":
    main()
