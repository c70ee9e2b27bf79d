"""Stores: every record once, whoever writes, and nothing lost while one is away."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from sqlalchemy.exc import OperationalError

from experiments.faults.postgres import free_port, postgres, program, restart
from fogml.errors import InputError
from fogml.locks import sole_writer
from fogml.monitor.record import RunRecord
from fogml.monitor.store import FILE, open_store
from tests.tuning.conftest import database  # noqa: F401

RECORD = RunRecord(
    key="a" * 64,
    unit="FOG-1 ü",
    axis="x",
    run="a.csv",
    model="m",
    started="2026-03-01T08:00:00+00:00",
    monitored="2026-03-02T08:00:00+00:00",
    span_s=3600.0,
    samples=3600.0,
    outside_training=0.01,
    beyond_interval=float("nan"),
    half_width=0.1,
    averaging_s=100.0,
    level=0.02,
    temperature_slope=float("nan"),
    rate_slope=-1e-3,
    scatter=-4.0,
    scale_factor=float("nan"),
    level_se=0.002,
    temperature_slope_se=float("nan"),
    rate_slope_se=1e-4,
    scatter_se=0.1,
    scale_factor_se=float("nan"),
)


def others(count):
    return [replace(RECORD, key=f"{n:064d}", run=f"{n}.csv", level=0.1 * n) for n in range(count)]


def places(tmp_path):
    return [str(tmp_path / "store"), f"sqlite:///{tmp_path / 'store.db'}"]


def same(found, expected):
    assert len(found) == len(expected)
    for one, other in zip(sorted(found, key=lambda r: r.key), expected, strict=True):
        assert one.key == other.key
        np.testing.assert_equal(vars(one), vars(other))


@pytest.mark.parametrize("kind", [0, 1])
def test_records_come_back_as_they_were_and_once(tmp_path, kind):
    place = places(tmp_path)[kind]
    with closing(open_store(place)) as store:
        assert store.records() == []
        assert store.add(others(5)) == 5
        assert store.add([*others(7), *others(7)]) == 2
    with closing(open_store(place)) as store:
        same(store.records(), others(7))


@pytest.mark.parametrize("kind", [0, 1])
def test_long_names_that_differ_at_their_ends_are_two(tmp_path, kind):
    record = replace(RECORD, unit="FOG-" + "0" * 200 + "1", run="r" * 230 + ".csv")
    told = [record, replace(record, key="b" * 64, unit=record.unit[:-1] + "2")]
    with closing(open_store(places(tmp_path)[kind])) as store:
        store.add(told)
        same(store.records(), told)


def test_a_name_that_a_store_would_cut_is_refused(tmp_path):
    told = [replace(RECORD, unit="u" * 1001)]
    with (
        closing(open_store(places(tmp_path)[0])) as store,
        pytest.raises(InputError, match="1001 characters"),
    ):
        store.add(told)


@pytest.mark.parametrize("kind", [0, 1])
def test_a_run_whose_side_file_was_mended_stands_as_it_came_last(tmp_path, kind):
    with closing(open_store(places(tmp_path)[kind])) as store:
        store.add(others(3))
        mended = replace(
            others(3)[1], started="2026-02-01T08:00:00+00:00", monitored="2026-05-01T00:00:00+00:00"
        )
        assert store.add([mended]) == 0
        kept = others(3)
        kept[1] = replace(mended, monitored=RECORD.monitored)
        same(store.records(), kept)


@pytest.mark.parametrize("kind", [0, 1])
def test_many_stations_write_at_once(tmp_path, kind):
    place = places(tmp_path)[kind]

    def write(some):
        with closing(open_store(place, 30.0)) as store:
            store.add(some)

    write(others(1))
    with ThreadPoolExecutor(3) as pool:
        list(pool.map(write, [others(10)[start : start + 5] for start in (0, 2, 5)]))
    with closing(open_store(place)) as store:
        same(store.records(), others(10))


@pytest.mark.parametrize("kind", [0, 1])
def test_a_store_holds_the_runs_of_years(tmp_path, kind):
    """Every run has a key and a name of its own: more than a run file may have different marks."""
    place = places(tmp_path)[kind]
    for records, added in ((others(12_000), 12_000), ([*others(1), replace(RECORD, key="b" * 64)], 1)):
        with closing(open_store(place)) as store:
            assert store.add(records) == added
    with closing(open_store(place)) as store:
        assert len(store.records()) == 12_001


def test_a_database_of_several_stations(database):  # noqa: F811
    first, second = open_store(database), open_store(database)
    assert first.add(others(3)) == 3
    assert second.add(others(4)) == 1
    same(first.records(), others(4))
    first.close()
    second.close()


class _Unconfirmed:
    """An engine whose server is gone once, after it has written and before it says so."""

    def __init__(self, engine):
        self._engine, self._gone = engine, False

    @contextmanager
    def begin(self):
        with self._engine.begin() as connection:
            yield connection
        if not self._gone:
            self._gone = True
            raise OperationalError("commit", {}, RuntimeError("server closed the connection"))


def test_runs_that_were_written_without_a_word_are_counted(tmp_path, monkeypatch):
    with closing(open_store(places(tmp_path)[1])) as store:
        assert store.add(others(2)) == 2
        table, engine = store._open()
        away = _Unconfirmed(engine)
        monkeypatch.setattr(store, "_open", lambda: (table, away))
        assert store.add(others(5)) == 3
        assert store.add(others(5)) == 0


def test_a_database_that_ends_as_by_a_crash_and_comes_back_has_every_run_once():
    if program("initdb") is None:
        pytest.skip("PostgreSQL is not installed (.ci/run installs it): no initdb found")
    # Not pytest's own folder: its parents are closed to the user that the server runs as.
    with TemporaryDirectory(prefix="fogml-postgres-") as name, ThreadPoolExecutor(1) as pool:
        folder = Path(name)
        folder.chmod(0o755)
        with postgres(folder / "server") as url:
            store = open_store(url, 60.0)
            added = store.add(others(2))
            away = pool.submit(restart, folder / "server")
            count = 2
            while not away.done():
                count += 1
                added += store.add(others(count))
            away.result()
            same(store.records(), others(count))
            assert added == count > 2
            store.close()


def test_a_store_that_is_away_is_waited_for_and_then_said(tmp_path):
    url = f"postgresql://somebody:secret@127.0.0.1:{free_port()}/units"
    with pytest.raises(InputError, match="nothing is lost") as told:
        open_store(url, 0.0).add([RECORD])
    assert "secret" not in str(told.value)
    place = tmp_path / "store"
    store = open_store(str(place), 0.0)
    store.add([RECORD])
    with sole_writer(place / FILE), pytest.raises(InputError, match="is writing it"):
        store.add(others(1))
    assert len(store.records()) == 1


def test_a_store_that_cannot_be_written_leaves_no_folder(tmp_path, monkeypatch):
    def full(*words, **more):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pyarrow.parquet.write_table", full)
    with pytest.raises(InputError, match="No space left on device"):
        open_store(str(tmp_path / "new" / "store"), 60.0).add([RECORD])  # it is not waited for
    assert not list(tmp_path.iterdir())


def test_what_is_no_store_is_said_at_once(tmp_path):
    place = tmp_path / "store"
    place.mkdir()
    (place / FILE).write_bytes(b"PAR1 no more")
    with pytest.raises(InputError, match="damaged"):
        open_store(str(place)).records()
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="is a file"):
        open_store(str(tmp_path / "file"))
    with pytest.raises(InputError, match="--store"):
        open_store("nosuchdatabase://x/y").records()


def test_a_pipe_in_the_place_of_the_store_is_refused(tmp_path):
    os.mkfifo(tmp_path / "runs.parquet")
    with pytest.raises(InputError, match=r"runs\.parquet: is no ordinary file; choose another --store"):
        open_store(str(tmp_path)).records()
