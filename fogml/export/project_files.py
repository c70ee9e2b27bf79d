"""Beside generated C: what CMake, Arduino and Rust take it by."""

from __future__ import annotations

from fogml import __version__
from fogml.escaping import CCode
from fogml.export.c_source import CSource, templates

RUST_FILE = "fogml_model.rs"
_RUST = {"double": "f64", "float": "f32", "int32_t": "i32", "int16_t": "i16"}


def project_files(name: str) -> dict[str, str]:
    """A folder with ``NAME.c`` and ``NAME.h`` as a target of CMake and a library of Arduino, by file name."""
    context = {"name": name, "version": __version__}
    return {
        file: templates().get_template(f"{file}.j2").render(context)
        for file in ("CMakeLists.txt", "library.properties")
    }


def rust_bindings(source: CSource, state_bytes: int) -> str:
    """A module of Rust that calls generated C through ``extern "C"``.

    Parameters
    ----------
    source
        The C.
    state_bytes
        Bytes of a state.
    """
    numbers = source.numbers
    return (
        templates()
        .get_template("model.rs.j2")
        .render(
            kind=source.plan.kind,
            version=__version__,
            places=max(1, len(source.plan.sensors)),
            state_bytes=state_bytes,
            saves=bool(source.plan.atoms),
            temperature=CCode(_RUST[numbers["temperature_type"]]),
            gyro=CCode(_RUST[numbers["gyro_type"]]),
        )
    )
