"""``fogml blind``: make blind cases, let a method answer them, score the answers, merge scored parts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(
    **options.APP_SETTINGS,
    no_args_is_help=True,
    help="The check on withheld effects: make cases, answer them, score.",
)

Folder = Annotated[str | None, typer.Argument(metavar="DIR", help="The suite's folder.")]
Final = Annotated[
    bool | None,
    typer.Option("--final", help="Use a final seed; the use is recorded in the ledger and the page."),
]
Ledger = Annotated[
    str | None, typer.Option("--ledger", metavar="FILE", help="(experiments/gap_blind/final_uses.json)")
]
Workers = Annotated[int | None, typer.Option("--workers", help="Processes (2).")]


@app.command()
def make(
    directory: Folder = None,
    count: Annotated[int | None, typer.Option("--count", "-n", help="Cases (1000).")] = None,
    first: Annotated[
        int | None, typer.Option("--first", metavar="N", help="Number of the first one (1).")
    ] = None,
    sample: Annotated[
        float | None, typer.Option("--sample", metavar="SECONDS", help="Interval (10).")
    ] = None,
    kinds: Annotated[
        list[str] | None, typer.Option("--kind", help="Only cases of this kind; may be repeated.")
    ] = None,
    least_d_prime: Annotated[
        float | None,
        typer.Option("--least-d-prime", metavar="D", help="Only strata of d' that begin there or above."),
    ] = None,
    d_prime: Annotated[
        list[str] | None,
        typer.Option(
            "--d-prime", metavar="LOW-HIGH", help="Draw d' within these bounds instead; may be repeated."
        ),
    ] = None,
    reality: Annotated[
        str | None,
        typer.Option(
            "--reality",
            metavar="NAME",
            help="first (default), second, third, mix for all in turn, or same-twin for a twin's own runs.",
        ),
    ] = None,
    leave_one_out: Annotated[
        bool | None,
        typer.Option("--leave-one-out", help="Only cases with an effect left out, each effect in turn."),
    ] = None,
    relatives_stay: Annotated[
        bool | None,
        typer.Option(
            "--relatives-stay/--relatives-out",
            help="Keep relatives of an effect that is left out among the candidates.",
        ),
    ] = None,
    workers: Workers = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Make cases from a reality that is not the twin, and their truth apart from them.

    Seeds from 1000000 on are kept for final figures. An interrupted call goes on where it was.
    """
    from fogml.cli.blind_job import MakeSettings, make_and_tell

    flags = {
        "directory": directory,
        "count": count,
        "first": first,
        "sample": sample,
        "kinds": kinds,
        "least_d_prime": least_d_prime,
        "d_prime": d_prime,
        "reality": reality,
        "leave_one_out": leave_one_out,
        "relatives_stay": relatives_stay,
        "workers": workers,
        "seed": seed,
    }
    make_and_tell(MakeSettings.gather(config, flags), Terminal(as_json, quiet))


@app.command()
def run(
    directory: Folder = None,
    methods: Annotated[
        list[str] | None,
        typer.Option(
            "--method",
            help="diagnosis (default), families, a baseline, 'baselines', or module:function; repeatable.",
        ),
    ] = None,
    code: Annotated[
        str | None, typer.Option("--code", metavar="FOLDER", help="Where module:function lies.")
    ] = None,
    name: Annotated[str | None, typer.Option("--name", help="What the answers are called.")] = None,
    workers: Workers = None,
    threads: Annotated[int | None, typer.Option("--threads", help="Threads of each process (1).")] = None,
    limit: Annotated[
        float | None, typer.Option("--limit", metavar="SECONDS", help="Time that a case may take (600).")
    ] = None,
    shard: Annotated[
        str | None, typer.Option("--shard", metavar="I/N", help="Every N-th case from the I-th on.")
    ] = None,
    retry: Annotated[bool | None, typer.Option("--retry", help="Try failed cases again.")] = None,
    cost: Annotated[
        float | None,
        typer.Option(
            "--cost-of-false-name",
            metavar="RATIO",
            help="Of 'families': a false name costs so many times what a missed one does (1).",
        ),
    ] = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Answer the cases that have no answer yet, in sealed processes that see a case's files alone."""
    from fogml.cli.blind_job import RunSettings, run_and_tell

    flags = {
        "directory": directory,
        "methods": methods,
        "code": code,
        "name": name,
        "workers": workers,
        "threads": threads,
        "limit": limit,
        "shard": shard,
        "retry": retry,
        "cost_of_false_name": cost,
        "seed": seed,
    }
    run_and_tell(RunSettings.gather(config, flags), Terminal(as_json, quiet))


@app.command()
def score(
    directory: Folder = None,
    methods: Annotated[
        list[str] | None, typer.Option("--method", help="Score these alone; may be repeated.")
    ] = None,
    gates: Annotated[
        list[str] | None,
        typer.Option(
            "--gate", metavar="FIGURE=VALUE", help="Limit on a figure of the diagnosis; 'wanted' for all."
        ),
    ] = None,
    final: Final = None,
    ledger: Ledger = None,
    workers: Workers = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Folder for what is written (DIR).")] = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Score every method's answers against the truth; exit status 1 where a gate is not met.

    Writes score.json, score.html and marks.json.gz; fogml blind merge makes one page of several of those.
    """
    from fogml.cli.blind_job import ScoreSettings, score_and_write

    flags = {
        "directory": directory,
        "methods": methods,
        "gates": gates,
        "final": final,
        "ledger": ledger,
        "workers": workers,
        "out": str(out) if out else None,
        "seed": seed,
    }
    if not score_and_write(ScoreSettings.gather(config, flags), Terminal(as_json, quiet)):
        raise typer.Exit(1)


@app.command()
def merge(
    marks: Annotated[
        list[str] | None, typer.Argument(metavar="MARKS...", help="Files marks.json.gz of a suite's parts.")
    ] = None,
    final: Final = None,
    ledger: Ledger = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Make one score of a suite's parts, which may have been made, answered and scored anywhere.

    Writes score.json, score.html and marks.json.gz. Cases that were made by kind or strength count in the
    figures of their kind alone.
    """
    from fogml.cli.blind_job import MergeSettings, merge_and_write

    flags = {
        "marks": marks,
        "final": final,
        "ledger": ledger,
        "out": str(out) if out else None,
        "seed": seed,
    }
    merge_and_write(MergeSettings.gather(config, flags), Terminal(as_json, quiet))
