"""``fogml benchmark``: make a round of the open benchmark, let methods answer it, score the answers."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from fogml.benchmark.rounds import SEED, TRACKS, Track, read_round
from fogml.cli import options
from fogml.cli.settings import Settings, placed, setting
from fogml.cli.terminal import Terminal
from fogml.errors import InputError, counted
from fogml.json_files import write_json
from fogml.outputs import whole_file, whole_folder

_NO_ROUND = "no folder is given; name the round's folder"


class RoundSettings(Settings):
    """What every job on a round takes."""

    directory: str | None = placed(
        None,
        "DIR",
        "The round's folder.",
        reads=True,
        needed=_NO_ROUND,
        lost="no such folder; make a round first: fogml benchmark make DIR",
    )

    def folder(self) -> str:
        """The round's folder."""
        assert self.directory
        return self.directory


class MakeSettings(RoundSettings):
    """Make a round: what is handed out, the answers that are kept, and salted hashes of them.

    The seed of an open round is stated and anyone can make the same; that of a closed one is drawn and kept.
    """

    job: ClassVar[str] = "fogml.cli.benchmark:make_and_tell"
    directory: str | None = placed(None, "DIR", "The round's folder.", writes=True, needed=_NO_ROUND)
    seed: int = setting(
        SEED, "Seed of an open round; 2026 is the one whose results ship.", ge=0, lt=1_000_000
    )
    closed: bool = setting(False, "Draw the seed, and keep it.", "--closed")
    drift: int = setting(12, "Synthetic units of the drift track.", metavar="N")
    diagnosis: int = setting(12, "Cases of the diagnosis track.", metavar="N")
    real: bool = setting(True, "With the real legs that ship.", "--real/--no-real")
    workers: options.Workers = 2


class RunSettings(RoundSettings):
    """Answer the cases that have no answer yet, in sealed processes that see a case's files alone."""

    job: ClassVar[str] = "fogml.cli.benchmark:run_and_tell"
    track: Track = setting("drift", "Which track.", metavar="|".join(TRACKS))
    methods: list[str] = setting(
        [],
        "Drift: a model's name; diagnosis: a method of 'blind run'; or module:function. Repeatable.",
        "--method",
        metavar="NAME",
        known="fogml.models.names:model_names",
        needed="no method is given; name one: --method auto",
    )
    features: options.Features = None
    code: str | None = setting(
        None, "Where module:function lies.", metavar="FOLDER", reads=True, lost="no such folder"
    )
    name: str | None = setting(None, "What the answers are called.", metavar="NAME")
    workers: options.Workers = 2
    limit: float = setting(600.0, "Time that a case may take.", metavar="SECONDS")
    retry: bool = setting(False, "Try failed cases again.", "--retry")


class ScoreSettings(RoundSettings):
    """Score every entry against the answers that were kept.

    Refuses an entry that lacks a case or holds a number that is not finite. Writes score.json and score.html.
    """

    job: ClassVar[str] = "fogml.cli.benchmark:score_and_write"
    entries: list[str] = setting([], "Score these alone; may be repeated.", "--entry", metavar="NAME")
    workers: options.Workers = 2
    out: str | None = setting(
        None, "Folder for what is written; the round's if none.", "--out", "-o", metavar="DIR", writes=True
    )


def make_and_tell(settings: MakeSettings, terminal: Terminal) -> None:
    """Make a round, and say what to hand out."""
    from fogml.benchmark.make import make_round
    from fogml.benchmark.score import round_hash

    home = Path(settings.folder())
    with terminal.work("making a round", total=2) as work:
        told = make_round(
            home,
            seed=settings.seed,
            closed=settings.closed,
            drift=settings.drift,
            diagnosis=settings.diagnosis,
            real=settings.real,
            workers=settings.workers,
            step=lambda words: work.advance(doing=words),
        )
    config = settings.in_full().yaml("benchmark make", "make.yaml")
    with whole_file(home / "kept" / "make.yaml") as partial:
        partial.write_text(config, encoding="utf-8")
    counts = {track: len(cases) for track, cases in told["tracks"].items()}
    terminal.result({"directory": str(home), "round": round_hash(home), **counts})
    terminal.say(
        f"{counted(counts['drift'], 'drift case')}, {counted(counts['diagnosis'], 'diagnosis case')}. "
        f"Hand out {home / 'handout'}, keep {home / 'kept'}; answer: fogml benchmark run {home} --method auto"
    )


def run_and_tell(settings: RunSettings, terminal: Terminal) -> None:
    """Answer a track by each method, and say how many cases failed."""
    from fogml.benchmark.answers import entry_plan
    from fogml.blind.run import RunPlan, run_cases
    from fogml.cli.blind_job import answer

    if len(settings.methods) > 1 and settings.name:
        raise InputError("--name: the answers of several methods can't have one name")

    def plan_of(method: str) -> RunPlan:
        return entry_plan(
            settings.folder(),
            settings.track,
            method,
            name=settings.name,
            features=settings.features,
            code=Path(settings.code) if settings.code else None,
            workers=settings.workers,
            limit_s=settings.limit,
            retry=settings.retry,
            seed=settings.seed,
        )

    config = settings.in_full().yaml("benchmark run", "run.yaml")
    answer(settings.methods, plan_of, lambda method: run_cases, config, terminal)


def score_and_write(settings: ScoreSettings, terminal: Terminal) -> None:
    """Score a round, write ``score.json`` and its page."""
    home = Path(settings.folder())
    read_round(home)  # what is no round is refused before the scorer loads
    from fogml.benchmark.score import score_round

    with terminal.work("scoring", total=1):
        values = score_round(home, settings.entries, workers=settings.workers)
    from fogml.report.benchmark_page import benchmark_page, diagnosis_table, drift_table

    out = Path(settings.out) if settings.out else home
    with whole_folder(out, shared=True) as staging:
        write_json(staging / "score.json", values, indent=1)
        (staging / "score.html").write_text(benchmark_page(values), encoding="utf-8")
        settings.write_into(staging, "benchmark score")
    for table in (drift_table(values), diagnosis_table(values)):
        terminal.show(table)
    terminal.result(values)
    terminal.say(f"Written to {out}: open {out / 'score.html'}")


COMMANDS = {"make": MakeSettings, "run": RunSettings, "score": ScoreSettings}
