"""The truth's schema, its hashes, and the seeds that are kept."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from fogml.blind.folders import SUMS, check_sums, write_sums
from fogml.blind.plan import FINAL_FROM, check_use, record_use, uses
from fogml.blind.truth import (
    Runs,
    TrueEffect,
    Truth,
    read_contributions,
    read_truth,
    stratum,
    write_truth,
)
from fogml.errors import InputError


def one_truth(case: str = "0001") -> Truth:
    effects = (
        TrueEffect(id="a", name="a", stage="bias", d_prime=12.0),
        TrueEffect(id=None, name="new", stage="rig", d_prime=7.0),
    )
    runs = Runs(fit=("fit-1.csv",), held_out=("held-out-1.csv",))
    return Truth(
        case=case, seed=3, kind="unknown_and_known", runs=runs, sample_s=10.0, turning=True, effects=effects
    )


def test_written_and_read_is_the_same(tmp_path: Path) -> None:
    truth, values = one_truth(), {("fit-1.csv", 0): np.arange(3.0), ("fit-1.csv", 1): np.ones(3)}
    write_truth(tmp_path, truth, values)
    assert read_truth(tmp_path / "0001.json") == truth
    read = read_contributions(tmp_path / "0001.npz")
    assert set(read) == set(values) and all(np.array_equal(read[key], values[key]) for key in values)


def test_what_can_be_named_and_what_decides() -> None:
    truth = one_truth()
    assert [e.name for e in truth.known] == ["a"] and [e.name for e in truth.unknown] == ["new"]
    assert truth.stratum == "6-10"
    left = truth.model_copy(update={"left_out": ("a",)})
    assert not left.known and len(left.unknown) == 2


@pytest.mark.parametrize(
    ("d_prime", "name"),
    [(0.0, "under 4"), (4.0, "4-6"), (6.0, "6-10"), (9.99, "6-10"), (10.0, "10-20"), (20.0, "over 20")],
)
def test_strata(d_prime: float, name: str) -> None:
    assert stratum(d_prime) == name


def test_hashes_are_those_of_sha256sum_and_tell_every_change(tmp_path: Path) -> None:
    for case in ("0001", "0002"):
        write_truth(tmp_path, one_truth(case), {})
    write_sums(tmp_path)
    digest = hashlib.sha256((tmp_path / "0001.json").read_bytes()).hexdigest()
    assert f"{digest}  0001.json\n" in (tmp_path / SUMS).read_text()
    assert check_sums(tmp_path) == 2
    text = (tmp_path / "0002.json").read_text()
    (tmp_path / "0002.json").write_text(text.replace("12.0", "2.0"))
    with pytest.raises(InputError, match=r"0002\.json: changed"):
        check_sums(tmp_path)
    (tmp_path / "0002.json").unlink()
    with pytest.raises(InputError, match="missing"):
        check_sums(tmp_path)


def test_a_broken_truth_names_its_key(tmp_path: Path) -> None:
    write_truth(tmp_path, one_truth(), {})
    values = json.loads((tmp_path / "0001.json").read_text())
    (tmp_path / "0001.json").write_text(json.dumps(values | {"kind": "some"}))
    with pytest.raises(InputError, match="'kind'"):
        read_truth(tmp_path / "0001.json")
    (tmp_path / "0001.json").write_text(json.dumps(values | {"case": "\u00bd"}))
    with pytest.raises(InputError, match="'case'"):
        read_truth(tmp_path / "0001.json")
    (tmp_path / "0001.json").write_bytes(b'{"a": "\x9b"}')
    with pytest.raises(InputError, match=r"0001\.json: .*make the cases anew"):
        read_truth(tmp_path / "0001.json")


def test_final_seeds_need_the_ledger_and_leave_a_record(tmp_path: Path) -> None:
    ledger = tmp_path / "uses.json"
    with pytest.raises(InputError, match="--final"):
        check_use(FINAL_FROM, None)
    with pytest.raises(InputError, match="develop"):
        check_use(FINAL_FROM - 1, ledger)
    check_use(FINAL_FROM, ledger)
    for number in (1, 2):
        record_use(ledger, FINAL_FROM, 100 * number, "hash", {"diagnosis": {"one_exact": 0.9}})
    assert [use["cases"] for use in uses(ledger)] == [100, 200]
