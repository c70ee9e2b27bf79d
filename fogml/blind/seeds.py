"""Seeds to develop on, seeds kept for final figures, and the record of every use of those."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fogml.blind.folders import read_json
from fogml.errors import InputError
from fogml.json_files import write_json
from fogml.outputs import whole_file

FINAL_FROM = 1_000_000
"""Seeds from here on are kept for final figures; those below are to develop on."""
SCHEMA = "fogml.blind_uses/1"


def is_final(seed: int) -> bool:
    """Whether a suite's seed is one that nobody develops on."""
    return seed >= FINAL_FROM


def check_use(seed: int, final: Path | None) -> None:
    """Refuse to score a final seed without the ledger, or another seed with it.

    Raises
    ------
    InputError
        Saying which flag is missing or too many.
    """
    if is_final(seed) and final is None:
        raise InputError(
            f"seed {seed} is kept for final figures (from {FINAL_FROM} on): score it with --final, which "
            "records the use, or make cases with a smaller seed to develop on"
        )
    if final is not None and not is_final(seed):
        raise InputError(f"--final: seed {seed} is one to develop on; final ones begin at {FINAL_FROM}")


def uses(ledger: Path) -> list[dict[str, Any]]:
    """Every use of a final seed that the ledger records, the first one first."""
    return list(read_json(ledger).get("uses", [])) if ledger.is_file() else []


def record_use(ledger: Path, seed: int, cases: int, truth_hash: str, figures: dict[str, Any]) -> None:
    """Add a use to the ledger: when, which seed, how many cases, their truth's hash, every figure."""
    use = {
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
        "seed": seed,
        "cases": cases,
        "truth": truth_hash,
        "figures": figures,
    }
    ledger.parent.mkdir(parents=True, exist_ok=True)
    values = {"schema": SCHEMA, "uses": [*uses(ledger), use]}
    with whole_file(ledger) as partial:
        write_json(partial, values, indent=1)
