"""Generated C taken by C++, CMake and Rust, and by the rules of MISRA C:2012 save those listed."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from experiments.firmware.cortex_m4.__main__ import reports
from fogml.export.c_axes import export_axes
from fogml.export.c_program import write_files
from fogml.export.c_source import c_source
from fogml.export.export import export_model
from fogml.export.plan import Plan
from fogml.export.settings import ExportSettings
from fogml.export.tables import TableSettings, export_tables

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
DEVIATIONS = Path(__file__).parents[2] / "docs" / "firmware-code.md"
CPP = """
#include "fogml_model.h"
int main()
{
    fogml_state state;
    float temperatures[FOGML_TEMPERATURES] = {20.0F};
    float compensated = 0.0F;
    fogml_init(&state);
    const int flag = fogml_step(&state, 0U, temperatures, 7.5F, &compensated);
    return flag == FOGML_WINDOW_NOT_FULL ? fogml_self_test() : 99;
}
"""
RUST = """
mod fogml_model;
use fogml_model::*;
fn main() {
    let mut state = State::new();
    let (mut last, mut flag) = state.step(0, &[20.0], 7.5);
    assert!(flag == WINDOW_NOT_FULL);
    for i in 1..200 {
        (last, flag) = state.step(2_000_000 * i, &[20.0], 7.5);
    }
    assert!(flag == GOOD && last.is_finite() && last != 7.5 && self_test());
    let mut kept = *state.save().bytes();
    // The clock begins anew: off for two seconds, it goes on as if it had not been.
    let mut again = State::restore(&Saved::from_bytes(&kept), 9_000_000, 2_000_000).unwrap();
    assert!(again.step(9_000_000, &[20.5], 7.5) == state.step(400_000_000, &[20.5], 7.5));
    kept[SAVED_BYTES / 2] ^= 1;
    assert!(State::restore(&Saved::from_bytes(&kept), 0, 0).is_none());
}
"""
CMAKE = """
cmake_minimum_required(VERSION 3.13)
project(unit LANGUAGES C CXX)
add_subdirectory(model)
add_executable(unit main.cpp)
target_link_libraries(unit fogml_model)
"""


def needs(*tools: str) -> None:
    for tool in tools:
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")


def run(*words: object, folder: Path) -> None:
    done = subprocess.run(list(map(str, words)), cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def exported(model_of, tmp_path_factory):
    folder = tmp_path_factory.mktemp("exported")
    export_model(model_of("polynomial"), folder, ExportSettings("c", "float32"))
    return folder


def test_cplusplus_calls_it_through_cmake(exported, tmp_path):
    needs("cmake", "g++")
    shutil.copytree(exported, tmp_path / "model")
    (tmp_path / "main.cpp").write_text(CPP)
    (tmp_path / "CMakeLists.txt").write_text(CMAKE)
    strict = "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Wconversion -Werror"
    run("cmake", "-S", ".", "-B", "build", strict, folder=tmp_path)
    run("cmake", "--build", "build", folder=tmp_path)
    run(tmp_path / "build" / "unit", folder=tmp_path)


@pytest.mark.parametrize("clock", [[], ["-DFOGML_CLOCK_32"]])
def test_rust_calls_it_by_either_clock_but_not_by_the_wrong_one(exported, tmp_path, clock):
    needs("rustc")
    shutil.copytree(exported, tmp_path, dirs_exist_ok=True)
    (tmp_path / "main.rs").write_text(RUST)
    run("gcc", "-std=c99", *clock, "-c", "fogml_model.c", "-o", "fogml_model.o", folder=tmp_path)
    bare = ["rustc", "-D", "warnings", "-C", "link-arg=fogml_model.o", "main.rs", "-o", "unit"]
    narrow = [*bare, "--cfg", "fogml_clock_32"]
    right, wrong = (narrow, bare) if clock else (bare, narrow)
    done = subprocess.run(wrong, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode != 0 and "fogml_step" in done.stderr
    run(*right, folder=tmp_path)
    run(tmp_path / "unit", folder=tmp_path)


def test_a_bare_cortex_m4_gives_the_same_bits(exported):
    needs("arm-none-eabi-gcc", "qemu-system-arm")
    told = reports(exported, 2000)
    assert told["Cortex-M4"] == told["this machine"]
    assert told["Cortex-M4"].splitlines()[0] == "samples 2000"


def test_a_folder_is_a_library_of_arduino(exported, model_of, tmp_path):
    export_tables([model_of("polynomial")], tmp_path, TableSettings("segments"))
    for folder, name in ((exported, "fogml_model"), (tmp_path, "fogml_segments")):
        lines = (folder / "library.properties").read_text(encoding="ascii").splitlines()
        held = dict(line.split("=", 1) for line in lines)
        assert held["name"] == name and held["includes"] == f"{name}.h"
        assert {"version", "author", "maintainer", "sentence", "category", "architectures"} < held.keys()
        assert (folder / f"{name}.c").is_file() and not (folder / "src").exists()


def hold_misra(folder: Path) -> None:
    """Hold that the C files of a folder depart from no rule but those listed."""
    words = ["cppcheck", "--addon=misra", "--std=c99", "--platform=arm32-wchar_t4", "-q", "--template={id}"]
    words.append("--max-configs=1")  # as it is compiled: all but C++ and narrower clocks
    done = subprocess.run([*words, "."], cwd=folder, capture_output=True, text=True, check=True)
    found = set(re.findall(r"misra-c2012-([0-9.]+)", done.stderr))
    assert "8.9" in found, "cppcheck told nothing"
    assert found <= set(re.findall(r"^\| ([0-9]+\.[0-9]+) ", DEVIATIONS.read_text(), flags=re.MULTILINE))


@pytest.mark.parametrize(
    ("name", "dtype", "sample_s"),
    [
        ("memory", "float32", 0.1),
        ("memory", "q31", None),
        ("rich", "q15", None),
        ("rich", "float32", 0.1),
    ],
)
def test_misra_rules_hold_save_those_listed(model_of, tmp_path, name, dtype, sample_s):
    needs("cppcheck")
    write_files(c_source(Plan.of(model_of(name), sample_s), dtype, []).files, tmp_path)
    hold_misra(tmp_path)


def test_misra_rules_hold_of_all_axes_and_of_tables(axes, tmp_path, monkeypatch):
    needs("cppcheck")
    # Sizes and cycles on another machine say nothing of rules.
    monkeypatch.setattr("fogml.export.export.cortex_m4_size", lambda *_: None)
    models = [model for model, _ in axes.values()]
    export_axes(models, tmp_path, ExportSettings())
    hold_misra(tmp_path)
    (tmp_path / "table").mkdir()
    export_tables(models, tmp_path / "table", TableSettings("segments"))
    hold_misra(tmp_path / "table")
