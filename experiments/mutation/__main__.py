"""Whether the tests notice changes of one operator or number: ``python -m experiments.mutation``.

Draws changes over all packages with a fixed seed, makes each in a copy of the project and runs the tests of
its own package that cover it. Needs the package coverage. Interrupted, it goes on where it was.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import tempfile
from pathlib import Path

from experiments.mutation.forked import loaded_before
from experiments.mutation.mutants import drawn
from experiments.mutation.page import page_of
from experiments.mutation.trials import copied, tried
from experiments.results import write_results

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def main() -> None:
    """Try the changes and write down what became of them."""
    parser = argparse.ArgumentParser(prog="python -m experiments.mutation", description=__doc__)
    parser.add_argument("--count", type=int, default=300, help="changes drawn over all code")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--packages", nargs="*", metavar="NAME", help="only the drawn changes of these")
    parser.add_argument("--first", type=int, help="only so many of them")
    parser.add_argument("--most", type=float, default=60.0, help="time of the tests of a change [s]")
    parser.add_argument(
        "--unmeasured", action="store_true", help="run the tests that import a file, whatever they cover"
    )
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "fogml-mutation")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of results.json and results.md")
    asked = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # a file that is changed is put right
    loaded_before("experiments.mutation.loaded")
    asked.work.mkdir(parents=True, exist_ok=True)
    tree = copied(ROOT, asked.work.resolve())
    every = drawn(tree, asked.count, asked.seed)
    chosen = [one for one in every if asked.packages is None or one.package in asked.packages][: asked.first]
    rows = []
    for row in tried(tree, chosen, asked.work.resolve(), asked.most, not asked.unmeasured):
        rows.append(row)
        print(f"{len(rows)} of {len(chosen)}: {row['state']}: {row['key']} ({row['seconds']} s)", flush=True)
    explained = json.loads((HERE / "explained.json").read_text(encoding="utf-8"))
    write_results(asked.out, rows, page_of(rows, len(every), asked.seed, explained))


if __name__ == "__main__":
    main()
