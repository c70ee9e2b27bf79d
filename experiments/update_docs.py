"""Paste the experiments' tables into the pages of docs/: ``python -m experiments.update_docs``."""

from __future__ import annotations

import re
from pathlib import Path

from fogml.outputs import whole_file

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
SECTIONS = {
    "thermal-cycle": ("thermal_cycle/results.md", "## rms (bias included)"),
    "thermal-cycle-stability": ("thermal_cycle/results.md", "## Bias stability"),
    "thermal-cycle-both": ("thermal_cycle/results.md", "## Two legs in training"),
    "thermal-cycle-short": ("thermal_cycle/results.md", "## In short"),
    "cold-start": ("cold_start/results.md", "# A real cold start"),
    "leakage": ("leakage/results.md", "# What a random split promises"),
    "diagnosis-peers": ("diagnosis_peers/results.md", "# Ways to diagnose"),
    "compensation-peers": ("compensation_peers/results.md", "# Models of others"),
    "compensation-variance": ("compensation_peers/results.md", "## What explains the outcome"),
    "strata": ("strata/results.md", "# `auto` beside a fit"),
    "verdicts": ("verdicts/results.md", "# Does a verdict hold"),
    "known-floor": ("known_floor/results.md", "# Residual over a known floor"),
    "by-reality": ("gap_blind/results.md", "# The diagnosis by reality"),
    "by-form": ("gap_blind/results.md", "## Single effects by distance of form"),
    "gap-blind": ("gap_blind/results-before-families.md", "# The diagnosis on withheld effects"),
    "default-rates": ("default_rates/results.md", "# The default at other ramp rates"),
}


def table_after(text: str, heading: str) -> str:
    """The first Markdown table below a line that contains `heading`."""
    below = text[text.index(heading) :]
    table = re.search(r"(?:^\|.*\n)+", below, flags=re.MULTILINE)
    if table is None:
        raise ValueError(f"no table below '{heading}'")
    return table[0]


def main() -> None:
    """Replace what stands between the markers of each section, on whichever page has them."""
    tables = {
        name: table_after((ROOT / "experiments" / page).read_text(encoding="utf-8"), heading)
        for name, (page, heading) in SECTIONS.items()
    }
    for path in sorted(DOCS.glob("*.md")):
        old = text = path.read_text(encoding="utf-8")
        for name in [name for name in tables if f"<!-- {name} -->" in text]:
            begin, end = f"<!-- {name} -->\n", f"<!-- /{name} -->"
            start, stop = text.index(begin) + len(begin), text.index(end)
            text = text[:start] + tables.pop(name) + text[stop:]
        if text != old:
            with whole_file(path) as partial:
                partial.write_text(text, encoding="utf-8")
    if tables:
        raise ValueError(f"no page has the markers of {', '.join(tables)}")


if __name__ == "__main__":
    main()
