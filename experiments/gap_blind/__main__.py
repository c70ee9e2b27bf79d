"""The check on withheld effects in full: make the cases, answer them by every method, score.

``python -m experiments.gap_blind DIR`` makes, answers and scores each part of the suite in DIR/NAME, where
DIR may be on another disk, and writes ``score.json`` and ``score.html`` of all parts into DIR. An
interrupted call goes on where it was. With ``--final`` it uses the seed that is kept for final figures,
records that, and writes beside itself instead: the score, and each part's marks as
``marks-NAME.json.gz``. Reports of the worst cases lie in DIR; the page is there, too, with links to them.
How often the diagnosis was right goes to ``fogml/report/error_rates.json``, which its pages tell.

Parts may be done on different days or on machines that share nothing, each with ``--part NAME``: wherever
one is scored, the score is made of all marks of the seed that are there. On a cluster with a shared disk:
once ``--stage make``, then on each of n machines ``--stage run --shard i/n``, then once ``--stage score``.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fogml.blind.folders import DIAGNOSIS
from fogml.blind.scoring.by_reality import ALL
from fogml.blind.scoring.marks_file import MARKS, read_marks
from fogml.cli.blind import MakeSettings, MergeSettings, RunSettings, ScoreSettings
from fogml.cli.blind_job import (
    make_and_tell,
    merge_and_write,
    run_and_tell,
    score_and_write,
)
from fogml.cli.blind_reports import link_reports
from fogml.cli.terminal import Terminal
from fogml.outputs import whole_file
from fogml.report import blind_page
from fogml.report.error_rates import ERROR_RATES, error_rates
from fogml.yaml_text import read_yaml

HERE = Path(__file__).parent
STAGES = ("make", "run", "score")
LEDGER = str(HERE / "final_uses.json")
PART_MARKS = "marks-{}.json.gz"


def main() -> None:
    """All stages of all parts, or some."""
    config = read_yaml(HERE / "config.yaml")
    given = _parser(part["name"] for part in config["final"]["parts"]).parse_args()
    suite = config["final" if given.final else "development"]
    stages = (given.stage,) if given.stage else STAGES
    terminal = Terminal()
    # What a final seed gave is kept beside the experiment.
    home = HERE if given.final else Path(given.directory)
    for part in suite["parts"]:
        if given.part and part["name"] not in given.part:
            continue
        terminal.say(f"part {part['name']}")
        _do(given, config, suite["seed"], part, stages, terminal)
        if "score" in stages:
            with whole_file(home / PART_MARKS.format(part["name"])) as partial:
                shutil.copyfile(Path(given.directory) / part["name"] / MARKS, partial)
    if "score" in stages:
        _merge(home, suite["seed"], given.final, terminal)
        if given.final:
            _tell_elsewhere(home, Path(given.directory), terminal)


def _parser(names: Any) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("directory", help="where the suite lies or is made")
    parser.add_argument("--final", action="store_true", help="the seed kept for final figures")
    parser.add_argument(
        "--part", action="append", choices=list(names), help="this part alone; may be repeated"
    )
    parser.add_argument("--stage", choices=STAGES, help="one stage alone")
    parser.add_argument("--shard", default="1/1", help="every n-th case from the i-th on, i/n")
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    parser.add_argument("--count", type=int, help="at most so many cases of each part, to try it")
    return parser


def _do(
    given: argparse.Namespace,
    config: Mapping[str, Any],
    seed: int,
    part: Mapping[str, Any],
    stages: Sequence[str],
    terminal: Terminal,
) -> None:
    """The stages of one part."""
    directory = str(Path(given.directory) / part["name"])
    if "make" in stages:
        keys = ("first", "kinds", "least_d_prime", "d_prime", "reality")
        drawn = {key: part[key] for key in keys if key in part}
        make_and_tell(
            MakeSettings(
                directory=directory,
                count=min(part["count"], given.count or part["count"]),
                seed=seed,
                sample=config["sample"],
                workers=given.workers,
                **drawn,
            ),
            terminal,
        )
    if "run" in stages:
        run_and_tell(
            RunSettings(
                directory=directory,
                methods=part.get("methods", config["methods"]),
                workers=given.workers,
                limit=config["limit"],
                shard=given.shard,
            ),
            terminal,
        )
    if "score" in stages:
        settings = ScoreSettings(directory=directory, final=given.final, ledger=LEDGER, workers=given.workers)
        score_and_write(settings, terminal)


def _merge(home: Path, seed: int, final: bool, terminal: Terminal) -> None:
    """One score of all marks of the seed."""
    found = []
    for path in sorted(home.glob(PART_MARKS.format("*"))):
        held = read_marks(path).seed
        if held == seed:
            found.append(str(path))
        else:
            terminal.say(f"{path.name} is left out: it is of seed {held}, not {seed}")
    merge_and_write(MergeSettings(marks=found, final=final, ledger=LEDGER, out=str(home)), terminal)
    # The parts' own marks lie there already, and the configuration that made this one is `config.yaml`.
    (home / MARKS).unlink()
    (home / "score.yaml").unlink()


def _tell_elsewhere(home: Path, directory: Path, terminal: Terminal) -> None:
    """The page where the cases lie, linked to their reports; error rates for pages of diagnoses."""
    values = json.loads((home / "score.json").read_text(encoding="utf-8"))
    if DIAGNOSIS in values["methods"]:
        tables = values["methods"][DIAGNOSIS]["by_reality"]
        cases = {name: max(row["cases"] for row in rows) for name, rows in tables.items() if name != ALL}
        rates = error_rates(tables[ALL], cases, [values["seed"]], final=True)
        with whole_file(ERROR_RATES) as partial:
            partial.write_text(json.dumps(rates, indent=1) + "\n", encoding="utf-8")
    link_reports(values, sorted(path.parent for path in directory.glob(f"*/{MARKS}")), directory)
    with whole_file(directory / "score.html") as partial:
        partial.write_text(blind_page(values), encoding="utf-8")
    terminal.say(f"Linked to the reports of the worst cases that lie there: {directory / 'score.html'}")


if __name__ == "__main__":
    main()
