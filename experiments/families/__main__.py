"""The diagnosis on development cases: every wanted figure, by reality.

``python -m experiments.families DIR...`` reads the suites in the folders, made by ``fogml blind make`` and
answered by ``fogml blind run``, and writes ``results.md`` and ``results.json``. ``record.md`` holds the
figures of the diagnosis before this one on some of these cases.

With ``--calibrate`` it prints the trust and the surest odds of `fogml.gap.settings.Priors` that what
is listed asks for: the one map between evidence and probability, fitted by likelihood.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from experiments.gap_blind.__main__ import answered_marks, same_twin, twin_lines
from experiments.results import write_results
from fogml.blind.folders import DIAGNOSIS, BlindFolder, read_json
from fogml.blind.plan import SAME_TWIN
from fogml.blind.scoring.by_reality import by_reality
from fogml.blind.scoring.marks import Mark
from fogml.numerals import MISSING, plural
from fogml.report.blind_tables import figure_text, wanted_text

HERE = Path(__file__).parent


def main() -> None:
    """Score both methods and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("suites", type=Path, nargs="+", help="folders of blind suites")
    parser.add_argument("--answers", default=DIAGNOSIS, help="name of the answers (diagnosis)")
    parser.add_argument("--workers", type=int, default=1, help="processes (1)")
    parser.add_argument("--calibrate", action="store_true", help="print the map's numbers; no page")
    given = parser.parse_args()
    suites = [BlindFolder(path) for path in given.suites]
    marks = [x for s in suites for x in answered_marks(s, given.answers, given.workers)]
    seeds = sorted({x.truth.seed for x in marks})
    if given.calibrate:
        trust, surest, count = fitted_map(names_of(suites, given.answers))
        print(f"trust {trust:.2f}, surest {surest:.2f}, of {count} names of seeds {seeds}")
        return
    drawn = [x for x in marks if x.truth.reality != SAME_TWIN]
    counts = Counter(x.truth.reality for x in drawn)
    values: dict[str, Any] = {
        "seeds": seeds,
        "cases": dict(sorted(counts.items())),
        "fit_runs": _fit_runs(drawn),
        "by_reality": by_reality(drawn),
        "same_twin": list(same_twin(marks)),
    }
    write_results(HERE, values, page(values))


def names_of(suites: Sequence[BlindFolder], answers: str) -> list[tuple[float, float, float, bool]]:
    """Of each listed cause its odds against the unknown, among known ones, its share, in logs; if right."""
    found = []
    for suite in suites:
        for mark in answered_marks(suite, answers):
            path = suite.answers(answers) / mark.truth.case / "gap.json"
            told = read_json(path) if path.is_file() else {"which": [], "suspected": []}
            odds = {w["effect"]: w["log_odds"] for w in (*told["which"], *told["suspected"])}
            for item in (*mark.items, *mark.suspected):
                if given := odds[item.effect]:
                    own = (given["against_unknown"], given["among_known"], given["log_share"])
                    found.append((*own, item.right))
    return found


def fitted_map(names: Sequence[tuple[float, float, float, bool]]) -> tuple[float, float, int]:
    """Trust and the surest name's log odds by penalised likelihood, and how many names that were listed.

    The penalty holds the trust near 1, a standard deviation of a factor e, where names are few.
    """
    *told, right = (np.array(values) for values in zip(*names))
    known, among, share = told

    def loss(at: np.ndarray) -> float:
        trust, surest = math.exp(at[0]), at[1]
        against = np.logaddexp.reduce([-trust * known, -trust * among, -surest - share])
        chances = np.clip(expit(-against), 1e-9, 1.0 - 1e-9)
        return float(-np.log(np.where(right, chances, 1.0 - chances)).sum() + 0.5 * at[0] ** 2)

    found = minimize(loss, [-1.5, 2.0], method="Nelder-Mead").x
    return math.exp(float(found[0])), float(found[1]), len(right)


def _fit_runs(marks: Sequence[Mark]) -> dict[str, int]:
    """How many cases have so many fit runs."""
    counts = Counter(len(x.truth.runs.fit) for x in marks)
    return {str(runs): count for runs, count in sorted(counts.items())}


def _runs_told(counts: Mapping[str, int]) -> str:
    return "Fit runs: " + ", ".join(f"{n} in {plural(count, 'case')}" for n, count in counts.items()) + "."


def page(values: Mapping[str, Any]) -> str:
    """``results.md`` of what ``results.json`` holds."""
    cases = ", ".join(f"{name} {count}" for name, count in values["cases"].items())
    return "\n".join(
        [
            "# The diagnosis on development cases",
            "",
            f"Synthetic blind cases at 10 s, development seeds {', '.join(map(str, values['seeds']))}: no "
            "final figures, and families were widened with failures among these cases in view. Cases: "
            f"{cases}. Each figure with its 95 % interval (Wilson's for shares) and what it rests on. Times "
            "are of the clock where answers were sealed, on a machine that many others used, and of the "
            "processor elsewhere. The diagnosis before this one, on some of these cases: "
            "[record](record.md).",
            "",
            _runs_told(values["fit_runs"]),
            "",
            *_table(values["by_reality"]),
            "",
            *twin_lines(values["same_twin"]),
        ]
    )


def _table(columns: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[str]:
    names = list(columns)
    rows = [f"| figure | wanted | {' | '.join(names)} |", f"|---|---:|{'---:|' * len(names)}"]
    for place, row in enumerate(columns[names[0]]):
        cells = [columns[name][place] for name in names]
        told = [MISSING if c["value"] is None else f"{figure_text(c)}; {c['n']}" for c in cells]
        rows.append(f"| {row['words']} | {wanted_text(row)} | {' | '.join(told)} |")
    return rows


if __name__ == "__main__":
    main()
