"""``fogml benchmark``: make a round of the open benchmark, let methods answer it, score the answers."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from fogml.benchmark.rounds import SEED, TRACKS, Track
from fogml.cli import options
from fogml.cli.given import argument, option
from fogml.cli.settings import Settings
from fogml.errors import InputError


class RoundSettings(Settings):
    """What every job on a round takes."""

    directory: Annotated[str | None, argument("DIR", "The round's folder.", reads=True)] = None

    def folder(self) -> str:
        """The round's folder.

        Raises
        ------
        InputError
            If none is named.
        """
        if not self.directory:
            raise InputError("no folder is given; name the round's folder")
        return self.directory


class MakeSettings(RoundSettings):
    """Make a round: what is handed out, the answers that are kept, and salted hashes of them.

    The seed of an open round is stated and anyone can make the same; that of a closed one is drawn and kept.
    """

    job: ClassVar[str] = "fogml.cli.benchmark_job:make_and_tell"
    seed: Annotated[int, option("Seed of an open round; 2026 is the one whose results ship.")] = Field(
        SEED, ge=0, lt=1_000_000
    )
    closed: Annotated[bool, option("Draw the seed, and keep it.", "--closed")] = False
    drift: Annotated[int, option("Synthetic units of the drift track.", metavar="N")] = 12
    diagnosis: Annotated[int, option("Cases of the diagnosis track.", metavar="N")] = 12
    real: Annotated[bool, option("With the real legs that ship.", "--real/--no-real")] = True
    workers: options.Workers = 2


class RunSettings(RoundSettings):
    """Answer the cases that have no answer yet, in sealed processes that see a case's files alone."""

    job: ClassVar[str] = "fogml.cli.benchmark_job:run_and_tell"
    track: Annotated[Track, option("Which track.", metavar="|".join(TRACKS))] = "drift"
    methods: Annotated[
        list[str],
        option(
            "Drift: a model's name; diagnosis: a method of 'blind run'; or module:function. Repeatable.",
            "--method",
            metavar="NAME",
            known="fogml.models.names:MODEL_NAMES",
        ),
    ] = []
    features: options.Features = None
    code: Annotated[str | None, option("Where module:function lies.", metavar="FOLDER", reads=True)] = None
    name: Annotated[str | None, option("What the answers are called.", metavar="NAME")] = None
    workers: options.Workers = 2
    limit: Annotated[float, option("Time that a case may take.", metavar="SECONDS")] = 600.0
    retry: Annotated[bool, option("Try failed cases again.", "--retry")] = False


class ScoreSettings(RoundSettings):
    """Score every entry against the answers that were kept.

    Refuses an entry that lacks a case or holds a number that is not finite. Writes score.json and score.html.
    """

    job: ClassVar[str] = "fogml.cli.benchmark_job:score_and_write"
    entries: Annotated[
        list[str], option("Score these alone; may be repeated.", "--entry", metavar="NAME")
    ] = []
    workers: options.Workers = 2
    out: Annotated[
        str | None,
        option("Folder for what is written; the round's if none.", "--out", "-o", metavar="DIR", writes=True),
    ] = None


COMMANDS = {"make": MakeSettings, "run": RunSettings, "score": ScoreSettings}
