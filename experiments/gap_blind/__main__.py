"""The diagnosis on a small suite of each reality: every wanted figure by reality, and by distance of form.

``python -m experiments.gap_blind DIR`` makes, answers and scores the parts of ``config.yaml``
in DIR and writes ``results.json`` and ``results.md`` of all that are there; an interrupted call goes on
where it was. Each reality alone: ``--reality NAME``; the others then stand as they were found before. With
``--answered`` the page is of those cases alone that have an answer by now. ``--beside NAME`` has another
method answer the same cases, for a column beside.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fogml.blind.folders import DIAGNOSIS, OUTCOME, BlindFolder
from fogml.blind.methods import BASELINES
from fogml.blind.plan import SAME_TWIN, record_use, uses
from fogml.blind.score import gather, marks_of
from fogml.blind.scoring.by_reality import ALL, by_form, by_reality
from fogml.blind.scoring.marks import Mark
from fogml.blind.scoring.marks_file import MARKS, Marks, read_marks, write_marks
from fogml.blind.scoring.statistics import proportion
from fogml.blind.truth import read_truth
from fogml.cli.blind import MakeSettings, RunSettings
from fogml.cli.blind_job import make_and_tell, run_and_tell
from fogml.cli.terminal import Terminal
from fogml.numerals import MISSING, plural
from fogml.outputs import whole_file
from fogml.report.blind_tables import figure_text, value_text, wanted_text
from fogml.report.gap_tiles import ERROR_RATES, error_rates
from fogml.yaml_text import read_yaml

HERE = Path(__file__).parent


def main() -> None:
    """Make, answer and score what is asked for; write the page of all that there is."""
    config = dict(read_yaml(HERE / "config.yaml"))
    choices = [*config["realities"], SAME_TWIN]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("directory", type=Path, help="where the suites lie or are made")
    parser.add_argument("--reality", action="append", choices=choices, help="this one alone; may be repeated")
    parser.add_argument("--method", default=DIAGNOSIS, help="what answers (diagnosis)")
    parser.add_argument(
        "--beside", action="append", default=[], choices=BASELINES, help="another method, too"
    )
    parser.add_argument("--share", type=float, help="how much of each part (1; with --final 9)")
    parser.add_argument("--page", action="store_true", help="the page of what is there alone")
    parser.add_argument("--answered", action="store_true", help="the page of the cases answered by now alone")
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    parser.add_argument("--final", action="store_true", help="the seed and numbers kept for final figures")
    given = parser.parse_args()
    ledger = HERE / "final_uses.json" if given.final else None
    if given.final:
        config |= config["final"]
    given.share = given.share or config.get("share", 1.0)
    for reality in () if given.page or given.answered else given.reality or choices:
        for part in _parts(config, reality):
            _do(given, config, reality, part, ledger)
    found = _found(given.directory, given.method)
    marks = _marks_of(found, given.method)
    if given.answered:
        suites = [BlindFolder(path.parent) for path in sorted(given.directory.glob("*/*/cases"))]
        marks = [mark for suite in suites for mark in answered_marks(suite, given.method, given.workers)]
    others = {name: _marks_of(_found(given.directory, name), name) for name in BASELINES}
    even = None if given.answered else evenly(found, given.method, config["parts"])
    values = told(marks, choices, config["seed"], given.method, given.final, others, even)
    if ledger is not None:
        hashes = "\n".join(one.truth for one in found.values())
        figures = {row["key"]: row["value"] for row in values["by_reality"][ALL]}
        digest = hashlib.sha256(hashes.encode()).hexdigest()
        own = {name: count for name, count in values["cases"].items() if name != SAME_TWIN}
        with whole_file(ERROR_RATES) as partial:
            rates = error_rates(values["by_reality"][ALL], own, [config["seed"]], final=True)
            partial.write_text(json.dumps(rates, indent=1) + "\n", encoding="utf-8")
        # The same figures of the same cases are no second look.
        if not any(u["truth"] == digest and u["figures"].get(given.method) == figures for u in uses(ledger)):
            record_use(ledger, config["seed"], len(marks), digest, {given.method: figures})
    with whole_file(HERE / "results.md") as partial:
        partial.write_text(page(values), encoding="utf-8")
    with (HERE / "results.json").open("w", encoding="utf-8") as file:
        json.dump(values, file, indent=1)
        file.write("\n")


def _found(directory: Path, method: str) -> dict[Path, Marks]:
    """The scored parts of a method, by their files."""
    return {path: read_marks(path) for path in sorted(directory.glob(f"*/*/{method}-{MARKS}"))}


def _marks_of(found: Mapping[Path, Marks], method: str) -> list[Mark]:
    return [mark for one in found.values() for mark in one.methods[method]]


def evenly(found: Mapping[Path, Marks], method: str, parts: Sequence[Mapping[str, Any]]) -> list[Mark]:
    """The first marks of each part: the same share of each one's planned number."""
    counts = {part["name"]: part["count"] for part in parts}
    names = {path: path.parent.name for path in found if path.parent.name in counts}
    held = [(counts[name], found[path].methods[method]) for path, name in names.items()]
    share = min((len(marks) / count for count, marks in held), default=0.0)
    return [mark for count, marks in held for mark in marks[: round(share * count)]]


def answered_marks(folder: BlindFolder, method: str, workers: int = 1) -> list[Mark]:
    """Marks of the cases of a suite that a method has answered by now, failures among them."""
    answers = folder.answers(method)
    names = [name for name in folder.names() if (answers / name / OUTCOME).is_file()]
    truths = [read_truth(folder.truth / f"{name}.json") for name in names]
    return marks_of(folder, [method], truths, workers=workers)[method] if truths else []


def told(
    marks: Sequence[Mark],
    realities: Sequence[str],
    seed: int,
    method: str,
    final: bool,
    others: Mapping[str, Sequence[Mark]] | None = None,
    even: Sequence[Mark] | None = None,
) -> dict[str, Any]:
    """What ``results.json`` holds of some marks; `others` are those of other methods on the same cases.

    Figures over several kinds of case are of `even`, if given.
    """
    drawn = _drawn(marks)
    asked = set(map(_case, drawn))
    beside = {name: [m for m in _drawn(held) if _case(m) in asked] for name, held in (others or {}).items()}
    return {
        "seed": seed,
        "final": final,
        "method": method,
        "by_reality": by_reality(drawn, even),
        "even_cases": len(drawn if even is None else even),
        "by_form": by_form(drawn),
        "beside": {name: by_reality(held)[ALL] for name, held in beside.items() if held},
        "same_twin": list(same_twin(marks)),
        "cases": {name: sum(m.truth.reality == name for m in marks) for name in realities},
        "code": sorted({m.code or "" for m in marks}),
    }


def _case(mark: Mark) -> tuple[str, str, str, float]:
    """What tells a case from all others: parts of one kind number theirs alike, and differ by d'."""
    truth = mark.truth
    return truth.reality, truth.kind, truth.case, truth.d_prime


def _drawn(marks: Sequence[Mark]) -> list[Mark]:
    return [m for m in marks if m.truth.reality != SAME_TWIN]


def _parts(config: Mapping[str, Any], reality: str) -> list[dict[str, Any]]:
    return list(config["same_twin"] if reality == SAME_TWIN else config["parts"])


def _do(
    given: argparse.Namespace,
    config: Mapping[str, Any],
    reality: str,
    part: Mapping[str, Any],
    ledger: Path | None,
) -> None:
    """Make, answer and score one part."""
    folder = BlindFolder(given.directory / reality / part["name"])
    terminal = Terminal()
    terminal.say(f"{reality}, {part['name']}")
    drawn = {key: part[key] for key in ("kinds", "d_prime") if key in part}
    made = MakeSettings(
        directory=str(folder.path),
        count=max(round(given.share * part["count"]), 1),
        seed=config["seed"],
        sample=part.get("sample", config["sample"]),
        reality=reality,
        workers=given.workers,
        **drawn,
    )
    make_and_tell(made, terminal)
    methods = [given.method, *(given.beside if reality != SAME_TWIN else [])]
    answered = RunSettings(
        directory=str(folder.path), methods=methods, workers=given.workers, limit=config["limit"]
    )
    run_and_tell(answered, terminal)
    for name in methods:
        marks = gather(folder, [name], ledger, workers=given.workers)
        write_marks(folder.path / f"{name}-{MARKS}", marks)


def same_twin(marks: Sequence[Mark]) -> Iterator[dict[str, Any]]:
    """Of a shipped twin's own runs, by interval: how many answers 'no gap', and what was named instead."""
    own = [m for m in marks if m.truth.reality == SAME_TWIN]
    for sample_s in sorted({m.truth.sample_s for m in own}):
        here = [m for m in own if m.truth.sample_s == sample_s]
        right = proportion([m.verdict == "no_gap" for m in here])
        yield {
            "sample_s": sample_s,
            "cases": len(here),
            "no_gap": right.value,
            "low": right.low,
            "high": right.high,
            "named": sorted(item.effect for m in here for item in m.named),
            "verdicts": sorted(m.verdict for m in here if m.verdict != "no_gap"),
        }


def page(values: Mapping[str, Any]) -> str:
    """``results.md`` of what ``results.json`` holds."""
    names = list(values["by_reality"])
    places = range(len(values["by_reality"][names[0]]))
    kept = "kept for final figures" if values["final"] else "one to develop on: no final figures"
    counted = ", ".join(f"{name} {count}" for name, count in values["cases"].items())
    return "\n".join(
        [
            "# The diagnosis by reality",
            "",
            f"Synthetic cases at 10 s, method {values['method']}, seed {values['seed']}, which is {kept}. "
            f"Cases: {counted}, answered by {plural(len(values['code']), 'state')} of the code. "
            "Each figure with its 95 % interval "
            "(Wilson's for shares) and how many cases, names or runs it rests on; wanted figures ask for 400 "
            f"cases each.{_even_words(values)} Forms of the first reality lie near the catalogue's, those of "
            "the others were drawn without asking how near. A far form that is called by its name is right; "
            "called unknown it is a miss.",
            "",
            f"| figure | wanted | {' | '.join(names)} |",
            f"|---|---:|{'---:|' * len(names)}",
            *(_line(values["by_reality"], place, names) for place in places),
            "",
            *_beside_lines(values),
            "## Single effects by distance of form",
            "",
            "Cosine of the true effect with the best member of the catalogue's form, whitened and beside "
            "the nominal constants.",
            "",
            "| reality | cosine | d′ | cases | class right | exact | called unknown |",
            "|---|---|---|---:|---:|---:|---:|",
            *(_form_line(cell) for cell in values["by_form"]),
            "",
            *twin_lines(values["same_twin"]),
        ]
    )


def _even_words(values: Mapping[str, Any]) -> str:
    """What figures over several kinds of case rest on, where kinds have different shares of cases."""
    every = sum(count for name, count in values["cases"].items() if name != SAME_TWIN)
    if values["even_cases"] == every:
        return ""
    return (
        f" Figures over several kinds of case rest on {values['even_cases']} of them, of which each kind has "
        "its planned share."
    )


def _beside_lines(values: Mapping[str, Any]) -> list[str]:
    """The section of other methods on the same cases; none where there are none."""
    if not values.get("beside"):
        return []
    columns = {values["method"]: values["by_reality"][ALL], **values["beside"]}
    places = range(len(values["by_reality"][ALL]))
    return [
        "## Other ways on the same cases",
        "",
        "All realities together. The oracle is told which effects act, and fits their catalogue's forms: "
        "what the data allow to one who knows.",
        "",
        f"| figure | wanted | {' | '.join(columns)} |",
        f"|---|---:|{'---:|' * len(columns)}",
        *(_line(columns, place, list(columns)) for place in places),
        "",
    ]


def _line(parts: Mapping[str, Sequence[Mapping[str, Any]]], place: int, names: Sequence[str]) -> str:
    row = parts[names[0]][place]
    cells = (parts[name][place] for name in names)
    told = (MISSING if c["value"] is None else f"{figure_text(c)}; {c['n']}" for c in cells)
    return f"| {row['words']} | {wanted_text(row)} | {' | '.join(told)} |"


def _form_line(cell: Mapping[str, Any]) -> str:
    low, high = cell["d_prime"]
    told = (value_text(cell[key]["value"], "percent") for key in ("right", "exact", "unknown"))
    window = f"{low:g}–{high:g}"
    rest = f"{window} | {cell['right']['n']} | {' | '.join(told)}"
    return f"| {cell['reality']} | {cell['form'] or MISSING} | {rest} |"


def twin_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """The section on a shipped twin's own runs."""
    return [
        "## A shipped twin's own runs, diagnosed against it",
        "",
        "Thermometers as shipped, nothing missing: wanted is 'no gap' at every interval.",
        "",
        "| interval | cases | 'no gap' | named instead | other verdicts |",
        "|---|---:|---:|---|---|",
        *map(_twin_line, rows),
        "",
    ]


def _twin_line(row: Mapping[str, Any]) -> str:
    share = figure_text({"value": row["no_gap"], "low": row["low"], "high": row["high"], "format": "percent"})
    named, verdicts = (", ".join(row[key]) or MISSING for key in ("named", "verdicts"))
    return f"| {row['sample_s']:g} s | {plural(row['cases'], 'case')} | {share} | {named} | {verdicts} |"


if __name__ == "__main__":
    main()
