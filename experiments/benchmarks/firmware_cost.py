"""What C costs: instructions of a call, counted by callgrind, and flash on a Cortex-M4."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

_ROUNDS = (2, 12)
_MAIN = """
#include <stdio.h>
#include <stdlib.h>
int main(int count, char **words)
{
    static NUMBER x[ROWS][INPUTS];
    double sum = 0.0;
    int rounds = atoi(words[1]);
    if (count < 2 || fread(x, sizeof x, 1, stdin) != 1) return 2;
    for (int round = 0; round < rounds; round++)
        for (int row = 0; row < ROWS; row++) sum += (double)CALL;
    printf("%g\\n", sum);
    return 0;
}
"""


def instructions(
    folder: Path, head: str, call: str, number: str, rows: NDArray[Any], more: list[str]
) -> float | None:
    """Instructions of one call, or None without valgrind."""
    if shutil.which("valgrind") is None:
        return None
    source = _MAIN.replace("NUMBER", number).replace("CALL", call)
    source = source.replace("ROWS", str(len(rows))).replace("INPUTS", str(rows.shape[1]))
    (folder / "main.c").write_text(head + source)
    words = ["gcc", "-std=gnu99", "-O2", "-ffp-contract=off", "-w", *more, "main.c", "-o", "main", "-lm"]
    subprocess.run(words, check=True, cwd=folder)
    counts = []
    for rounds in _ROUNDS:
        tool = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "./main", str(rounds)]
        told = subprocess.run(tool, input=rows.tobytes(), capture_output=True, cwd=folder, check=True)
        counts.append(int(re.search(rb"Collected : (\d+)", told.stderr)[1]))  # type: ignore[index]
    return (counts[1] - counts[0]) / (_ROUNDS[1] - _ROUNDS[0]) / len(rows)


def cortex_bytes(folder: Path, source: str, more: list[str]) -> int | None:
    """Flash [bytes] of a source on a Cortex-M4, the C library's own functions apart."""
    if shutil.which("arm-none-eabi-gcc") is None:
        return None
    from fogml.export.c_program import CORTEX_M4

    (folder / "size.c").write_text(source)
    words = [
        "arm-none-eabi-gcc",
        *CORTEX_M4,
        "-std=gnu99",
        "-Os",
        "-w",
        *more,
        "-c",
        "size.c",
        "-o",
        "size.o",
    ]
    subprocess.run(words, check=True, cwd=folder)
    told = subprocess.run(
        ["arm-none-eabi-size", "size.o"], capture_output=True, text=True, cwd=folder, check=True
    )
    text, data, _ = (int(word) for word in told.stdout.splitlines()[1].split()[:3])
    return text + data
