"""Generated C compiled and run: here, or for another machine under an emulator, which counts instructions."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping, Sequence
from itertools import dropwhile, takewhile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.escaping import terminal_text
from fogml.export.c_source import COUNTED, DRIVER, SOURCE, CSource
from fogml.limited import Finished, LimitExceededError, ProgramLimits, run_limited
from fogml.processes import needs_posix

COMPILERS = ("cc", "gcc", "clang")
FLAGS = (
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Werror",
    "-Wconversion",
    "-Wdouble-promotion",
)
CORTEX_M4 = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")
_LIBRARIES = ("-Wl,--start-group", "-lgcc", "-lc", "-Wl,--end-group")
COMPILING = ProgramLimits(cpu_s=120, wall_s=300.0, memory_bytes=4 << 30, output_bytes=256 << 20)
"""What a compiler may take: a hundred times what the largest network needs."""
RUNNING = ProgramLimits(cpu_s=120, wall_s=300.0, memory_bytes=1 << 30, output_bytes=1 << 30)
"""What generated C may take on points and a history: under an emulator or sanitizers too."""


def host_compiler() -> str:
    """The C compiler of this machine: ``$CC``, or the first found of cc, gcc and clang."""
    needs_posix("export of C, which is compiled and compared with the model within limits,")
    for name in (os.environ.get("CC", ""), *COMPILERS):
        if name and shutil.which(name):
            return name
    raise InputError(
        "export: no C compiler (cc, gcc or clang) was found; C code is compiled and compared with the "
        "model before it is written, so install one, or name it in the variable CC"
    )


class CProgram:
    """A driver around generated C, compiled into a folder.

    Parameters
    ----------
    source
        Generated C.
    folder
        Where to compile.
    compiler, flags, runner
        Compiler, its options, and what to run the program under, e.g. an emulator.
    running
        What the program may take.

    Raises
    ------
    InputError
        If the compiler refuses the source, or takes more than it may.
    """

    def __init__(
        self,
        source: CSource,
        folder: Path,
        compiler: str | None = None,
        flags: Sequence[str] = FLAGS,
        runner: Sequence[str] = (),
        running: ProgramLimits = RUNNING,
    ) -> None:
        self._running = running
        program = _built({**source.files, DRIVER: source.driver}, DRIVER, folder, compiler, flags)
        self._words = [*runner, str(program)]
        types = {"double": "f8", "float": "f4", "int64_t": "i8", "int32_t": "i4", "int16_t": "i2"}
        self._types = {
            name: np.dtype("<" + types[source.numbers[f"{name}_type"]])
            for name in ("temperature", "gyro", "atom", "exp")
        }
        self.places = max(1, len(source.plan.sensors))

    def _run(self, mode: str, data: bytes, *more: str) -> bytes:
        return _output(self._done(mode, data, *more))

    def _done(self, mode: str, data: bytes = b"", *more: str) -> Finished:
        return _limited([*self._words, mode, *more], self._running, "the generated C", data)

    def self_test(self) -> int:
        """What ``fogml_self_test`` returns."""
        return self._done("self-test").status

    def state_bytes(self) -> int:
        """Bytes of a state, as of every machine that aligns 64-bit numbers to 8 bytes."""
        return self._number("bytes")

    def sum_of_numbers(self) -> int:
        """The self-test's sum of all numbers that the code holds."""
        return self._number("sum")

    def _number(self, mode: str) -> int:
        return int(np.frombuffer(self._run(mode, b""), dtype="<u4")[0])

    def steps(
        self, time: Any, temperatures: Any, gyro: Any, power_cycle: tuple[int, int] | None = None
    ) -> tuple[NDArray[Any], NDArray[np.int32]]:
        """Outputs and flags of `fogml_step`, all in the numbers that the code takes.

        Times are in seconds, or whole microseconds where they are integers; those may be negative, as clocks
        wrap. With a `power_cycle` the state is saved before the sample of that number and restored on a new
        clock, after so many microseconds off.
        """
        time = np.asarray(time)
        if time.dtype.kind == "f":
            time = np.round(time * 1e6).astype(np.int64)
        fields = [
            ("time", "<u8"),
            ("temperatures", self._types["temperature"], (self.places,)),
            ("gyro", self._types["gyro"]),
        ]
        records = np.zeros(len(time), dtype=fields)
        records["time"], records["gyro"] = time.astype(np.uint64), gyro
        if np.size(temperatures):
            kind = self._types["temperature"]
            if kind.kind == "i":
                temperatures = np.clip(temperatures, np.iinfo(kind).min, np.iinfo(kind).max)
            records["temperatures"] = temperatures
        return self._outputs(self._run("steps", records.tobytes(), *map(str, power_cycle or ())))

    def atoms(self, atoms: Any, gyro: Any) -> tuple[NDArray[Any], NDArray[np.int32]]:
        """Outputs and flags from values of the atoms, windows full, in the numbers of the code."""
        fields = [("atoms", self._types["atom"], (np.shape(atoms)[1],)), ("gyro", self._types["gyro"])]
        records = np.zeros(len(atoms), dtype=fields)
        records["atoms"], records["gyro"] = atoms, gyro
        return self._outputs(self._run("atoms", records.tobytes()))

    def exponential(self, values: Any) -> NDArray[Any]:
        """The generated exponential exp(-u)."""
        kind = self._types["exp"]
        return np.frombuffer(self._run("exp", np.asarray(values, dtype=kind).tobytes()), dtype=kind)

    def _outputs(self, data: bytes) -> tuple[NDArray[Any], NDArray[np.int32]]:
        answers = np.frombuffer(data, dtype=[("out", self._types["gyro"]), ("flag", "<i4")])
        return answers["out"], answers["flag"]


def compiled_output(files: Mapping[str, str], main: str, folder: Path, data: bytes) -> bytes:
    """What a program of generated C writes for `data`: its files are compiled into `folder` and run.

    Raises
    ------
    InputError
        If the compiler refuses them, or the program fails.
    """
    return _output(_limited([str(_built(files, main, folder))], RUNNING, "the generated C", data))


def write_files(files: Mapping[str, str], folder: Path) -> None:
    """Write generated files into a folder, by their names."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def _built(
    files: Mapping[str, str],
    main: str,
    folder: Path,
    compiler: str | None = None,
    flags: Sequence[str] = FLAGS,
) -> Path:
    """The program of generated files, compiled in a folder."""
    write_files(files, folder)
    program = folder / "program"
    _compile([compiler or host_compiler(), *flags, str(folder / main), "-o", str(program)])
    return program


def run_self_test(files: Mapping[str, str], header: str, function: str, source: str, folder: Path) -> int:
    """What a function without arguments of generated files returns on this machine, compiled in a folder."""
    main = f'#include "{header}"\n#include "{source}"\n\nint main(void)\n{{\n    return {function}();\n}}\n'
    program = _built({**files, "main.c": main}, "main.c", folder)
    return _limited([str(program)], RUNNING, "the generated C").status


def _output(done: Finished) -> bytes:
    """What a program of generated C wrote, if it did not fail."""
    if done.status != 0:
        raise InputError(f"export: the generated C failed ({done.status}): {_told(done)}")
    return done.output


def cortex_m4_size(source: CSource, folder: Path) -> dict[str, Any] | None:
    """Flash and RAM [bytes] on a Cortex-M4, or None where its compiler is not installed.

    Flash is code and constants; RAM is one state. The self-test, which has a state of its own, is
    counted apart, and so is what the compiler's own library adds where nothing else calls it: 64-bit
    division, double precision, the copy of a state; None for that where it is not installed.
    """
    compiler, size = shutil.which("arm-none-eabi-gcc"), shutil.which("arm-none-eabi-size")
    if compiler is None or size is None:
        return None
    write_files(source.files, folder)
    figures = {}
    for label, more in (("lean", ["-DFOGML_NO_SELF_TEST"]), ("whole", [])):
        target = folder / f"{label}.o"
        words = [compiler, *CORTEX_M4, *FLAGS, "-Os", *more, "-c", str(folder / SOURCE), "-o", str(target)]
        _compile(words)
        figures[label] = _sizes(size, target)
    ram = cortex_m4_state_bytes(source, folder)
    version = _compile([compiler, "-dumpfullversion"]).strip()
    lean, whole = figures["lean"], figures["whole"]
    linked = folder / "linked.elf"
    words = [compiler, *CORTEX_M4, "-nostdlib", "-Wl,-e,fogml_step", str(folder / "lean.o"), *_LIBRARIES]
    library = None
    if _done([*words, "-o", str(linked)]):
        library = sum(_sizes(size, linked)[:2]) - lean[0] - lean[1]
    return {
        "compiler": f"arm-none-eabi-gcc {version}",
        "flags": " ".join([*CORTEX_M4, "-Os"]),
        "flash_bytes": lean[0] + lean[1],
        "library_flash_bytes": library,
        "ram_bytes": ram,
        "self_test_flash_bytes": whole[0] + whole[1] - lean[0] - lean[1],
        "self_test_ram_bytes": whole[2] - lean[2],
    }


def cortex_m4_state_bytes(source: CSource, folder: Path) -> int:
    """RAM of one state on a Cortex-M4 [bytes], whose compiler is installed."""
    write_files(source.files, folder)
    probe, target = folder / "state.c", folder / "state.o"
    probe.write_text('#include "fogml_model.h"\nfogml_state state;\n', encoding="utf-8")
    more = ["-std=c99", "-fno-common", "-c", str(probe), "-o", str(target)]
    _compile(["arm-none-eabi-gcc", *CORTEX_M4, *more])
    return sum(_sizes("arm-none-eabi-size", target)[1:])


def _compile(words: Sequence[str]) -> str:
    """Run a compiler or another tool of its kind; what it writes."""
    done = _limited(words, COMPILING, words[0])
    if done.status != 0:
        raise InputError(f"export: {words[0]} refuses the generated C: {_told(done)}")
    return done.output.decode("utf-8", errors="replace")


def _sizes(tool: str, target: Path) -> list[int]:
    """Bytes of code and constants, of data, and of zeroed data in an object file."""
    return [int(word) for word in _compile([tool, str(target)]).splitlines()[1].split()[:3]]


def _limited(words: Sequence[str], limits: ProgramLimits, name: str, data: bytes = b"") -> Finished:
    try:
        return run_limited(words, limits, data)
    except LimitExceededError as error:
        raise InputError(
            f"export: {name} {error}, which no model needs; is the model whole? Train it again"
        ) from None


def _told(done: Finished) -> str:
    return terminal_text(done.errors.strip()[:500])


_SECTIONS = ("-ffunction-sections", "-Wl,--gc-sections")
_EMULATION = ("-cpu", "cortex-a15", "-singlestep", "-d", "exec,nochain")
# That knows all that a Cortex-M4's code is made of, and programs of Linux besides.


def instructions_per_sample(source: CSource, folder: Path) -> int | None:
    """Instructions of a Cortex-M4 for one sample, windows full.

    None without its compiler or qemu-arm, or for half a million and more. A Cortex-M4 takes one cycle for
    most, two and more for loads, branches and divisions.
    """
    compiler, emulator = shutil.which("arm-none-eabi-gcc"), shutil.which("qemu-arm")
    if compiler is None or emulator is None:
        return None
    write_files({**source.files, "probe.c": source.probe}, folder)
    program = folder / "probe.elf"
    flags = [flag for flag in FLAGS if flag not in ("-O2", "-Wpedantic", "-Werror")]
    trace = folder / "trace"
    alone = ("-O2", "-DFOGML_NO_SELF_TEST", "-ffreestanding", "-nostdlib", *_SECTIONS)
    compiling = [*CORTEX_M4, *flags, *alone, str(folder / "probe.c"), "-lgcc", "-o", str(program)]
    counting = [*_EMULATION, "-D", str(trace), str(program)]
    if not (_done([compiler, *compiling]) and _done([emulator, *counting])):
        return None
    with trace.open(encoding="ascii", errors="replace") as lines:
        behind = dropwhile(lambda line: not re.search(r"\bcount_begin$", line.rstrip()), lines)
        within = takewhile(lambda line: not line.rstrip().endswith("count_end"), behind)
        count = sum(1 for _ in within) - 1  # less the line that begins
    return round(count / COUNTED) if count > 0 else None


def _done(words: Sequence[str]) -> bool:
    """Whether a program that is not essential ends well, within its limits."""
    try:
        return run_limited(words, COMPILING).status == 0
    except LimitExceededError:
        return False
