"""The job of ``fogml simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from fogml.cli.settings import Settings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.runs.facts import Facts, facts_from
from fogml.twin.programme import Programme, load_programme, programme_names
from fogml.twin.simulate import DEFAULT_COLUMNS, DEFAULT_FACTS, simulate_to_file
from fogml.twin.timeline import timeline
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin, twin_names


class SimulateSettings(Settings):
    """Settings of ``fogml simulate``: a file of schema ``fogml.simulate/1``."""

    path_keys: ClassVar[tuple[str, ...]] = ("programme", "twin")
    written_keys: ClassVar[tuple[str, ...]] = ("out", "truth")
    config_option: ClassVar[str] = ""
    schema_: Literal["fogml.simulate/1"] = Field("fogml.simulate/1", alias="schema")
    sample_s: float = 1.0
    programme: str | list[Any] | dict[str, Any] | None = None
    twin: str | dict[str, Any] = "nominal"
    columns: list[str] = list(DEFAULT_COLUMNS)
    facts: dict[str, Any] | None = None
    out: str | None = None
    truth: str | None = None

    def _ships(self, key: str, value: str) -> bool:
        # A programme written out as a list of sentences names no file.
        known = {"programme": programme_names, "twin": twin_names}.get(key, tuple)()
        return super()._ships(key, value) or value in known or isinstance(getattr(self, key), list)

    def as_written(self) -> dict[str, Any]:
        """The values of a configuration file."""
        return self.model_dump(mode="json", by_alias=True, exclude_none=True)


def simulate_and_write(settings: SimulateSettings, terminal: Terminal) -> None:
    """Simulate block by block into a file, and print what was written."""
    if settings.programme is None:
        raise InputError("no programme is given; state 'programme' in the file, or --programme")
    if not settings.out:
        raise InputError("no --out is given; name the run to write, .csv or .parquet")
    out = Path(settings.out)
    if settings.truth is not None and Path(settings.truth).absolute() == out.absolute():
        raise InputError(f"{out}: is the run and the truth; choose another --truth")
    programme, twin = load_programme(settings.programme), load_twin(settings.twin)
    facts = DEFAULT_FACTS if settings.facts is None else facts_from(settings.facts, "facts")
    with settings.written_beside(out, "simulate"):
        rows = _simulate(settings, programme, twin, facts, out, terminal)
    _print(settings, programme, twin, rows, terminal)


def _simulate(
    settings: SimulateSettings, programme: Programme, twin: Twin, facts: Facts, out: Path, terminal: Terminal
) -> int:
    total = len(timeline(programme, settings.sample_s))
    with terminal.work(f"simulating {programme.name}", total=total) as work:
        return simulate_to_file(
            programme,
            twin,
            out,
            sample_s=settings.sample_s,
            seed=settings.seed,
            columns=settings.columns,
            facts=facts,
            truth_path=settings.truth,
            progress=work.advance,
        )


def _print(
    settings: SimulateSettings, programme: Programme, twin: Twin, rows: int, terminal: Terminal
) -> None:
    assert settings.out
    values = {
        "schema": "fogml.simulation/1",
        "run": Path(settings.out).name,
        "truth": Path(settings.truth).name if settings.truth else None,
        "rows": rows,
        "sample_s": settings.sample_s,
        "hours": programme.total_hours,
        "seed": settings.seed,
        "programme": programme.name,
        "twin": twin.name,
        "effects": list(twin.settings),
    }
    terminal.say(
        f"{rows} samples every {settings.sample_s:g} s, {programme.total_hours:.3g} h of {programme.name}, "
        f"written to {settings.out}"
    )
    on = ", ".join(twin.settings) or "none"
    terminal.say(f"Twin {twin.name}, seed {settings.seed}; effects: {on}.")
    if settings.truth:
        terminal.say(f"The truth of every node and effect is in {settings.truth}.")
    terminal.result(values)
