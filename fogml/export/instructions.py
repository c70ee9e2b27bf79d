"""How many instructions of a Cortex-M4 a sample takes: counted in an emulator."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from fogml.export.c_program import COMPILING, CORTEX_M4, FLAGS, write_files
from fogml.export.c_source import COUNTED, CSource
from fogml.limited import run_limited

_EMULATED_CPU = "cortex-a15"
# It knows all that a Cortex-M4's code is made of, and programs of Linux besides.


def instructions_per_sample(source: CSource, folder: Path) -> int | None:
    """Instructions of a Cortex-M4 for one sample, windows full; None without its compiler or qemu-arm.

    A Cortex-M4 takes one cycle for most, two and more for loads, branches and divisions.
    """
    compiler, emulator = shutil.which("arm-none-eabi-gcc"), shutil.which("qemu-arm")
    if compiler is None or emulator is None:
        return None
    write_files({**source.files, "probe.c": source.probe}, folder)
    program = folder / "probe.elf"
    flags = [flag for flag in FLAGS if flag not in ("-O2", "-Wpedantic", "-Werror")]
    if not _done(
        [
            compiler,
            *CORTEX_M4,
            *flags,
            "-O2",
            "-DFOGML_NO_SELF_TEST",
            "-ffreestanding",
            *("-nostdlib", "-ffunction-sections", "-Wl,--gc-sections"),
            str(folder / "probe.c"),
            "-lgcc",
            "-o",
            str(program),
        ]
    ):
        return None
    trace = folder / "trace"
    words = [
        emulator,
        "-cpu",
        _EMULATED_CPU,
        "-singlestep",
        "-d",
        "exec,nochain",
        "-D",
        str(trace),
        str(program),
    ]
    if not _done(words):
        return None
    count, counting = 0, False
    with trace.open(encoding="ascii", errors="replace") as lines:
        for line in lines:
            if not counting:
                counting = re.search(r"\bcount_begin$", line.rstrip()) is not None
            elif line.rstrip().endswith("count_end"):
                break
            else:
                count += 1
    return round(count / COUNTED) if count else None


def _done(words: Sequence[str]) -> bool:
    return run_limited(words, COMPILING).status == 0
