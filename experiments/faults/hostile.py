"""Hostile inputs that have a name, each made anew: what happens now, and whether it is what is promised."""

from __future__ import annotations

import io
import json
import os
import re
import struct
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from experiments.faults import world as sound
from experiments.faults.batches import outcomes, sandbox
from experiments.faults.case import Case
from experiments.faults.inputs import QUIET, World, some
from experiments.faults.models import DOCUMENT, WEIGHTS, sealed
from experiments.faults.mutate import MARKER
from experiments.faults.sandbox import Limits, Outcome, Sandbox
from experiments.faults.world import make_world

Check = Callable[[Sandbox], Outcome]
C_CODE = (
    f"p */\nextern int system(const char *);\n__attribute__((constructor)) static void z(void) "
    f'{{ if (system("touch {MARKER}")) {{ }} }}\n/*'
)
"""C that makes the marker when a program that holds it is started, out of the comment that it stands in."""
TRAINED = ("train", "a.csv", "--test", "b.csv", "--averaging", "30", "-o", "o")
_SCRIPT = "<script>document.title='x'</script>"


@dataclass(frozen=True)
class Hostile:
    """One hostile input.

    Attributes
    ----------
    name
        What it is.
    cases
        Commands with their files; each has to end as `wanted` says, with none of the faults.
    wanted
        Exit statuses that hold.
    check
        In place of cases: what is done in a folder.
    """

    name: str
    cases: tuple[Case, ...] = ()
    wanted: tuple[int, ...] = (2,)
    check: Check | None = None


def hostile(limits: Limits | None = None, *, quick: bool = False) -> dict[str, Any]:
    """Try every hostile input; what happens and whether it held, JSON-ready."""
    limits = limits or Limits()
    with tempfile.TemporaryDirectory(prefix="fogml-hostile-") as name:
        world = make_world(Path(name) / "sound", quick=quick)
        named = list(inputs(world, 8 if quick else 40))
        steps = [(place, step) for place, one in enumerate(named) for step in (one.cases or (one.check,))]

        def do(index: int, home: Path) -> Outcome:
            _, step = steps[index]
            box = sandbox(home, limits, None)
            if isinstance(step, Case):
                return box.judged(step)
            assert step is not None
            return step(box)

        found: dict[int, list[Outcome]] = {}
        for index, outcome in outcomes(len(steps), do, Path(name), limits, batch=10):
            if index >= 0:
                found.setdefault(steps[index][0], []).append(outcome)
    return {"inputs": [_row(one, found[place]) for place, one in enumerate(named)]}


def _row(one: Hostile, found: list[Outcome]) -> dict[str, Any]:
    wrong = [outcome for outcome in found if outcome.faults or outcome.status not in one.wanted]
    shown = (wrong or found)[0]
    faults = "; ".join(f"{name}: {told}" for name, told in shown.faults.items())
    many = f"{len(found) - len(wrong)} of {len(found)}: " if len(found) > 1 else ""
    told = faults or f"exit {shown.status}{': ' if shown.told else ''}{shown.told}"
    # Where the examination's own folder lay is nobody's business.
    told = re.sub(re.escape(tempfile.gettempdir()) + r"/[^ ;:]*/", "…/", told)
    return {"name": one.name, "told": many + told, "held": not wrong}


def inputs(world: World, places: int) -> Iterator[Hostile]:
    """Every hostile input; HDF5 files are damaged at so many places."""
    yield from _models(world)
    yield from _yaml(world)
    yield from _binary(world, places)
    yield from _arguments(world)
    yield from _numbers(world)
    yield from _folders(world)


def _models(world: World) -> Iterator[Hostile]:
    document = json.loads(world[f"trained/M2/model/{DOCUMENT}"])
    weights = world[f"trained/M2/model/{WEIGHTS}"]

    def case(command: str, files: Mapping[str, bytes]) -> Case:
        held = {f"m/{name}": content for name, content in files.items()}
        words = {
            "export": ("export", "m", "--to", "c", "--dtype", "float64", "-o", "o", QUIET),
            "compensate": ("compensate", "b.csv", "--model", "m", "--any-unit", "-o", "y.csv", QUIET),
        }
        return Case(words[command], {**some(world, "b."), **held}, "m")

    def edited(**changes: Any) -> dict[str, Any]:
        return {**document, **changes}

    def hashes(value: Any) -> Any:
        """The card with every hash in it replaced."""
        if isinstance(value, dict):
            return {key: hashes(item) for key, item in value.items()}
        if isinstance(value, list):
            return [hashes(item) for item in value]
        return C_CODE if isinstance(value, str) and re.fullmatch("[0-9a-f]{64}", value) else value

    yield Hostile(
        "a model whose kind is C code, exported", (case("export", sealed(edited(kind=C_CODE), weights)),)
    )
    yield Hostile(
        "a model whose training runs' hash is C code, exported",
        (case("export", sealed(edited(card=hashes(document["card"])), weights)),),
        (0, 2),
    )
    yield Hostile(
        "a model whose unit, axis and features are C code or a script, exported",
        tuple(
            case("export", sealed(edited(card={**document["card"], key: text}), weights))
            for key in ("unit", "axis", "version")
            for text in (C_CODE, _SCRIPT)
        ),
        (0, 2),
    )
    header_size = struct.unpack("<Q", weights[:8])[0]
    header = json.loads(weights[8 : 8 + header_size])
    for name, value in (("not a number", float("nan")), ("infinite", float("inf")), ("1e308", 1e308)):
        at = 8 + header_size
        spoiled = weights[:at] + struct.pack("<d", value) + weights[at + 8 :]
        yield Hostile(
            f"a model with a weight that is {name}", (case("compensate", sealed(document, spoiled)),)
        )
    for kind, size in (("BF16", 2), ("I32", 4), ("BOOL", 1), ("F16", 2), ("I64", 8)):
        other = {
            name: entry
            if name == "__metadata__"
            else {**entry, "dtype": kind, "shape": [_bytes(entry) // size]}
            for name, entry in header.items()
        }
        held = json.dumps(other).encode()
        spoiled = struct.pack("<Q", len(held)) + held + weights[8 + header_size :]
        yield Hostile(
            f"a model with weights of type {kind}", (case("compensate", sealed(document, spoiled)),)
        )
    deep = b"[" * 100_000
    yield Hostile("a model of 100,000 brackets", (case("compensate", {DOCUMENT: deep, WEIGHTS: weights}),))
    changes = {
        "its box": edited(card=_changed(document["card"], "box")),
        "its form": edited(form="mean"),
        "its unit": edited(card={**document["card"], "unit": "FOG-9"}),
        "its sample interval as a text": edited(card={**document["card"], "sample_s": "1"}),
    }
    for name, spoiled_document in changes.items():
        files = {DOCUMENT: json.dumps(spoiled_document).encode(), WEIGHTS: weights}
        yield Hostile(f"a model edited by hand: {name}", (case("compensate", files),))


def _bytes(entry: Mapping[str, Any]) -> int:
    begin, end = entry["data_offsets"]
    return int(end - begin)


def _changed(card: Mapping[str, Any], key: str) -> dict[str, Any]:
    """The card with one number within a value made larger."""
    text = json.dumps(card[key])
    return {**card, key: json.loads(re.sub(r"\d+\.\d+", "999.5", text, count=1))}


def _yaml(world: World) -> Iterator[Hostile]:
    def facts(text: str) -> Case:
        return Case(("inspect", "x.csv", QUIET), {"x.csv": world["a.csv"], "x.yaml": text.encode()}, "x.yaml")

    for text in (
        "powered_on: yes",
        "latitude: 030",
        "powered_on: 1:30",
        "started: 20260302",
        "latitude: true",
    ):
        # In YAML 1.2 a leading zero is no octal number: 030 is 30 there, which is as it was meant.
        yield Hostile(f"facts: {text}", (facts(text + "\n"),), (0, 2) if "030" in text else (2,))
    laughs = "&a0 [1,1,1,1,1,1,1,1,1]"
    for number in range(1, 9):
        laughs = f"&a{number} [{laughs},{','.join([f'*a{number - 1}'] * 8)}]"
    yield Hostile("facts of nine nested aliases (a billion values)", (facts(f"latitude: {laughs}\n"),))
    yield Hostile("facts of 3,000 brackets", (facts("latitude: " + "[" * 3000 + "\n"),))
    yield Hostile(
        "facts with a tag that makes an object",
        (facts(f"notes: !!python/object/apply:os.system ['touch {MARKER}']\n"),),
    )
    yield Hostile("facts with a key twice", (facts("latitude: 1\nlatitude: 2\n"),))


def _binary(world: World, count: int) -> Iterator[Hostile]:
    import h5py
    from scipy.io import savemat

    run = sound.run(0)
    target = io.BytesIO()
    units = {"time": "s", "gyro": "deg/h", "rate": "deg/s"}
    savemat(target, {"time": run.time, "gyro": run.gyro, "rate": run.rate, "units": units})
    held = target.getvalue()
    at = held.rindex(struct.pack("<II", 16, 5))
    texts = tuple(
        Case(
            ("inspect", "x.mat", QUIET),
            {"x.mat": held[:at] + struct.pack("<I", kind) + held[at + 4 :]},
            "x.mat",
        )
        for kind in (0x4010, 0x10010, 0xFFFF, 0, 99)
    )
    yield Hostile("MATLAB files with a text of a type that there is none of", texts, (0, 2))
    rng = Random("headers")
    places = sorted(rng.sample(range(len(world["run.h5"])), count))
    damaged = tuple(
        Case(
            ("inspect", "x.h5", QUIET),
            {"x.h5": world["run.h5"][:place] + b"\xff" * 8 + world["run.h5"][place + 8 :]},
            "x.h5",
        )
        for place in places
    )
    yield Hostile(f"HDF5 files with eight bytes damaged, at {count} places", damaged, (0, 2))

    def linked(make: Callable[[Any], None]) -> Case:
        target = io.BytesIO()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with h5py.File(target, "w") as file:
                file["time [s]"], file["T [degC]"] = run.time, run.columns["T_in"]
                make(file)
        other = io.BytesIO()
        with h5py.File(other, "w") as file:
            file["x"] = run.gyro
        return Case(
            ("inspect", "x.h5", QUIET), {"x.h5": target.getvalue(), "other.h5": other.getvalue()}, "x.h5"
        )

    def external_link(file: Any) -> None:
        file["gyro [deg/h]"] = h5py.ExternalLink("other.h5", "/x")

    def external_data(file: Any) -> None:
        file.create_dataset(
            "gyro [deg/h]", shape=run.gyro.shape, dtype="f8", external=[("other.h5", 0, 8 * len(run))]
        )

    def virtual(file: Any) -> None:
        layout = h5py.VirtualLayout(shape=run.gyro.shape, dtype="f8")
        layout[:] = h5py.VirtualSource("other.h5", "x", shape=run.gyro.shape)
        file.create_virtual_dataset("gyro [deg/h]", layout)

    def vast(file: Any) -> None:
        file.create_dataset("gyro [deg/h]", shape=(10**13,), dtype="f8", chunks=(1024,))

    for name, make in (
        ("with a link to another file", external_link),
        ("with data in another file", external_data),
        ("with a virtual data set over another file", virtual),
        ("that claims 80 TB of samples", vast),
    ):
        yield Hostile(f"an HDF5 file {name}", (linked(make),))


def _arguments(world: World) -> Iterator[Hostile]:
    files = some(world, "a.", "b.")

    def trained(*words: str) -> Case:
        return Case((*TRAINED, *words, QUIET), files)

    for model, value in (
        ("sklearn.svm.SVR", "C=-1"), ("sklearn.svm.SVR", "kernel=foo"), ("polynomial", "ridge=inf"),
        ("polynomial", "ridge=[1,2]"), ("rbf", "centres=nan"), ("rbf", "device=foo"), ("rbf", "centres=-1"),
        ("sklearn.linear_model.Ridge", "alpha=x"),
    ):  # fmt: skip
        yield Hostile(
            f"--model {model} --set {value}", (trained("--model", model, "--features", "T", "--set", value),)
        )
    for name, text in (
        ("3,000 brackets", "(" * 3000 + "T" + ")" * 3000),
        ("a thousand factors", "*".join(["T"] * 1000)),
        ("a thousand products of ranges", "*".join(["T^1..20"] * 1000)),
    ):
        yield Hostile(f"feature text of {name}", (trained("--model", "polynomial", f"--features={text}"),))
    tolerance = ("export", "trained/M2/model", "--to", "json", "--tolerance", "inf", "-o", "o", QUIET)
    yield Hostile("--tolerance inf", (Case(tolerance, some(world, "trained/M2/model/")),))
    odd = os.fsdecode(b"x\xff.csv")
    yield Hostile(
        "a name of a file that is not UTF-8",
        (
            Case(("inspect", odd, "-o", "o", QUIET), {odd: world["a.csv"]}),
            Case(("inspect", os.fsdecode(b"no\xff.csv"), QUIET)),
        ),
        (0, 2),
    )
    side = ("compensate", "b.csv", "--model", "trained/M2/model", "-o", "folder.csv", QUIET)
    inside = {"folder.csv/mine.txt": b"mine", **some(world, "b.", "trained/M2/model/")}
    yield Hostile("compensate -o a folder called folder.csv", (Case(side, inside),))


def _numbers(world: World) -> Iterator[Hostile]:
    def run(name: str, text: str, *command: str) -> Hostile:
        return Hostile(name, (Case((*command, QUIET), {"x.csv": text.encode()}, "x.csv"),))

    head = "time [s],gyro [deg/h],T [degC]\n"
    tiny = head + "".join(f"{k}e-299,{10 + 0.1 * (k % 3)},25\n" for k in range(200))
    yield run("steps of 1e-299 s", tiny, "noise", "x.csv", "-o", "o")
    huge = head + "".join(f"{10 * k},{'1e308' if k % 2 else '-1e308'},25\n" for k in range(200))
    yield run("samples of 1e308", huge, "inspect", "x.csv")
    hot = head + "".join(f"{10 * k},5,{'1e308' if k % 2 else '-1e308'}\n" for k in range(200))
    yield run("temperatures of 1e308", hot, "inspect", "x.csv")
    log = ("import", "log.txt", "--profile", "x.yaml", "-o", "o", QUIET)
    for name, change, content in (
        (
            "an unclosed quote",
            {"separator": "comma"},
            sound.joined(sound.logger_rows()).replace(b"\n", b'\n"', 1),
        ),
        (
            "a NUL byte",
            {"separator": "comma"},
            sound.joined(sound.logger_rows()).replace(b"0.", b"\x000.", 1),
        ),
        ("a column position of 400 digits", {"axes": {"x": 10**400}}, world["log.txt"]),
        ("a column position out of range", {"axes": {"x": 10**9}}, world["log.txt"]),
    ):
        profile = json.dumps({**sound.PROFILE, "reject": {}, "legs": {}, "axis_facts": {}, **change}).encode()
        yield Hostile(f"import of a log with {name}", (Case(log, {"x.yaml": profile, "log.txt": content}),))
    for step in ("2.0e-300", "'1'", ".nan", "-1", "1e300"):
        text = json.dumps({**sound.SIMULATION, "sample_s": 0}).replace('"sample_s": 0', f'"sample_s": {step}')
        yield Hostile(
            f"simulate with sample_s: {step}",
            (Case(("simulate", "x.yaml", "-o", "y.csv", QUIET), {"x.yaml": text.encode()}),),
        )
    lines = world["simulated.csv"].decode().splitlines()
    vast = "\n".join([lines[0], *[re.sub(r"^([^,]*),[^,]*", r"\1,1e308", line) for line in lines[1:]]]) + "\n"
    files = {"x.csv": vast.encode(), "x.yaml": world["simulated.yaml"]}
    yield Hostile(
        "replay of samples of 1e308", (Case(("replay", "tactical", "x.csv", "-o", "y.csv", QUIET), files),)
    )
    rows = sound.misalignment_rows()
    rows[5][-1] = "1e308"
    yield Hostile(
        "a table of turns with 1e308",
        (Case(("lab", "misalignment", "x.csv", "-o", "o", QUIET), {"x.csv": sound.joined(rows)}),),
    )
    if "suite/answers-abstain/0001/outcome.json" in world:
        which = "suite/answers-abstain/0001/outcome.json"
        told = json.dumps({**json.loads(world[which]), "seconds": "long"}).encode()
        score = ("blind", "score", "suite", "--workers", "1", "-o", "o", QUIET)
        yield Hostile(
            "a text for a number in an outcome of the blind check",
            (Case(score, {**some(world, "suite/"), which: told}),),
            (0, 2),
        )


def _folders(world: World) -> Iterator[Hostile]:
    def write(folder: Path, names: Mapping[str, bytes]) -> None:
        for name, content in names.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)

    def fresh(box: Sandbox) -> Path:
        folder = box.home / "steps"
        folder.mkdir(exist_ok=True)
        os.chdir(folder)
        return folder

    fleet = ("fleet", "m.csv", "--model", "mean", "--averaging", "30", "-o", "o", "--any-unit", QUIET)

    def changed_side_file(box: Sandbox) -> Outcome:
        folder = fresh(box)
        runs = some(world, "a.csv", "b.csv")
        facts = "input_axis: up\nlatitude: {}\n"
        sides = {f"{name}.yml": facts.format(10).encode() for name in "ab"}
        write(folder, {**runs, **sides, "m.csv": b"unit,job,train,test,axis\nF,train,a.csv,b.csv,\n"})
        rms = []
        for latitude in (10, 80):
            (folder / "a.yml").write_text(facts.format(latitude))
            box.command(fleet)
            report = json.loads(next((folder / "o").glob("*/report.json")).read_text())
            rms.append(report["test"][0]["after"]["rms"])
        same = abs(rms[0] - rms[1]) < 1e-6
        return Outcome(
            0,
            {"silent change": f"rms {rms[0]:.3g} stays"} if same else {},
            told=f"rms {rms[0]:.3g}, then {rms[1]:.3g}",
        )

    def growing(box: Sandbox) -> Outcome:
        folder = fresh(box)
        line = "{},5.0,25.0\n"
        path = folder / "x.csv"
        path.write_text("time [s],gyro [deg/h],T [degC]\n" + "".join(line.format(k) for k in range(200_000)))
        stop = threading.Event()

        def grow() -> None:
            number = 200_000
            with path.open("a") as file:
                while not stop.is_set():
                    file.write(line.format(number))
                    file.flush()
                    number += 1
                    stop.wait(0.001)

        thread = threading.Thread(target=grow)
        thread.start()
        try:
            status, _, stderr = box.command(("inspect", "x.csv", QUIET))
        finally:
            stop.set()
            thread.join()
        return Outcome(
            status, {} if status == 2 else {"silent change": "read while it grew"}, told=stderr.strip()[:200]
        )

    def missing(box: Sandbox) -> Outcome:
        folder = fresh(box)
        names = b"unit,job,train,test,axis\nF,train,a.csv,b.csv,\nG,train,gone.csv,b.csv,\n"
        write(folder, {**some(world, "a.csv", "b.csv"), "m.csv": names})
        status, _, stderr = box.command(fleet)
        path = folder / "o/fleet.json"
        if not path.is_file():
            return Outcome(status, {"left": "nothing is done"}, told=stderr.strip()[:200])
        states = [unit["status"] for unit in json.loads(path.read_text())["units"]]
        return Outcome(
            status,
            {} if states == ["done", "failed"] else {"left": str(states)},
            told=f"units: {', '.join(states)}",
        )

    def shared(box: Sandbox) -> Outcome:
        folder = fresh(box)
        write(folder, some(world, "a.", "b."))
        box.command((*TRAINED, "--model", "mean", QUIET))
        first = {path.name: path.read_bytes() for path in (folder / "o").glob("*.yaml")}
        box.command(("noise", "a.csv", "-o", "o", QUIET))
        lost = [name for name, held in first.items() if (folder / "o" / name).read_bytes() != held]
        names = sorted(path.name for path in (folder / "o").glob("*.yaml"))
        return Outcome(0, {"left": f"{lost} of the first overwritten"} if lost else {}, told=", ".join(names))

    def unexpected(box: Sandbox) -> Outcome:
        import fogml.runs.reading as reading

        folder = fresh(box)
        write(folder, some(world, "a."))
        was = reading.read_runs

        def broken(*arguments: Any, **options: Any) -> Any:
            raise RuntimeError("planted")

        reading.read_runs = broken
        try:
            status, _, stderr = box.command(("inspect", "a.csv", QUIET))
        finally:
            reading.read_runs = was
        one = len(stderr.strip().splitlines()) == 1
        return Outcome(status, {} if one else {"message": stderr[-200:]}, told=stderr.strip()[:200])

    yield Hostile("a fleet resumed after a side file .yml has changed", check=changed_side_file, wanted=(0,))
    yield Hostile("a run that grows while it is read", check=growing)
    yield Hostile("a manifest with a missing run", check=missing, wanted=(1, 2, 0))
    yield Hostile("a second command into the folder of the first", check=shared, wanted=(0,))
    yield Hostile("an error that nobody expected, planted", check=unexpected, wanted=(3,))
