"""Methods that answer blind cases, by name: the diagnosis and the baselines; and the state of their code."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import fogml
from fogml.blind.folders import DIAGNOSIS, CaseFiles
from fogml.errors import InputError, known_are
from fogml.json_files import write_json

Method = Callable[..., Any]
"""Reads a case's runs, given as `CaseFiles`, and writes ``gap.json`` into a folder; options by name."""

_PACKAGE = "fogml.blind"
ABSTAIN = "abstain"
"""The baseline that names nothing."""
METHODS = {
    DIAGNOSIS: f"{_PACKAGE}.methods:diagnosis",
    "bic": f"{_PACKAGE}.baselines.regression:bic",
    "bic-unwhitened": f"{_PACKAGE}.baselines.regression:bic_unwhitened",
    "bic-fixed-nominal": f"{_PACKAGE}.baselines.regression:bic_fixed_nominal",
    "stlsq": f"{_PACKAGE}.baselines.learners:stlsq",
    "random-forest": f"{_PACKAGE}.baselines.learners:random_forest",
    "gp-discrepancy": f"{_PACKAGE}.baselines.learners:gp_discrepancy",
    ABSTAIN: f"{_PACKAGE}.baselines.learners:abstain",
}
"""Name of each method to ``module:function``; all of them run sealed."""
ORACLE = "oracle"
"""The baseline that is given the truth, and so can't run sealed."""
BASELINES = (*(name for name in METHODS if name != DIAGNOSIS), ORACLE)


def load_method(text: str) -> Method:
    """The method of a name of `METHODS`, or of ``package.module:function``."""
    module, colon, name = METHODS.get(text, text).partition(":")
    if not colon:
        if text == "families":
            raise InputError(f"no method 'families': it is what '{DIAGNOSIS}' does")
        raise InputError(f"no method '{text}'; {known_are(text, METHODS)}, or name one as module:function")
    try:
        method: Method = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise InputError(f"method '{text}' does not load: {error}") from None
    return method


def diagnosis(case: CaseFiles, out: Path, *, cost_of_false_name: float = 1.0) -> Any:
    """The diagnosis itself, as ``fogml diagnose`` runs it; returns it, for whoever draws its page."""
    from fogml.gap.diagnosis import diagnose
    from fogml.gap.model import TwinModel
    from fogml.runs.reading import read_run
    from fogml.twin.twin_file import load_twin

    model = TwinModel(load_twin(case.twin), case.without)
    found = diagnose(
        model,
        [read_run(path) for path in case.fit],
        [read_run(path) for path in case.held_out],
        noise=read_run(case.noise) if case.noise else None,
        without=case.without,
        seed=case.seed,
        plan=False,
        cost_of_false_name=cost_of_false_name,
    )
    write_json(out / "gap.json", found.as_dict(), indent=None)
    found.write_model(model, out / "twin.yaml")
    return found


_REALITIES = ("blind/frame", "blind/first", "blind/second", "blind/third")
APART = ("cli", "report", "blind/scoring", *_REALITIES)
"""Folders of the package that no answer depends on."""
_DIGITS = 16
_SUFFIXES = (".py", ".yaml")


def code_state(method: str, code: Path | None = None, package: Path | None = None) -> str:
    """The first digits of a hash over the paths and bytes of the sources.

    Parameters
    ----------
    method
        Name of a method, or ``module:function``.
    code
        Folder of the method's own code: the module or package that the method names there counts too.
    package
        The package ``fogml``; the one that runs unless told otherwise.
    """
    package = package or Path(fogml.__file__).parent
    found = hashlib.sha256()
    for name, path in (*_of_package(package), *_own(method, code)):
        content = path.read_bytes()
        found.update(f"{name}\0{len(content)}\0".encode())
        found.update(content)
    return found.hexdigest()[:_DIGITS]


def _of_package(package: Path) -> Iterator[tuple[str, Path]]:
    for name, path in _sources(package):
        if not any(name.startswith(f"{folder}/") for folder in APART):
            yield name, path


def _own(method: str, code: Path | None) -> Iterator[tuple[str, Path]]:
    """The sources of a method that lies in a folder of its own."""
    top = method.partition(":")[0].partition(".")[0]
    if code is None or ":" not in method:
        return
    if (code / f"{top}.py").is_file():
        yield f"{top}.py", code / f"{top}.py"
    for name, path in _sources(code / top):
        yield f"{top}/{name}", path


def _sources(folder: Path) -> list[tuple[str, Path]]:
    paths = (path for path in folder.rglob("*") if path.suffix in _SUFFIXES and path.is_file())
    return sorted((path.relative_to(folder).as_posix(), path) for path in paths)
