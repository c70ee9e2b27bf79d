"""Jobs measured on their own, put into results that are there."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

KINDS = ("studies", "jobs")
SAME = ("processor", "cores", "memory_gb", "system", "python")
"""What is the same of one machine."""


def kept_results(path: Path, *, quick: bool) -> dict[str, Any]:
    """The results in a file.

    Raises
    ------
    ValueError
        If there are none, or they are of another size.
    """
    try:
        kept: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ValueError(f"--merge: {path} holds no results ({error})") from None
    if kept["quick"] != quick:
        raise ValueError(f"--merge: {path} is of {'small' if kept['quick'] else 'full'} size")
    return kept


def machines(results: Mapping[str, Any]) -> tuple[list[Mapping[str, Any]], dict[str, int]]:
    """The machines that results come from, and each job's or study's place among them.

    Both sides of a pair ran on the same one; times of two machines stand beside each other in no figure.
    """
    found: list[Mapping[str, Any]] = [results["machine"]]
    places = {each["name"]: 0 for kind in KINDS for each in results.get(kind, [])}
    for entry in results.get("merged", []):
        held = [all(m[name] == entry["machine"][name] for name in SAME) for m in found]
        if not any(held):
            found.append(entry["machine"])
            held.append(True)
        places |= {name: held.index(True) for name in entry["jobs"] if name in places}
    return found, places


def merged(kept: Mapping[str, Any], new: Mapping[str, Any], order: Sequence[str]) -> dict[str, Any]:
    """Results with the jobs of the new ones in their places, and how those were measured.

    Parameters
    ----------
    kept, new
        Results as ``results.json`` holds them.
    order
        Names of all jobs and studies in the order of the page.
    """
    names = [each["name"] for kind in KINDS for each in new.get(kind, [])]
    found = {
        kind: {each["name"]: each for each in (*kept.get(kind, []), *new.get(kind, []))} for kind in KINDS
    }
    known = set(order)
    later = [
        {**entry, "jobs": [name for name in entry["jobs"] if name not in names and name in known]}
        for entry in kept.get("merged", [])
    ]
    how = {"jobs": names, **{key: new.get(key) for key in ("command", "machine", "repeats", "note")}}
    measured = set().union(*found.values())
    skipped = [left for left in (*kept["skipped"], *new["skipped"]) if left["name"] not in measured]
    return {
        **kept,
        **{kind: [found[kind][name] for name in order if name in found[kind]] for kind in KINDS},
        "skipped": list({left["name"]: left for left in skipped}.values()),
        "merged": [*(entry for entry in later if entry["jobs"]), *([how] if names else [])],
    }
