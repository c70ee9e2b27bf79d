"""The page of the changes: how many were noticed, and what became of the others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from experiments.mutation.trials import NOTICED
from fogml.blind.scoring.statistics import wilson


def page_of(rows: Sequence[Mapping[str, Any]], drawn: int, seed: int, explained: Mapping[str, str]) -> str:
    """Markdown of what was found.

    Parameters
    ----------
    rows
        Changes that were tried.
    drawn, seed
        How many were drawn of all, and with which seed.
    explained
        Reason why no test can notice a change, by its key.
    """
    noticed = sum(row["state"] == NOTICED for row in rows)
    equal = [row for row in rows if row["state"] != NOTICED and row["key"] in explained]
    left = [row for row in rows if row["state"] != NOTICED and row["key"] not in explained]
    lines = [
        "# Do the tests notice a change?",
        "",
        "One operator or one number of the code is changed, and the tests of its own package that run the "
        "changed line, or where none does its file, are run until one fails, the quickest first and as "
        "many as `--most` allows; of a package whose coverage was not measured, and of kernels, those that "
        "import the file. What was not noticed may thus be noticed by a slower test. "
        "`python -m experiments.mutation`; it goes on where it was interrupted.",
        "",
        f"Of {drawn} changes drawn over all code (seed {seed}), {len(rows)} were tried, "
        f"{sum(not row['measured'] for row in rows)} of them under the tests that import the file. "
        f"Noticed: {_share(noticed, len(rows))}. "
        f"Noticed, or explained below: {_share(noticed + len(equal), len(rows))}; "
        f"{sum(explained[row['key']].startswith('mended') for row in equal)} of those explained are noticed "
        "by tests written since. "
        "Intervals are Wilson's of 95 %. Files are named as in the state that was tried.",
        "",
        "| package | tried | noticed | explained | left |",
        "|---|---|---|---|---|",
    ]
    for package, tried in sorted(Counter(_package(row) for row in rows).items()):
        of = [sum(_package(row) == package for row in part) for part in (equal, left)]
        lines.append(f"| {package} | {tried} | {tried - sum(of)} | {of[0]} | {of[1]} |")
    if left:
        lines += ["", "## Left", "", "| where | change | tests |", "|---|---|---|"]
        lines += [f"| {_where(row)} | {_change(row)} | {row['tests'] or row['state']} |" for row in left]
    if equal:
        lines += ["", "## Explained", "", "| where | change | why no test can notice it |", "|---|---|---|"]
        lines += [f"| {_where(row)} | {_change(row)} | {explained[row['key']]} |" for row in equal]
    return "\n".join(lines) + "\n"


def _share(count: int, of: int) -> str:
    share = wilson(count, of)
    if share.value is None:
        return "none was tried"
    return f"{count} of {of}, {share.value:.1%} ({share.low:.1%} to {share.high:.1%})"


def _package(row: Mapping[str, Any]) -> str:
    parts = row["path"].split("/")
    return parts[1] if len(parts) > 2 else "fogml itself"


def _where(row: Mapping[str, Any]) -> str:
    return f"`{row['path']}`, {row['function'] or 'module'}"


def _change(row: Mapping[str, Any]) -> str:
    return " → ".join(f"`{row[side]}`".replace("|", "\\|") for side in ("before", "after"))
