"""Whether commands give the same figures on another processor: ``python -m experiments.repeatability``.

Libraries choose their routines by the processor and add up in another order on each. Their switches let one
machine work as an older one does. Every job runs so, and all numbers of its JSON files are compared. Writes
``results.json`` and ``results.md`` beside itself. Needs an x86 processor with AVX2 or more.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from experiments.results import write_results

HERE = Path(__file__).parent
MACHINES: dict[str, dict[str, str]] = {
    "this": {"OMP_NUM_THREADS": "1"},
    "AVX2": {
        "OMP_NUM_THREADS": "2",
        "OPENBLAS_CORETYPE": "Haswell",
        "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
        "ARROW_USER_SIMD_LEVEL": "AVX2",
        "ATEN_CPU_CAPABILITY": "avx2",
    },
    "SSE3": {
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_CORETYPE": "Prescott",
        "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
        "NUMBA_CPU_NAME": "generic",
        "ARROW_USER_SIMD_LEVEL": "NONE",
        "ATEN_CPU_CAPABILITY": "default",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F,-AVX2_Usable,-FMA_Usable",
    },
}
"""What each machine is told of itself. The first is as it is, and the others are compared with it."""
TACTICAL = "simulate --programme multi-point-cycle --twin tactical --seed"
STAIRCASE = "simulate --programme joint-staircase --twin tactical --seed"
RUNS = [
    *(f"{TACTICAL} {n} -o run-{n}.csv" for n in (1, 2)),
    *(f"{STAIRCASE} {n} -o stairs-{n}.csv" for n in (1, 2)),
    "simulate --programme four-positions --twin tactical -o seek.csv",
]
"""Made once: what reads them reads the same digits."""
MEMS = "train shipped:thermal-cycle-1-y --test shipped:thermal-cycle-2-y --averaging 10 --model"
TWIN = "train ../run-1.csv --test ../run-2.csv --model"
JOBS = {
    "noise of the ring laser": "noise shipped:ring-laser-z -o out",
    **{
        f"{model}, twin": f"{TWIN} {model} -o out" for model in ("auto", "polynomial", "mixed-effects", "rbf")
    },
    **{
        f"{model}, MEMS": f"{MEMS} {model} -o out" for model in ("auto", "polynomial", "mixed-effects", "rbf")
    },
    "joint, twin": "train ../stairs-1.csv --test ../stairs-2.csv --model joint -o out",
    "rate table": "lab rate --twin tactical -o out",
    "north": "lab north --positions ../seek.csv -o out",
    "plan": "plan --want k1 --hours 12 -o out",
    "diagnosis": "diagnose ../run-1.csv --held-out ../run-2.csv -o out",
}
SEEDS = (1, 2, 3)
LEAST = 1e-9
"""Numbers under it count as zero: the phase of a response that has none [deg], for instance."""


def told(command: str, folder: Path, machine: dict[str, str]) -> None:
    """Run one command of fogml in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    line = [sys.executable, "-m", "fogml", *shlex.split(command), "-q"]
    done = subprocess.run(line, cwd=folder, env={**os.environ, **machine}, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{command}: status {done.returncode}")


def figures(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """What a document states, by where it stands."""
    inner: Sequence[tuple[Any, Any]] = []
    if isinstance(value, dict):
        inner = list(value.items())
    elif isinstance(value, list):
        inner = list(enumerate(value))
    else:
        yield path, value
    for key, held in inner:
        yield from figures(held, f"{path}/{key}")


def documents(folder: Path) -> dict[str, Any]:
    """All that the JSON files of a folder state, but for what names moment or machine."""
    found = {}
    for file in sorted(folder.rglob("*.json")):
        for place, value in figures(json.loads(file.read_text(encoding="utf-8")), file.name):
            if not {"sha256", "time_s", "seconds", "packages", "created"} & set(place.split("/")):
                found[place] = value
    return found


def compared(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """How far numbers of two machines are apart, relative to the larger, and what else differs."""
    apart: dict[str, float] = {}
    words = []
    for place in sorted(one.keys() | other.keys()):
        a, b = one.get(place), other.get(place)
        if type(a) is float and type(b) is float:
            largest = max(abs(a), abs(b))
            apart[place] = abs(a - b) / largest if largest > LEAST else 0.0
        elif a != b:
            words.append(place)
    ranked = sorted(apart, key=lambda p: -apart[p])
    return {
        "numbers": len(apart),
        "over_1e-6": sum(v > 1e-6 for v in apart.values()),
        "over_1e-3": sum(v > 1e-3 for v in apart.values()),
        "largest": apart[ranked[0]] if ranked else 0.0,
        "where": ranked[0] if ranked else "",
        "words": len(words),
    }


def left(folder: Path) -> float:
    """Rms that a model leaves on the test run [deg/h]."""
    report = json.loads((folder / "out" / "report.json").read_text(encoding="utf-8"))
    return float(report["test"][0]["after"]["rms"])


def page(rows: dict[str, Any], spread: dict[str, dict[str, float]]) -> str:
    """The result page."""
    others = list(MACHINES)[1:]
    lines = [
        "# The same commands on other processors",
        "",
        "`python -m experiments.repeatability`: numerical libraries told to work as on processors with AVX2",
        "or with SSE3 alone, one of them with two threads, beside this one as it is. All numbers of the JSON",
        "files of each job, relative to the larger of two; those under 1e-9 count as zero. **Synthetic**",
        "(tactical twin) and the shipped recordings, a MEMS unit and a ring laser.",
        "",
        "| job | numbers | " + " | ".join(f"{m}: over 1e-6 | over 1e-3 | largest" for m in others) + " |",
        "|---|---:|" + "---:|" * 3 * len(others),
    ]
    for job, by_machine in rows.items():
        cells = [
            f"{v['over_1e-6']} | {v['over_1e-3']} | {v['largest']:.0e}"
            for v in (by_machine[m] for m in others)
        ]
        lines.append(f"| {job} | {by_machine[others[0]]['numbers']} | " + " | ".join(cells) + " |")
    seeds = [f"seed {n}" for n in SEEDS]
    lines += [
        "",
        "A network's shape is searched among optima that lie close together, and what a processor rounds may",
        "decide between them, as another seed does. What is left on the test run [deg/h rms]:",
        "",
        "| network | " + " | ".join([*MACHINES, *seeds]) + " |",
        "|---|" + "---:|" * (len(MACHINES) + len(SEEDS)),
        *(
            f"| {job} | " + " | ".join(f"{by[name]:.4g}" for name in [*MACHINES, *seeds]) + " |"
            for job, by in spread.items()
        ),
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    """Run all jobs on all machines and write the results."""
    rows: dict[str, Any] = {}
    spread: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        for command in RUNS:
            told(command, root, MACHINES["this"])
        for number, (job, command) in enumerate(JOBS.items()):
            folders = {machine: root / f"{number}-{machine}" for machine in MACHINES}
            for machine, folder in folders.items():
                told(command, folder, MACHINES[machine])
            held = {machine: documents(folder) for machine, folder in folders.items()}
            rows[job] = {m: compared(held["this"], held[m]) for m in list(MACHINES)[1:]}
            print(job, rows[job], flush=True)
            if " rbf " in command:
                for seed in SEEDS:
                    folders[f"seed {seed}"] = root / f"{number}-seed-{seed}"
                    told(f"{command} --seed {seed}", folders[f"seed {seed}"], MACHINES["this"])
                spread[job] = {column: left(folder) for column, folder in folders.items()}
    write_results(HERE, {"jobs": rows, "left_deg_h": spread}, page(rows, spread))


if __name__ == "__main__":
    main()
