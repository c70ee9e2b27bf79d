"""Results as a page to read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from experiments.benchmarks.merging import machines
from experiments.benchmarks.reasons import lost_pairs

QUANTITIES = {"seconds": "s", "ratio": "×", "peak_mb": "MB"}


def results_page(results: Mapping[str, Any]) -> str:
    """Markdown of a ``results.json``."""
    machine = results["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items())
    marks = _machine_marks(results)
    lines = [
        "# Accuracy, speed and memory beside what a user would pick instead",
        "",
        f"`{results['command']}` on {_described(machine)}, {machine['date']}, "
        f"{_threads(machine)}{_note(results)}.",
        f"{versions}.",
    ]
    lines += [line for told in _measured_later(results) for line in ("", told)]
    if marks:
        lines += ["", *_machines(results)]
    for left in results["skipped"]:
        lines += ["", f"Skipped: {left['title']}, {left['reason']}."]
    for study in results.get("studies", []):
        title = f"{study['title'][0].upper()}{study['title'][1:]}{marks.get(study['name'], '')}"
        lines += ["", f"## {title}", "", _section(study)]
    if results.get("studies"):
        lines += ["", "## Peers", "", *_peers()]
    if not results["jobs"]:
        return "\n".join(lines) + "\n"
    lines += [
        "",
        "## Pairs",
        "",
        f"Each pair ran {results['repeats']} times in turns after one run that is not counted; "
        "medians, with the least and the greatest in brackets. Ratio: the plain way's time over ours, "
        "median of the pairs. The results of the two were compared first. Memory is the greatest "
        "resident memory of a process that does the job once.",
        "",
        "| job | beside | ours | plain | ratio | memory | limit |",
        "|---|---|---|---|---|---|---|",
    ]
    for job in results["jobs"]:
        memory = f"{job['peak_mb']:.0f} MB" if job["peak_mb"] is not None else ""
        lines.append(
            f"| {job['title']}{marks.get(job['name'], '')} | {job['plain'].split(',')[0]} "
            f"| {_seconds(job['ours_s'])} | {_seconds(job['plain_s'])} "
            f"| {job['ratio']['median']:.3g} | {memory} | {_limits(job)} |"
        )
    lines += ["", "| job | ours | plain | compared |", "|---|---|---|---|"]
    lines += [
        f"| {job['name']} | {job['ours']} | {job['plain']} | {job['checked']} |" for job in results["jobs"]
    ]
    lost = lost_pairs(results["jobs"])
    if lost:
        lines += ["", "Where the plain way is faster:", "", *lost]
    busiest = max((job["load"] for job in results["jobs"]), default=0.0)
    lines += ["", f"Greatest load of the machine before a job: {busiest:.1f}."]
    return "\n".join(lines) + "\n"


def _section(study: Mapping[str, Any]) -> str:
    from experiments.benchmarks.jobs import STUDIES

    return next(each for each in STUDIES if each.name == study["name"]).page(study)


def _peers() -> list[str]:
    """What each name in the tables stands for."""
    from experiments.benchmarks.peers import PEERS

    lines = ["| name | what | inputs | rows at most | set by the search |", "|---|---|---|---:|---|"]
    for peer in PEERS:
        most = f"{peer.most_rows:,}" if peer.most_rows else "all"
        lines.append(f"| {peer.name} | {peer.title} | {peer.features} | {most} | {', '.join(peer.ranges)} |")
    return [
        *lines,
        "",
        "More rows than that are averaged over blocks of time. Not all of a recording fits every peer: a "
        "Gaussian process on 10,000 rows needs 0.8 GB for its matrix and a third of a Tflop for each of some "
        "hundred steps of its search, SVR and KernelRidge take time in the square or cube of their rows.",
    ]


def _threads(machine: Mapping[str, Any]) -> str:
    return f"OMP_NUM_THREADS {machine.get('threads', 'all cores')}"


def _note(results: Mapping[str, Any]) -> str:
    return f"; {results['note']}" if results.get("note") else ""


def _described(machine: Mapping[str, Any]) -> str:
    return (
        f"{machine['processor']}, {machine['cores']} cores, {machine['memory_gb']} GB, "
        f"{machine['system']}, Python {machine['python']}"
    )


def _machine_marks(results: Mapping[str, Any]) -> dict[str, str]:
    """What stands behind a title to say which machine it was measured on; nothing for a single machine."""
    found, places = machines(results)
    return {name: f" ({_letter(i)})" for name, i in places.items()} if len(found) > 1 else {}


def _machines(results: Mapping[str, Any]) -> list[str]:
    found = machines(results)[0]
    words = [f"{_letter(i)}: {_described(machine)}" for i, machine in enumerate(found)]
    told = "; ".join(words)
    return [f"Letters behind titles say the machine, the same for both sides of a pair. {told}."]


def _letter(place: int) -> str:
    return chr(ord("A") + place)


def _measured_later(results: Mapping[str, Any]) -> list[str]:
    """How measurements that were merged in were made, where it differs from the rest."""
    versions = results["machine"]["versions"]
    found, places = machines(results)
    names: dict[str, list[str]] = {}
    for entry in results.get("merged", []):
        machine = entry["machine"]
        differs = [
            f"{name} {number}" for name, number in machine["versions"].items() if versions.get(name) != number
        ]
        if _threads(machine) != _threads(results["machine"]):
            differs.append(_threads(machine))
        if entry["repeats"] != results["repeats"]:
            differs.append(f"{entry['repeats']} pairs")
        told = f"; {', '.join(differs)}" if differs else ""
        quick = " --quick" if results["quick"] else ""
        command = f"`python -m experiments.benchmarks{quick} --merge --only NAME`"
        letter = f", machine {_letter(places[entry['jobs'][0]])}" if len(found) > 1 else ""
        how = f"{command}{letter}, {machine['date']}{told}{_note(entry)}"
        names.setdefault(how, []).extend(entry["jobs"])
    return [f"Measured by {how}: {', '.join(jobs)}." for how, jobs in names.items()]


def _seconds(spread: Mapping[str, Any]) -> str:
    return f"{spread['median']:.3g} s ({spread['least']:.3g}–{spread['greatest']:.3g})"


def _limits(job: Mapping[str, Any]) -> str:
    words = []
    for held in job["held"]:
        sign = "≥" if held["quantity"] == "ratio" else "≤"
        met = "met" if held["met"] else "**not met**"
        words.append(f"{sign} {held['limit']:.3g} {QUANTITIES[held['quantity']]}: {met}")
    return ", ".join(words)
