"""Exported C on a Cortex-M4 under QEMU beside the same C on this machine: the same bits, sample by sample.

``python -m experiments.firmware.cortex_m4 --hours 48`` trains a model on a synthetic unit, exports it, builds
it for a Cortex-M4 with its floating-point unit (ARM MPS2, AN386) and runs `unit.c` there. It writes
``results.json`` and ``results.md`` beside itself. Needs arm-none-eabi-gcc and qemu-system-arm.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from experiments.firmware.units import trained_model
from experiments.results import write_results
from fogml import __version__
from fogml.export.c_program import CORTEX_M4, FLAGS, host_compiler
from fogml.export.export import export_model
from fogml.export.settings import ExportSettings

HERE = Path(__file__).parent
SAMPLE_S = 0.01
FEATURES = "T^1..3, dT[exp, 64 s], T*dT[exp, 64 s]"
"""With exponential memory a sample takes a twentieth of the work of windows' means: so a day is soon run."""
QEMU = (
    *("qemu-system-arm", "-M", "mps2-an386", "-display", "none", "-serial", "none", "-monitor", "none"),
    *("-chardev", "stdio,id=told", "-semihosting-config", "enable=on,target=native,chardev=told"),
)


def built(model: Path, folder: Path, samples: int) -> dict[str, list[str]]:
    """What runs the unit for so many samples on this machine, and on a Cortex-M4.

    Parameters
    ----------
    model
        Folder of exported C.
    folder
        Where to compile.
    """
    flags = [*FLAGS, f"-DSAMPLES={samples}U", "-I", str(model), "-I", str(HERE)]
    sources = [str(model / "fogml_model.c"), str(HERE / "unit.c")]
    subprocess.run(
        [host_compiler(), *flags, *sources, str(HERE / "report_host.c"), "-o", str(folder / "host")],
        check=True,
    )
    bare = [
        "-ffreestanding",
        "-nostdlib",
        "-ffunction-sections",
        "-Wl,--gc-sections",
        "-T",
        str(HERE / "mps2.ld"),
    ]
    # Vectors are addresses of functions among those of data.
    target = [flag for flag in flags if flag != "-Wpedantic"]
    subprocess.run(
        [
            "arm-none-eabi-gcc",
            *CORTEX_M4,
            *target,
            *bare,
            *sources,
            str(HERE / "report_m4.c"),
            "-lgcc",
            "-o",
            str(folder / "unit.elf"),
        ],
        check=True,
    )
    return {"this machine": [str(folder / "host")], "Cortex-M4": [*QEMU, "-kernel", str(folder / "unit.elf")]}


def reports(model: Path, samples: int) -> dict[str, str]:
    """What each machine reports."""
    with tempfile.TemporaryDirectory() as name:
        machines = built(model, Path(name), samples)
        found = {}
        for machine, words in machines.items():
            began = time.monotonic()
            done = subprocess.run(words, capture_output=True, text=True, check=True, stdin=subprocess.DEVNULL)
            found[machine] = done.stdout
            print(machine, f"{time.monotonic() - began:.0f} s", flush=True)
    return found


def main() -> int:
    """Run, compare, write; 1 if a bit differs."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--hours", type=int, default=48)
    parser.add_argument("--features", default=FEATURES)
    asked = parser.parse_args()
    model = trained_model(asked.features)
    with tempfile.TemporaryDirectory() as name:
        report = export_model(model, Path(name), ExportSettings("c", "float32", sample_s=SAMPLE_S))
        told = reports(Path(name), round(3600 * asked.hours / SAMPLE_S))
    same = len(set(told.values())) == 1
    figures = dict(line.rsplit(" ", 1) for line in told["Cortex-M4"].splitlines())
    result: dict[str, Any] = {
        "fogml": __version__,
        "data": "synthetic",
        "features": asked.features,
        "hours": asked.hours,
        "same_bits": same,
        "cortex_m4": report["cortex_m4"],
        "figures": {name: int(value) for name, value in figures.items()},
    }
    rows = [f"| {name} | {value} |" for name, value in figures.items()]
    text = [
        f"# {asked.hours} h at 100 Hz on a Cortex-M4 under QEMU",
        "",
        f"Synthetic. Polynomial of {asked.features}, float32, through `unit.c` on QEMU's MPS2 "
        f"with a Cortex-M4 and on this machine: outputs and flags of all samples are {'' if same else 'NOT '}"
        "the same bits. "
        "Each hour a thermometer shows 85 °C once.",
        "",
        "| | |",
        "|---|---|",
        *rows,
    ]
    page = "\n".join(text) + "\n"
    write_results(HERE, result, page)
    print(page)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
