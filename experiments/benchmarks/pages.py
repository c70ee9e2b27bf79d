"""Results as a page to read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

QUANTITIES = {"seconds": "s", "ratio": "×", "peak_mb": "MB"}


def results_page(results: Mapping[str, Any]) -> str:
    """Markdown of a ``results.json``."""
    machine = results["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items())
    lines = [
        "# Speed and memory",
        "",
        f"`{results['command']}` on {machine['processor']}, {machine['cores']} cores, "
        f"{machine['memory_gb']} GB, {machine['system']}, Python {machine['python']}, {machine['date']}.",
        f"{versions}.",
        "",
        f"Each pair ran {results['repeats']} times in turns after one run that is not counted; "
        "medians, with the least and the greatest in brackets. Ratio: the plain way's time over ours, "
        "median of the pairs. The results of the two were compared first. Memory is the greatest "
        "resident memory of a process that does the job once.",
        "",
        "| job | ours | plain | ratio | memory | limit |",
        "|---|---|---|---|---|---|",
    ]
    for job in results["jobs"]:
        memory = f"{job['peak_mb']:.0f} MB" if job["peak_mb"] is not None else ""
        lines.append(
            f"| {job['title']} | {_seconds(job['ours_s'])} | {_seconds(job['plain_s'])} "
            f"| {job['ratio']['median']:.3g} | {memory} | {_limits(job)} |"
        )
    lines += ["", "| job | ours | plain | compared |", "|---|---|---|---|"]
    lines += [
        f"| {job['name']} | {job['ours']} | {job['plain']} | {job['checked']} |" for job in results["jobs"]
    ]
    for left in results["skipped"]:
        lines += ["", f"Skipped: {left['title']}, {left['reason']}."]
    for entry in results.get("merged", []):
        lines += ["", _measured_later(entry, machine["versions"], results["repeats"])]
    busiest = max((job["load"] for job in results["jobs"]), default=0.0)
    lines += ["", f"Greatest load of the machine before a job: {busiest:.1f}."]
    return "\n".join(lines) + "\n"


def _measured_later(entry: Mapping[str, Any], versions: Mapping[str, str], repeats: int) -> str:
    """How jobs that were merged in were measured, where it differs from the rest."""
    machine = entry["machine"]
    changed = [
        f"{name} {number}" for name, number in machine["versions"].items() if versions.get(name) != number
    ]
    differs = [*changed, *([f"{entry['repeats']} pairs"] if entry["repeats"] != repeats else [])]
    told = f"; {', '.join(differs)}" if differs else ""
    return f"{', '.join(entry['jobs'])}: `{entry['command']}` on the same machine, {machine['date']}{told}."


def _seconds(spread: Mapping[str, Any]) -> str:
    return f"{spread['median']:.3g} s ({spread['least']:.3g}–{spread['greatest']:.3g})"


def _limits(job: Mapping[str, Any]) -> str:
    words = []
    for held in job["held"]:
        sign = "≥" if held["quantity"] == "ratio" else "≤"
        met = "met" if held["met"] else "**not met**"
        words.append(f"{sign} {held['limit']:g} {QUANTITIES[held['quantity']]}: {met}")
    return ", ".join(words)
