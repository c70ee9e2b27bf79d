"""``results.json`` and ``results.md``: what every part found, failures shown first."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from experiments.faults.sandbox import FAULTS
from experiments.results import write_results
from fogml import __version__


def write_part(folder: Path, part: str, found: Any) -> None:
    """Put one part's findings beside the others', and write the page of all."""
    path = folder / "results.json"
    known = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    if part == "kill" and part in known:
        # Kinds of job may be killed one after another.
        found = {**found, "jobs": {**known[part]["jobs"], **found["jobs"]}}
        found["notes"] = found["notes"] or known[part]["notes"]
        found["seconds"] += known[part]["seconds"]
    if part == "fuzz" and part in known and found["only"]:
        # Kinds whose faults were mended, and new ones, are spoiled alone, with other draws.
        alone = known[part].get("alone", {})
        before = known[part]["kinds"].keys() - {kind for kind, told in alone.items() if told.get("new")}
        found = {
            **known[part],
            "kinds": known[part]["kinds"] | found["kinds"],
            "alone": {
                **alone,
                **{
                    kind: {"inputs": found["inputs"], "seed": found["seed"], "new": kind not in before}
                    for kind in found["kinds"]
                },
            },
        }
    known |= {part: {**found, "version": __version__}}
    folder.mkdir(parents=True, exist_ok=True)
    write_results(folder, known, page(known))


def page(found: dict[str, Any]) -> str:
    """The page of all parts that are there."""
    lines = ["# Hostile, broken and interrupted", ""]
    lines += ["Synthetic inputs throughout; every figure is of the command that stands with it.", ""]
    for part, make in (("fuzz", _fuzz), ("kill", _kill), ("hostile", _hostile)):
        if part in found:
            lines += [*make(found[part]), ""]
    return "\n".join(lines).rstrip() + "\n"


def _fuzz(found: dict[str, Any]) -> list[str]:
    kinds = {name: Counter(counts) for name, counts in found["kinds"].items()}
    total: Counter[str] = sum(kinds.values(), Counter())
    failed = {fault: total[fault] for fault in FAULTS}
    limits = found["limits"]
    return [
        "## Spoiled inputs",
        "",
        f"`python -m experiments.faults fuzz --inputs {found['inputs']} --seed {found['seed']}`, "
        f"{found['seconds'] / 60:.0f} min. An input may take {limits['cpu_s']:g} s of processor time, "
        f"{limits['wall_s']:g} s in all and {limits['memory_bytes'] / 2**20:g} MiB.",
        "",
        f"**{total['inputs']:,} inputs: "
        + ", ".join(f"{number} {_plural(name)}" for name, number in failed.items())
        + ".**",
        "",
        f"{total['exit 0']:,} ended with exit 0, {total['exit 1']:,} with 1, {total['exit 2']:,} with 2. For "
        f"{total['compared']:,} of them the values read were compared with an independent reader's.",
        "",
        *found.get("notes", ()),
        *_alone(found.get("alone", {})),
        "",
        "| kind | inputs | exit 0 | exit 1 | exit 2 | compared | failed |",
        "|---|---:|---:|---:|---:|---:|---|",
        *[
            f"| {name} | {count['inputs']:,} | {count['exit 0']:,} | {count['exit 1']:,} "
            f"| {count['exit 2']:,} | {count['compared']:,} | {_failures(count)} |"
            for name, count in kinds.items()
        ],
        "",
        "| failure | means |",
        "|---|---|",
        *[f"| {name} | {meaning} |" for name, meaning in FAULTS.items()],
    ]


def _alone(kinds: dict[str, dict[str, Any]]) -> list[str]:
    """Which kinds were spoiled alone, by run."""
    runs: dict[tuple[int, int, bool], list[str]] = {}
    for name, told in kinds.items():
        runs.setdefault((told["inputs"], told["seed"], told.get("new", False)), []).append(name)
    return [
        f"{', '.join(names)}: {'alone' if is_new else 'again after what had failed in them was mended'}, "
        f"{inputs:,} inputs of seed {seed} with `--only`."
        for (inputs, seed, is_new), names in runs.items()
    ]


def _failures(count: Counter[str]) -> str:
    return ", ".join(f"{count[fault]} {_plural(fault)}" for fault in FAULTS if count[fault]) or "0"


def _plural(fault: str) -> str:
    return {
        "traceback": "tracebacks", "crash": "crashes", "hang": "hangs",
        "memory": "over the limit of memory", "message": "without one message",
        "noise": "with a library's text",
        "left": "with something left", "input changed": "inputs changed", "not finite": "not finite",
        "silent change": "silent changes", "ran code": "that ran code",
    }[fault]  # fmt: skip


def _kill(found: dict[str, Any]) -> list[str]:
    rows = found["jobs"]
    lost = sum(row["failed"] for row in rows.values())
    kills = sum(row["kills"] for row in rows.values())
    return [
        "## Kills",
        "",
        f"`python -m experiments.faults kill --seed {found['seed']} --each KILLS --only JOB`, "
        f"{found['seconds'] / 60:.0f} min: SIGKILL, SIGTERM and SIGINT in turn, at moments "
        "uniform over the job's duration.",
        "",
        f"**{kills} kills, {lost} after which something was wrong.**",
        "",
        "| job | kills | ended before | nothing there | as before | whole | resumed the same | wrong |",
        "|---|---:|---:|---:|---:|---:|---:|---|",
        *[
            f"| {name} | {row['kills']} | {row['ended']} | {row['absent']} | {row['old']} | {row['whole']} "
            f"| {row['resumed']} | {row['failed'] or 0}{_reasons(row)} |"
            for name, row in rows.items()
        ],
        "",
        *found["notes"],
    ]


def _reasons(row: dict[str, Any]) -> str:
    reasons = ", ".join(f"{count} {name}" for name, count in row["reasons"].items())
    return f" ({reasons})" if reasons else ""


def _hostile(found: dict[str, Any]) -> list[str]:
    rows = found["inputs"]
    wrong = [row for row in rows if not row["held"]]
    return [
        "## Hostile inputs by name",
        "",
        f"`python -m experiments.faults hostile`: {len(rows)} inputs, {len(wrong)} that did not hold.",
        "",
        *found.get("notes", ()),
        "",
        "| input | what happens | held |",
        "|---|---|---|",
        *[
            f"| {_cell(row['name'])} | {_cell(row['told'])} | {'yes' if row['held'] else '**no**'} |"
            for row in rows
        ],
    ]


def _cell(text: str) -> str:
    plain = " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
    return plain if len(plain) <= 220 else plain[:217] + "…"
