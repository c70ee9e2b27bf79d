"""The committed figures of a line diagnosed together are those of its page, and the line is found in them."""

from __future__ import annotations

import json

from experiments.line_diagnosis.__main__ import HERE, HYSTERESIS, POLARIZATION, page, truth


def test_the_page_is_made_of_the_figures() -> None:
    held = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
    assert page(held) == (HERE / "results.md").read_text(encoding="utf-8")
    told = truth()[: held["units"]]
    causes = {cause["effect"]: cause for cause in held["causes"]}
    for effect in (HYSTERESIS, POLARIZATION):
        true = sum(effect in one["acting"] for one in told) / len(told)
        low, high = causes[effect]["prevalence_ci90"]
        assert low <= true <= high
    assert [known["name"] for known in causes[POLARIZATION]["depends_on"]] == ["coil_lot"]
    assert not causes[HYSTERESIS]["depends_on"]
    assert set(held["odd"]) <= set(held["apart_by_size"])
    assert held["dask"]["compared"] and not held["dask"]["differing"]
