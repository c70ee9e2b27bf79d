"""Methods that answer blind cases, by name: the diagnosis and the baselines."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from fogml.blind.folders import DIAGNOSIS, CaseFiles
from fogml.errors import InputError
from fogml.json_files import write_json

Method = Callable[..., Any]
"""Reads a case's runs, given as `CaseFiles`, and writes ``gap.json`` into a folder; options by name."""

_PACKAGE = "fogml.blind"
ABSTAIN = "abstain"
"""The baseline that names nothing."""
METHODS = {
    DIAGNOSIS: f"{_PACKAGE}.methods:diagnosis",
    "bic": f"{_PACKAGE}.baselines.forward:bic",
    "bic-unwhitened": f"{_PACKAGE}.baselines.forward:bic_unwhitened",
    "bic-fixed-nominal": f"{_PACKAGE}.baselines.forward:bic_fixed_nominal",
    "stlsq": f"{_PACKAGE}.baselines.sparse:stlsq",
    "random-forest": f"{_PACKAGE}.baselines.forest:random_forest",
    "gp-discrepancy": f"{_PACKAGE}.baselines.process:gp_discrepancy",
    ABSTAIN: f"{_PACKAGE}.baselines.abstain:abstain",
}
"""Name of each method to ``module:function``; all of them run sealed."""
ORACLE = "oracle"
"""The baseline that is given the truth, and so can't run sealed."""
BASELINES = (*(name for name in METHODS if name != DIAGNOSIS), ORACLE)


def load_method(text: str) -> Method:
    """The method of a name of `METHODS`, or of ``package.module:function``.

    Raises
    ------
    InputError
        If there is none.
    """
    module, colon, name = METHODS.get(text, text).partition(":")
    if not colon:
        if text == "families":
            raise InputError(f"no method 'families': it is what '{DIAGNOSIS}' does")
        known = ", ".join(METHODS)
        raise InputError(f"no method '{text}'; known are {known}, or name one as module:function")
    try:
        method: Method = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise InputError(f"method '{text}' does not load: {error}") from None
    return method


def diagnosis(case: CaseFiles, out: Path, *, cost_of_false_name: float = 1.0) -> Any:
    """The diagnosis itself, as ``fogml diagnose`` runs it; returns it, for whoever draws its page."""
    from fogml.gap.diagnosis import diagnose
    from fogml.gap.twin_model import TwinModel
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
