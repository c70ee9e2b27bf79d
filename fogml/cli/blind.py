"""``fogml blind``: make blind cases, let a method answer them, score the answers, merge scored parts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator

from fogml.blind.folders import DIAGNOSIS, BlindFolder
from fogml.cli import options
from fogml.cli.given import option
from fogml.cli.settings import Settings, placed, setting
from fogml.errors import InputError

WANTED = "wanted"


def _gates(value: Any) -> Any:
    """``["figure=value", "wanted", ...]`` as flags give them, or a mapping as YAML does."""
    if not isinstance(value, list):
        return value
    from fogml.blind.score import wanted_gates

    given = [text for text in value if text != WANTED]
    stated = options.numbers_by_name(given, f"gate; write FIGURE=VALUE, or '{WANTED}'")
    return (wanted_gates() if WANTED in value else {}) | stated


Methods = Annotated[list[str], option("Score these alone; may be repeated.", "--method", metavar="NAME")]
Final = Annotated[
    bool, option("Use a final seed; the use is recorded in the ledger and the page.", "--final")
]
Ledger = Annotated[str, option("Where uses of final seeds are kept.", metavar="FILE", writes=True)]
_NO_SUITE = "no folder is given; name the suite's folder"
LEDGER = "experiments/gap_blind/final_uses.json"


class SuiteSettings(Settings):
    """What every job on a suite takes."""

    directory: str | None = placed(
        None,
        "DIR",
        "The suite's folder.",
        reads=True,
        needed=_NO_SUITE,
        lost="no such folder; make a suite first: fogml blind make DIR",
    )

    def folder(self) -> BlindFolder:
        """The suite."""
        assert self.directory
        return BlindFolder(Path(self.directory))


class MakeSettings(SuiteSettings):
    """Make cases from a reality that is not the twin, and their truth apart from them.

    Seeds from 1000000 on are kept for final figures. An interrupted call goes on where it was.
    """

    job: ClassVar[str] = "fogml.cli.blind_job:make_and_tell"
    directory: str | None = placed(None, "DIR", "The suite's folder.", writes=True, needed=_NO_SUITE)
    count: int = setting(1000, "Cases.", "--count", "-n")
    first: int = setting(1, "Number of the first one.")
    sample: float = setting(10.0, "Interval.", metavar="SECONDS")
    kinds: list[str] = setting(
        [],
        "Only cases of this kind; may be repeated.",
        "--kind",
        metavar="KIND",
        known="fogml.blind.truth:KINDS",
    )
    least_d_prime: float = setting(0.0, "Only strata of d' that begin there or above.", metavar="D")
    d_prime: list[str] = setting(
        [], "Draw d' within these bounds instead; may be repeated.", metavar="LOW-HIGH"
    )
    reality: str = setting(
        "first",
        "first, second, third, mix for all in turn, or same-twin for a twin's own runs.",
        metavar="NAME",
        known=("first", "second", "third", "mix", "same-twin"),
    )
    leave_one_out: bool = setting(
        False, "Only cases with an effect left out, each effect in turn.", "--leave-one-out"
    )
    relatives_stay: bool = setting(
        False,
        "Keep relatives of an effect that is left out among the candidates.",
        "--relatives-stay/--relatives-out",
    )
    workers: options.Workers = 2

    @property
    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Bounds of d' as numbers."""
        found = []
        for text in self.d_prime:
            low, _, high = text.partition("-")
            try:
                found.append((float(low), float(high)))
            except ValueError:
                raise InputError(f"d' '{text}': write LOW-HIGH, e.g. 20-60") from None
        return tuple(found)


class RunSettings(SuiteSettings):
    """Answer the cases that have no answer yet, in sealed processes that see a case's files alone."""

    job: ClassVar[str] = "fogml.cli.blind_job:run_and_tell"
    methods: list[str] = setting(
        [DIAGNOSIS],
        "diagnosis, a baseline, 'baselines', or module:function; repeatable.",
        "--method",
        metavar="NAME",
        known="fogml.blind.methods:METHODS",
    )
    code: str | None = setting(
        None, "Where module:function lies.", metavar="FOLDER", reads=True, lost="no such folder"
    )
    name: str | None = setting(None, "What the answers are called.", metavar="NAME")
    workers: options.Workers = 2
    threads: int = setting(1, "Threads of each process.")
    limit: float = setting(600.0, "Time that a case may take.", metavar="SECONDS")
    shard: str = setting("1/1", "Every N-th case from the I-th on.", metavar="I/N")
    retry: bool = setting(False, "Try failed cases again.", "--retry")
    cost_of_false_name: options.CostOfFalseName = 1.0

    @property
    def part(self) -> tuple[int, int]:
        """The shard as numbers."""
        i, slash, n = self.shard.partition("/")
        if not (slash and i.strip().isdecimal() and n.strip().isdecimal()):
            raise InputError(f"shard '{self.shard}': write I/N, e.g. 2/8")
        return int(i), int(n)


class ScoreSettings(SuiteSettings):
    """Score every method's answers against the truth; exit status 1 where a gate is not met.

    Writes score.json, score.html and marks.json.gz; fogml blind merge makes one page of several of those.
    """

    job: ClassVar[str] = "fogml.cli.blind_job:score_and_write"
    methods: Methods = []
    gates: Annotated[
        dict[str, float], BeforeValidator(_gates, json_schema_input_type=dict[str, float] | list[str])
    ] = setting({}, "Limit on a figure of the diagnosis; 'wanted' for all.", "--gate", metavar="FIGURE=VALUE")
    final: Final = False
    ledger: Ledger = LEDGER
    workers: options.Workers = 2
    out: str | None = setting(
        None, "Folder for what is written; the suite's if none.", "--out", "-o", metavar="DIR", writes=True
    )


class MergeSettings(Settings):
    """Make one score of a suite's parts, which may have been made, answered and scored anywhere.

    Writes score.json, score.html and marks.json.gz. Cases that were made by kind or strength count in the
    figures of their kind alone.
    """

    job: ClassVar[str] = "fogml.cli.blind_job:merge_and_write"
    marks: list[str] = placed(
        [], "MARKS...", "Files marks.json.gz of a suite's parts.", reads=True, lost="no such file"
    )
    final: Final = False
    ledger: Ledger = LEDGER
    out: str | None = setting(
        None,
        "Folder for the score.",
        "--out",
        "-o",
        metavar="DIR",
        writes=True,
        needed="no --out is given; name a folder for the score",
    )


COMMANDS = {"make": MakeSettings, "run": RunSettings, "score": ScoreSettings, "merge": MergeSettings}
