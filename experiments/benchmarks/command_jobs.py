"""Jobs that start a Python: import and help."""

from __future__ import annotations

from pathlib import Path

from experiments.benchmarks.harness import Job, Timed, Work, run_python

_IMPORT = "import time; t = time.perf_counter(); import {name}; print(time.perf_counter() - t)"
_HELP = "import sys; sys.argv = ['fogml', '--help']; from fogml.cli.main import main; main()"


def _import(quick: bool, folder: Path) -> Work:
    def timed(name: str) -> Timed:
        seconds = float(run_python(["-c", _IMPORT.format(name=name)]).output)
        return Timed(seconds, seconds)

    def check(a: float, b: float) -> str:
        assert a > 0 and b > 0
        return "both import"

    return Work(lambda: timed("fogml"), lambda: timed("numpy"), check)


def _help(quick: bool, folder: Path) -> Work:
    def timed(code: str) -> Timed:
        ran = run_python(["-c", code])
        return Timed(ran.seconds, ran.output)

    def check(a: str, b: str) -> str:
        assert "train" in a and "compensate" in a
        return "help names the commands"

    return Work(lambda: timed(_HELP), lambda: timed("import click, rich"), check)


COMMAND_JOBS = (
    Job("import", "import fogml", "import fogml", "import numpy", _import, limit_s=0.1),
    Job(
        "help",
        "fogml --help, from starting Python to its end",
        "fogml --help",
        "starting Python and importing click and rich",
        _help,
        limit_s=0.3,
    ),
)
