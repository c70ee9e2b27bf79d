"""The committed figures of causes found and compensated are those of the committed units."""

from __future__ import annotations

import json

from experiments.closed_loop.__main__ import HERE, KINDS, page


def test_the_page_is_made_of_the_units() -> None:
    held = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
    rows = held["units"]
    assert page(rows, held["minutes"], held["legs"]) == (HERE / "results.md").read_text(encoding="utf-8")
    assert {row["kind"] for row in rows} == set(KINDS) and len({row["reality"] for row in rows}) == 3
    found = [row for row in rows if row["found"]]
    assert sum(row["diagnosis"] < row["auto"] for row in found) > len(found) / 2
