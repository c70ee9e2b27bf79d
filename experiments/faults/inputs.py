"""The kinds of input that are spoiled: for each, how one is drawn and how often."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from random import Random
from typing import Any

from experiments.faults import mutate
from experiments.faults import world as sound
from experiments.faults.case import Case
from experiments.faults.containers import FOLDER, NAMES, recording
from experiments.faults.models import spoiled_model

World = Mapping[str, bytes]
Maker = Callable[[Random, World], Case]
QUIET = "--quiet"


@dataclass(frozen=True)
class Kind:
    """A kind of input.

    Attributes
    ----------
    name
        What is spoiled.
    share
        Cases of this kind among `total` of all shares.
    make
        Draws one.
    needs
        Beginning of a sound file's name without which it can't be drawn.
    """

    name: str
    share: int
    make: Maker
    needs: str = ""


def some(world: World, *prefixes: str) -> dict[str, bytes]:
    """The sound files whose names begin so."""
    return {name: held for name, held in world.items() if name.startswith(prefixes)}


def _rows(world: World, name: str) -> list[list[str]]:
    return [line.split(",") for line in world[name].decode().splitlines()]


def _csv_bytes(rng: Random, rows: list[list[str]], separator: str) -> bytes:
    """A table as some spreadsheet or logger writes it."""
    ends = rng.choice(("\n", "\n", "\n", "\r\n", "\r"))
    if rng.random() < 0.3:
        target = io.StringIO()
        csv.writer(target, delimiter=separator, lineterminator=ends, quoting=rng.choice((0, 1))).writerows(
            rows
        )
        content = target.getvalue()
    else:
        content = ends.join(separator.join(row) for row in rows) + rng.choice((ends, ends, ""))
    head = rng.choice(("", "", "", "", "\ufeff", "# comment" + ends, ends, "Title" + ends, "sep=;" + ends))
    encoding = rng.choice(("utf-8",) * 12 + ("latin-1", "utf-16", "utf-16-le", "gbk", "cp1252"))
    return (head + content).encode(encoding, errors="replace")


def _table_file(rng: Random, rows: list[list[str]]) -> bytes:
    """A spoiled table: cells and rows, then perhaps its text, then perhaps its bytes."""
    pick = rng.random()
    separator = rng.choice(",,,,;;\t")
    if separator == ";" and rng.random() < 0.5:
        rows = [rows[0], *[[cell.replace(".", ",") for cell in row] for row in rows[1:]]]
    spoiled = mutate.table(rng, rows) if pick < 0.7 else rows
    content = _csv_bytes(rng, spoiled, separator)
    if pick > 0.65:
        content = mutate.data(rng, content)
    return content


def _clocked(rng: Random, rows: list[list[str]]) -> list[list[str]]:
    """The table with another clock: reset, wrapped, in bursts, tiny or vast steps; or a sentinel."""
    head, *body = [list(row) for row in rows]
    at = rng.randrange(1, len(body))
    way = rng.randrange(8)
    for place, row in enumerate(body):
        time = float(row[0])
        if way == 0 and place >= at:
            time -= float(body[at][0])
        elif way == 1:
            time = (time * 1000) % 65536
        elif way == 2:
            time = 10.0 * (place // 4)
        elif way == 3:
            time *= rng.choice((1e-299, 1e-12, 1e12, 1e300))
        elif way == 4 and place >= at:
            time += rng.choice((1e3, 1e9, 1e15))
        elif way == 5:
            row[1 + rng.randrange(2)] = rng.choice(("1e308", "-1e308", "0", "5"))
        if way < 5:
            row[0] = repr(time)
    if way == 6:
        for row in body[at : at + rng.choice((1, 5, 40))]:
            row[2] = rng.choice(("-127", "85", "0", "-9999", "999", ""))
    if way == 7:
        body = [row if place % 3 else [*row[:2], "", *row[3:]] for place, row in enumerate(body)]
    return [head, *body]


def csv_run(rng: Random, world: World) -> Case:
    rows = _rows(world, rng.choice(("a.csv", "b.csv", "simulated.csv", "imported/log-1-x.csv")))
    if rng.random() < 0.25 and len(rows) > 20:
        content = _csv_bytes(rng, _clocked(rng, rows), ",")
    else:
        content = _table_file(rng, rows)
    return _reads(rng, world, "x.csv", content)


def _reads(rng: Random, world: World, name: str, content: bytes) -> Case:
    """A command that reads a run: mostly inspect, as every other reads in the same way."""
    files = {name: content, "x.yaml": world["a.yaml"]}
    repair = rng.choice(((), (), ("--repair",)))
    pick = rng.random()
    if pick < 0.88:
        return Case(("only", "read", name, *repair), files, name)
    if pick < 0.95:
        return Case(("inspect", name, *repair, QUIET), files, name)
    if pick < 0.955:
        return Case(("noise", name, "-o", "o", *repair, QUIET), files, name)
    model = some(world, "trained/polynomial/model/")
    if pick < 0.99:
        command = ("compensate", name, "--model", "trained/polynomial/model", "-o", "y.csv", QUIET)
        return Case(command, {**files, **model}, name)
    judged = ("train", name, "--test", "b.csv") if pick < 0.995 else ("train", "b.csv", "--test", name)
    command = (*judged, "--model", "mean", "--averaging", "30", "-o", "o", *repair, QUIET)
    return Case(command, {**files, **some(world, "b.")}, name)


def parquet_run(rng: Random, world: World) -> Case:
    content = world["run.parquet"]
    if rng.random() < 0.6:
        content = mutate.data(rng, content)
    else:
        content = _structured_parquet(rng, content)
    return _reads(rng, world, "x.parquet", content)


def _structured_parquet(rng: Random, content: bytes) -> bytes:
    """A sound Parquet file of an unsound table."""
    import pyarrow as arrow
    import pyarrow.parquet as parquet

    table = parquet.read_table(io.BytesIO(content))
    place = rng.randrange(table.num_columns)
    name = table.column_names[place]
    values = table.column(place).to_pylist()
    way = rng.randrange(7)
    if way == 0:
        values[rng.randrange(len(values))] = rng.choice((None, float("nan"), float("inf"), 1e308, -127.0))
        column = arrow.array(values, arrow.float64())
    elif way == 1:
        column = arrow.array([str(value) for value in values])
    elif way == 2:
        column = arrow.array([[value] for value in values])
    elif way == 3:
        column = arrow.array(values, rng.choice((arrow.float32(), arrow.float64()))).dictionary_encode()
    elif way == 4:
        whole = [int(value) % 100 for value in values]
        column = arrow.array(whole, rng.choice((arrow.int8(), arrow.uint64(), arrow.int64())))
    elif way == 5:
        column = arrow.array([value > 1 for value in values])
    else:
        column = table.column(place)
        name = rng.choice(("time [ms]", "gyro [K]", "x", "", "time [s]", "T [K]", mutate.word(rng)))
    name = name.encode("utf-8", errors="replace").decode()
    table = table.set_column(place, name, column)
    if rng.random() < 0.4:
        facts = (
            {"fogml.facts": json.dumps(mutate.tree(rng, sound.FACTS))}
            if rng.random() < 0.5
            else {"latitude": mutate.word(rng)}
        )
        table = table.replace_schema_metadata(
            {k: v.encode("utf-8", errors="replace") for k, v in facts.items()}
        )
    target = io.BytesIO()
    parquet.write_table(table, target, compression=rng.choice(("none", "snappy", "gzip")))
    return target.getvalue()


def hdf5_run(rng: Random, world: World) -> Case:
    content = mutate.data(rng, world["run.h5"]) if rng.random() < 0.6 else _structured_hdf5(rng)
    return Case(("only", "read", "x.h5"), {"x.h5": content}, "x.h5")


def _structured_hdf5(rng: Random) -> bytes:
    """A sound HDF5 file of what is no run: links, virtual and other data sets, odd shapes and attributes."""
    import h5py
    import numpy as np

    target = io.BytesIO()
    run = sound.run(0)
    with h5py.File(target, "w") as file:
        for name, cell in (("time", "time [s]"), ("gyro", "gyro [deg/h]"), ("T", "T [degC]")):
            values: Any = run.columns["T_in" if name == "T" else name]
            way = rng.randrange(12) if rng.random() < 0.5 else -1
            if way == 0:
                file[cell] = h5py.ExternalLink("/etc/passwd", "/x")
            elif way == 1:
                file[cell] = h5py.SoftLink("/nowhere" if rng.random() < 0.5 else f"/{cell}")
            elif way == 2:
                layout = h5py.VirtualLayout(shape=values.shape, dtype="f8")
                layout[:] = h5py.VirtualSource("other.h5", "x", shape=values.shape)
                file.create_virtual_dataset(cell, layout)
            elif way == 3:
                file.create_dataset(cell, shape=(10**12,), dtype="f8", chunks=(1024,))
            elif way == 4:
                file[cell] = np.array([str(value) for value in values], dtype="S8")
            elif way == 5:
                file[cell] = values.reshape(rng.choice(((1, -1), (-1, 1), (2, -1), (1, 1, -1))))
            elif way == 6:
                file[cell] = values.astype(rng.choice(("f2", "f4", ">f8", "i4", "u1", "c16", "?")))
            elif way == 7:
                file[cell] = values[: rng.randrange(len(values))]
            elif way == 8:
                file[cell] = np.where(
                    np.arange(len(values)) == 5, rng.choice((np.nan, np.inf, 1e308)), values
                )
            elif way == 9:
                file.create_dataset(
                    cell,
                    data=values,
                    external=[("/etc/passwd", 0, 8 * len(values))] if rng.random() < 0.5 else None,
                ) if rng.random() < 0.5 else file.create_dataset(cell, data=values, compression="gzip")
            else:
                file[cell] = values
        if rng.random() < 0.4:
            facts = mutate.tree(rng, sound.FACTS)
            stated = list(facts.items()) if isinstance(facts, dict) else []
            key, value = rng.choice(stated or [("latitude", 1)])
            try:
                file.attrs[key] = value if isinstance(value, str | int | float) else json.dumps(value)
            except (TypeError, ValueError, OSError, RuntimeError, OverflowError):
                file.attrs["latitude"] = "x"
    return target.getvalue()


def mat_run(rng: Random, world: World) -> Case:
    if rng.random() < 0.6:
        content = mutate.data(rng, world[rng.choice(("run.mat", "run.mat", "new.mat"))])
    else:
        content = _structured_mat(rng)
    return Case(("only", "read", "x.mat"), {"x.mat": content}, "x.mat")


def _structured_mat(rng: Random) -> bytes:
    """A sound MATLAB file of what is no run."""
    import numpy as np
    from scipy.io import savemat

    run = sound.run(0)
    values: dict[str, Any] = {name: run.columns[name] for name in ("time", "gyro", "T_in")}
    values["units"] = {"time": "s", "gyro": "deg/h", "T_in": "degC"}
    values["facts"] = json.dumps(sound.FACTS if rng.random() < 0.5 else mutate.tree(rng, sound.FACTS))
    key = rng.choice(list(values))
    way = rng.randrange(8)
    if way == 0:
        del values[key]
    elif way == 1:
        values[key] = rng.choice(("text", 1.0, [[1, 2], [3, 4]], {"a": {"b": "c"}}, np.zeros(0)))
    elif way == 2:
        values[key] = np.array(["a", 1.0, None][: rng.choice((1, 2))], dtype=object)
    elif way == 3:
        values["units"][rng.choice(("time", "gyro", "T_in"))] = rng.choice(
            ("K", "x", "", 5, "ms", "deg/s", [1, 2])
        )
    elif way == 4:
        import scipy.sparse

        values["gyro"] = scipy.sparse.csc_array(np.atleast_2d(run.gyro))
    elif way == 5:
        values["gyro"] = run.gyro + rng.choice((1j, np.nan, np.inf, 1e308))
    elif way == 6:
        values = {"run": values}
    else:
        values[key] = mutate.scalar(rng) if rng.random() < 0.5 else "x"
    values = {name: "" if value is None else value for name, value in values.items()}
    target = io.BytesIO()
    try:
        savemat(target, values, do_compression=rng.random() < 0.5)
    except (TypeError, ValueError, OverflowError):
        savemat(target, {"time": run.time})
    return target.getvalue()


def side_file(rng: Random, world: World) -> Case:
    name = rng.choice(("x.yaml", "x.yaml", "x.yml"))
    content = mutate.document(rng, sound.FACTS, as_yaml=True)
    return Case(("only", "read", "x.csv"), {"x.csv": world["a.csv"], name: content}, name)


CONFIGS = {
    "train": "trained/polynomial/config.yaml",
    "compare": "compared/config.yaml",
    "compensate": "compensated.config.yaml",
    "export": "exported/config.yaml",
    "inspect": "inspected/config.yaml",
    "noise": "noisy/config.yaml",
    "replay": "replayed.config.yaml",
    "import": "imported/config.yaml",
    "lab north": "sought/config.yaml",
    "lab misalignment": "turned/config.yaml",
    "fleet": "fleet/config.yaml",
    "blind score": "suite/score.yaml",
}
"""Commands whose written settings are spoiled, and where they stand."""
_FILES = (
    "a.",
    "b.",
    "c.",
    "trained/polynomial/model/",
    "turns.csv",
    "positions.csv",
    "log.txt",
    "profile.yaml",
    "simulated.",
    "fleet.csv",
)


def config(rng: Random, world: World) -> Case:
    command = rng.choice(list(CONFIGS))
    place = next(
        (name for name in (CONFIGS[command], *_renamed(CONFIGS[command], command)) if name in world), None
    )
    if place is None:
        return option(rng, world)
    values = _relative(_loaded(world[place]))
    content = mutate.document(rng, values, as_yaml=True)
    extra = some(world, "suite/") if command.startswith("blind") else {}
    return Case(
        (*command.split(), "--config", "x.yaml", QUIET),
        {**some(world, *_FILES), **extra, "x.yaml": content},
        "x.yaml",
    )


def _renamed(place: str, command: str) -> tuple[str, ...]:
    """The written settings where their name begins with the command's."""
    home = place.rpartition("/")[0]
    words = command.replace(" ", "-")
    return (f"{home}/{words}.config.yaml", f"{home}/{command.split()[-1]}.config.yaml")


def _loaded(content: bytes) -> Any:
    import yaml

    return yaml.safe_load(content)


def _relative(values: Any) -> Any:
    """Settings whose paths are taken from the folder that a case is run in."""
    if isinstance(values, dict):
        return {key: _relative(value) for key, value in values.items()}
    if isinstance(values, list):
        return [_relative(value) for value in values]
    if isinstance(values, str) and "/world/" in values:
        return values.partition("/world/")[2]
    return values


def simulation(rng: Random, world: World) -> Case:
    content = mutate.document(rng, sound.SIMULATION, as_yaml=True)
    return Case(
        ("simulate", "x.yaml", "-o", "y.csv", "--truth", "z.csv", QUIET), {"x.yaml": content}, "x.yaml"
    )


def programme(rng: Random, world: World) -> Case:
    steps: dict[str, Any] = {
        "schema": "fogml.programme/1", "name": "own", "description": "own", "start_temperature": "25 degC",
        "power": "off", "table_acceleration": "50 deg/s2",
        "steps": [
            {"hold for 60 s": ["power on"]},
            {"soak at 25 degC for 3 min": ["turn at -10 deg/s for 20 s, from minute 1"]},
            *sound.STEPS[1:],
        ],
    }  # fmt: skip
    content = mutate.document(rng, steps, as_yaml=True)
    command = ("simulate", "--programme", "x.yaml", "--sample", "10", "-o", "y.csv", QUIET)
    return Case(command, {"x.yaml": content}, "x.yaml")


def sentence(rng: Random, world: World) -> Case:
    steps = list(sound.STEPS)
    at = rng.randrange(len(steps))
    for _ in mutate.edits(rng):
        words = steps[at].split(" ")
        words[rng.randrange(len(words))] = mutate.word(rng)
        steps[at] = " ".join(words)
    values = {**sound.SIMULATION, "programme": steps}
    return Case(
        ("simulate", "x.yaml", "-o", "y.csv", QUIET), {"x.yaml": json.dumps(values).encode()}, "x.yaml"
    )


def twin(rng: Random, world: World) -> Case:
    from importlib.resources import files

    name = rng.choice(("nominal", "tactical", "navigation"))
    values = _loaded((files("fogml.twin") / "twins" / f"{name}.yaml").read_bytes())
    content = mutate.document(rng, values, as_yaml=True)
    sources = {**some(world, "simulated."), "twin.yaml": content}
    return Case(("replay", "twin.yaml", "simulated.csv", "-o", "y.csv", QUIET), sources, "twin.yaml")


def profile(rng: Random, world: World) -> Case:
    content = mutate.document(rng, sound.PROFILE, as_yaml=True)
    return _imports(content, world["log.txt"], "x.yaml")


def logger(rng: Random, world: World) -> Case:
    rows = sound.logger_rows()
    pick = rng.random()
    content = sound.joined(mutate.table(rng, rows) if pick < 0.6 else rows, "\t")
    if pick > 0.5:
        content = mutate.data(rng, content)
    own = dict(sound.PROFILE)
    if rng.random() < 0.5:
        own |= {"reject": {}, "legs": {}}
    return _imports(json.dumps(own).encode(), content, "log.txt")


def _imports(profile: bytes, log: bytes, spoiled: str) -> Case:
    files = {"x.yaml": profile, "log.txt": log}
    return Case(("import", "log.txt", "--profile", "x.yaml", "-o", "o", QUIET), files, spoiled)


def manifest(rng: Random, world: World) -> Case:
    command = ["--any-unit", "--model", "mean", "--averaging", "30", "-o", "o", QUIET]
    if rng.random() < 0.5:
        content, name = _table_file(rng, _rows(world, "fleet.csv")), "m.csv"
    else:
        head, *rows = _rows(world, "fleet.csv")
        units = [dict(zip(head, row, strict=True)) for row in rows]
        content = mutate.document(rng, {"schema": "fogml.manifest/1", "units": units}, as_yaml=True)
        name = "m.yaml"
    return Case(("fleet", name, *command), {**some(world, "a.", "b.", "c."), name: content}, name)


def fleet_json(rng: Random, world: World) -> Case:
    which = rng.choice(("fleet/fleet.json", "fleet/FOG-1-x/outcome.json", "fleet/FOG-1-x/report.json"))
    content = mutate.document(rng, json.loads(world[which]), as_yaml=False)
    files = {**some(world, "a.", "b.", "c.", "fleet.csv", "fleet/"), which: content}
    more = ("--prior", which, "-o", "o") if which.endswith("fleet.json") else ("-o", "fleet")
    command = ("fleet", "fleet.csv", "--any-unit", "--model", "M2", "--averaging", "30", *more, QUIET)
    return Case(command, files, which)


def sweep_config(rng: Random, world: World) -> Case:
    content = mutate.document(rng, sound.sweep(trials=2), as_yaml=True)
    return Case(("sweep", "x.yaml", QUIET), {**some(world, "a.", "b.", "c."), "x.yaml": content}, "x.yaml")


def journal(rng: Random, world: World) -> Case:
    content = world["swept/study.journal"]
    if rng.random() < 0.5:
        content = mutate.data(rng, content)
    else:
        lines = content.decode().splitlines()
        at = rng.randrange(len(lines))
        lines[at] = json.dumps(mutate.tree(rng, json.loads(lines[at])))
        content = ("\n".join(lines) + "\n").encode()
    files = {**some(world, "a.", "b.", "c.", "sweep.yaml"), "swept/study.journal": content}
    return Case(("sweep", "sweep.yaml", QUIET), files, "swept/study.journal")


def misalignment(rng: Random, world: World) -> Case:
    content = _table_file(rng, sound.misalignment_rows())
    return Case(("lab", "misalignment", "x.csv", "-o", "o", QUIET), {"x.csv": content}, "x.csv")


def positions(rng: Random, world: World) -> Case:
    content = _table_file(rng, sound.position_rows())
    return Case(
        ("lab", "north", "--positions", "x.csv", "--latitude", "39.9", "-o", "o", QUIET),
        {"x.csv": content},
        "x.csv",
    )


def blind_json(rng: Random, world: World) -> Case:
    names = [
        name
        for name in world
        if name.startswith("suite/") and name.endswith((".json", ".npz", ".gz", "SUMS"))
    ]
    which = rng.choice(names)
    if which.endswith(".json") and rng.random() < 0.8:
        content = mutate.document(rng, json.loads(world[which]), as_yaml=False)
    elif which.endswith("marks.json.gz") and rng.random() < 0.8:
        import gzip

        content = gzip.compress(
            mutate.document(rng, json.loads(gzip.decompress(world[which])), as_yaml=False)
        )
    else:
        content = mutate.data(rng, world[which])
    files = {**some(world, "suite/"), which: content}
    if "marks" in which:
        return Case(("blind", "merge", which, "-o", "o", QUIET), files, which)
    if "/truth/" in which and not which.endswith("SUMS"):
        # Whoever edits a truth can write its sums as well.
        import hashlib

        truths = sorted(name for name in files if "/truth/" in name and not name.endswith("SUMS"))
        lines = [f"{hashlib.sha256(files[name]).hexdigest()}  {name.rpartition('/')[2]}\n" for name in truths]
        files["suite/truth/SHA256SUMS"] = "".join(lines).encode()
    return Case(("blind", "score", "suite", "--workers", "1", "-o", "o", QUIET), files, which)


_WORDS = (
    "T", "T_in", "T_out", "T1", "dT", "d(T)", "diff(T)", "sign(dT)", "(", ")", "[", "]", ",", "*", "^",
    "..", "3",
    "64", "s", "min", "block", "slope", "exp", "first", "+", "-", "0.5", "1e308", "T_in-T_out",
    "dT[block,64s]",
    "lag(T,600s)", "play(T,4degC)", "since_on(400s)", "hysteresis(T)", "power", "nothing", "1e-300", "^1..20",
)  # fmt: skip


def features(rng: Random, world: World) -> Case:
    if rng.random() < 0.7:
        text = rng.choice(("", " ")).join(rng.choice(_WORDS) for _ in range(rng.choice((1, 2, 3, 5, 8, 20))))
    else:
        text = mutate.text(
            rng, "T^1..3, dT[slope, 60 s], T*dT[block, 20 s], T_in-T_out, sign(dT), diff(T)[first]"
        )
    if rng.random() < 0.8:
        return Case(("only", "features", "--", _argument(text)))
    command = ("--test", "b.csv", "--model", "polynomial", "--averaging", "30", "-o", "o", QUIET)
    words = (*command, f"--features={_argument(text)}")
    return Case(("train", _training(rng, 0.5), *words), some(world, "a.", "b."))


def _training(rng: Random, share: float) -> str:
    """The training run; mostly one that is not there, so that what is checked before costs no training."""
    return "a.csv" if rng.random() < share else "nothing.csv"


_PARAMETERS = {
    "polynomial": ("ridge", "fit_intercept", "max_rows", "features"),
    "rbf": ("centres", "average_rows", "device", "rates", "ridge", "seed", "epochs", "width", "alpha"),
    "multipoint-2-1": ("ridge", "temperatures", "grid", "points"),
    "sklearn.svm.SVR": ("C", "kernel", "gamma", "epsilon", "degree", "tol", "max_iter", "cache_size"),
    "sklearn.linear_model.Ridge": ("alpha", "solver", "tol", "max_iter", "positive", "random_state"),
    "sklearn.ensemble.RandomForestRegressor": (
        "n_estimators",
        "max_depth",
        "criterion",
        "max_features",
        "n_jobs",
    ),
    "sklearn.neighbors.KNeighborsRegressor": ("n_neighbors", "weights", "metric", "p", "algorithm", "n_jobs"),
    "joint": ("ridge", "rate", "features"),
    "auto": ("folds", "design_index", "progress", "models"),
    "mean": ("x", "ridge"),
    "os.system": ("command",),
    "sklearn.externals.os.system": ("x",),
    "sklearn.utils.parallel.Parallel": ("n_jobs",),
    "sklearn.neural_network.MLPRegressor": ("hidden_layer_sizes", "activation", "max_iter", "alpha"),
}
_BOUNDED = {"n_estimators", "n_jobs", "max_iter", "epochs", "cache_size", "centres"}
"""Parameters by which anyone may ask for much work: large values are left out."""


def parameter(rng: Random, world: World) -> Case:
    model = rng.choice(list(_PARAMETERS))
    words = []
    for _ in mutate.edits(rng):
        name = rng.choice(_PARAMETERS[model]) if rng.random() < 0.9 else mutate.word(rng)
        value = rng.choice(
            (
                mutate.word(rng),
                rng.choice(("[1,2]", "{a: 1}", "foo", "-1", "0", "2", "1.5", "*a", "&a 1", "[nan]")),
            )
        )
        if name in _BOUNDED and any(digit in value for digit in "56789e"):
            value = "-1.5"
        words += ["--set", _argument(f"{name}={value}")]
    words += ["--features", "T"] if model.startswith("sklearn") or model in ("polynomial", "rbf") else []
    command = (
        "train",
        _training(rng, 0.5),
        "--test",
        "b.csv",
        "--model",
        model,
        "--averaging",
        "30",
        "-o",
        "o",
        QUIET,
    )
    return Case((*command, *words), some(world, "a.", "b."))


def _argument(text: str) -> str:
    """What a shell can hand on: no NUL."""
    return text.replace("\x00", "\ufffd")


SOUND_COMMANDS: dict[str, tuple[str, ...]] = {
    "inspect": ("a.csv",),
    "noise": ("a.csv",),
    "train": ("a.csv", "--test", "b.csv", "--model", "mean", "--averaging", "30"),
    "compare": ("a.csv", "--test", "b.csv", "--models", "mean", "--averaging", "30"),
    "compensate": ("b.csv", "--model", "trained/polynomial/model", "-o", "y.csv"),
    "export": ("trained/polynomial/model", "--to", "json"),
    "simulate": ("simulation.yaml", "-o", "y.csv"),
    "replay": ("tactical", "simulated.csv", "-o", "y.csv"),
    "import": ("log.txt", "--profile", "profile.yaml", "-o", "o"),
    "lab misalignment": ("turns.csv",),
    "lab north": ("--positions", "positions.csv", "--latitude", "39.9"),
    "lab north ": ("--azimuth", "10", "--latitude", "39.9"),
    "effects": ("kerr",),
    "fleet": ("fleet.csv", "--any-unit", "--model", "mean", "--averaging", "30"),
    "sweep": ("sweep.yaml", "--trials", "2"),
    "blind score": ("suite", "--workers", "1"),
    "blind merge": ("suite/marks.json.gz",),
    "plan": ("--runs", "0"),
    "diagnose": ("nothing.csv",),
    "demo": ("--seed", "x"),
    "blind make": ("suite", "--count", "0"),
    "blind run": ("suite", "--method", "nothing"),
}
"""Sound arguments of each command; those whose job takes minutes get arguments that they refuse."""
_COUNTS = {"workers", "threads", "trials", "count", "number", "batch", "jobs"}
"""Options by which anyone may ask for much work: large values are left out."""


def option(rng: Random, world: World) -> Case:
    from fogml.cli.main import app

    name = rng.choice(list(SOUND_COMMANDS))
    command: Any = app
    for word in name.split():
        command = command.get_command(None, word)
    words = list(SOUND_COMMANDS[name])
    known = [
        parameter
        for parameter in command.params
        if parameter.opts[0].startswith("-") and "--help" not in parameter.opts
    ]
    for _ in mutate.edits(rng):
        chosen = rng.choice(known)
        flag = rng.choice((*chosen.opts, *chosen.secondary_opts))
        if getattr(chosen, "is_flag", False):
            words.append(flag)
            continue
        value = _argument(mutate.word(rng))
        if chosen.name in _COUNTS and (any(digit in value for digit in "3456789e") or len(value) > 2):
            value = rng.choice(("0", "-1", "1", "x", "", "1.5", "nan"))
        if chosen.name == "cluster":
            value = rng.choice(("x", "", "tcp://", "http://["))
        if chosen.name == "storage":
            value = rng.choice(
                ("x", "", "postgresql://", "sqlite://", "sqlite:////nowhere/x.db", "postgresql://[")
            )
        words += [f"{flag}={value}"] if flag.startswith("--") and rng.random() < 0.7 else [flag, value]
    if rng.random() < 0.15:
        words.insert(rng.randrange(len(words) + 1), _argument(mutate.word(rng)))
    if rng.random() < 0.1 and words:
        del words[rng.randrange(len(words))]
    if name == "demo" and "x" not in words:
        words = ["--seed", "x"]
    files = {
        **some(world, *_FILES, "simulation.yaml", "sweep.yaml"),
        **(some(world, "suite/") if "blind" in name else {}),
    }
    return Case((*name.split(), *words, QUIET), files)


def model(rng: Random, world: World) -> Case:
    which = rng.choice(sound.models(world))
    home = f"trained/{which}/model"
    files, spoiled = spoiled_model(rng, world[f"{home}/model.json"], world[f"{home}/weights.safetensors"])
    held = {f"m/{name}": content for name, content in files.items()}
    pick = rng.random()
    if pick < 0.4:
        command: tuple[str, ...] = ("only", "load", "m")
    elif pick < 0.92:
        command = ("compensate", "b.csv", "--model", "m", "--any-unit", "-o", "y.csv", QUIET)
    else:
        to = rng.choice(("json", "json", "mat", "c"))
        command = ("export", "m", "--to", to, "-o", "o", QUIET)
    return Case(command, {**some(world, "b."), **held}, f"m/{spoiled}")


KINDS = (
    Kind("CSV run", 460, csv_run),
    Kind("Parquet run", 20, parquet_run),
    Kind("HDF5 run", 4, hdf5_run),
    Kind("MATLAB run", 4, mat_run),
    Kind("side file", 130, side_file),
    Kind("saved model", 120, model),
    Kind("settings of a command", 20, config),
    Kind("options of a command", 30, option),
    Kind("model parameters", 10, parameter),
    Kind("feature text", 100, features),
    Kind("import profile", 20, profile),
    Kind("logger's file", 15, logger),
    Kind("simulation", 5, simulation),
    Kind("programme", 6, programme),
    Kind("programme in sentences", 6, sentence),
    Kind("twin", 10, twin),
    Kind("fleet manifest", 4, manifest),
    Kind("fleet results", 2, fleet_json, "fleet/"),
    Kind("sweep configuration", 2, sweep_config),
    Kind("study journal", 3, journal, "swept/"),
    Kind("misalignment table", 4, misalignment),
    Kind("positions for north", 10, positions),
    Kind("blind suite", 3, blind_json, "suite/"),
    *(Kind(name, 2, partial(recording, file), f"{FOLDER}/{file}") for name, (*_, file) in NAMES.items()),
)
"""Every kind, and its share of about a thousand: what costs a whole job or a process is rarer."""
