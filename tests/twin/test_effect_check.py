"""`check_effect` must find each breach of the contract."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.testing import check_effect
from fogml.twin.effect import (
    BiasEffect,
    LoggerEffect,
    LoopEffect,
    NoiseEffect,
    RigEffect,
    ScaleFactorEffect,
    SensorEffect,
)
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.registry import effects

AMPLITUDE = Quantity("amplitude", "deg/h", (0.1, 1.0), (0.01, 0.1), "A", signed=True)
TAU = Quantity("time_constant", "s", (60.0, 600.0), (60.0, 600.0), "tau", (1.0, 1e5))
DECLARED = {
    "id": "sample",
    "code": "Z1",
    "title": "A sample",
    "amplitude": AMPLITUDE,
    "shape": (TAU,),
    "needs": ("T",),
    "sources": ("Made up",),
    "shows": "nowhere",
    "__doc__": "A sample.\n\n::\n\n    b = A lag(T)\n\nSource: made up.\n",
}


def good(self: BiasEffect, inputs: Inputs, **shape: float) -> FloatArray:
    return inputs.memory.lag(self.id, inputs.time, inputs.u("T"), shape["time_constant"])


def make(base: type = BiasEffect, name: str = "Sample", **changes: object) -> type:
    """The good effect with changes."""
    return type(name, (base,), {**DECLARED, "signature": good, **changes})


def at(rule):  # type: ignore[no-untyped-def]
    """A signature that adds something wrong to the good one."""

    def signature(self, inputs, **shape):  # type: ignore[no-untyped-def]
        return good(self, inputs, **shape) + rule(inputs, shape)

    return signature


def inplace(self, inputs, **shape):  # type: ignore[no-untyped-def]
    values = inputs.temperature("T")
    values += 1.0
    return good(self, inputs, **shape)


def test_the_good_one_passes_and_leaves_the_catalogue_as_it_was() -> None:
    before = list(effects())
    check_effect(make())
    check_effect(make()())
    assert list(effects()) == before


def quantity(**changes: object) -> Quantity:
    held = {
        "name": "time_constant",
        "unit": "s",
        "tactical": (60.0, 600.0),
        "navigation": (60.0, 600.0),
        "limits": (1.0, 1e5),
    }
    return Quantity(**{**held, **changes})  # type: ignore[arg-type]


DECLARATIONS = {
    "no equation": ({"__doc__": "A sample.\n\nSource: made up."}, "states no equation"),
    "no docstring": ({"__doc__": None}, "states no equation"),
    "no source in text": ({"__doc__": "A.\n\n::\n\n    b = A T\n"}, "no line 'Source:'"),
    "no sources": ({"sources": ()}, "states no sources"),
    "shows nothing": ({"shows": " "}, "where it shows"),
    "unknown scene": ({"shown_on": "the moon"}, "which is no scene"),
    "own relative": ({"confused_with": {"sample": "itself"}}, "confused_with 'sample'"),
    "unknown look-alike": ({"confused_with": {"no_such": "x"}}, "'no_such', which is no effect"),
    "unknown conflict": ({"conflicts": ("no_such",)}, "'no_such', which is no effect"),
    "unknown family": ({"family": "no_such"}, "family 'no_such' is none of signature"),
    "amplitude no quantity": ({"amplitude": 3.0}, "3.0 is no Quantity"),
    "own conflict": ({"conflicts": ("sample",)}, "conflicts with itself"),
    "unknown need": ({"needs": ("T", "moon")}, "moon"),
    "amplitude's key": ({"amplitude": quantity(name="size")}, "key is 'amplitude'"),
    "abbreviated shape": ({"shape": (quantity(name="tau_1"),)}, "whole lower-case words"),
    "unit": ({"shape": (quantity(unit=""),)}, "has no unit"),
    "limits": ({"shape": (quantity(limits=(5.0, 5.0)),)}, "hold nothing"),
    "range": ({"shape": (quantity(tactical=(600.0, 60.0)),)}, "tactical range 600 to 60"),
    "range outside limits": ({"shape": (quantity(limits=(100.0, 1e5)),)}, "passes the limits"),
    "signed range": (
        {"shape": (quantity(signed=True, tactical=(-1.0, 1.0), limits=(-9e3, 9e3)),)},
        "its size",
    ),
    "lopsided": ({"shape": (quantity(signed=True),)}, "lopsided"),
    "grades": (
        {"amplitude": quantity(name="amplitude", navigation=(1e3, 2e3))},
        "navigation gyro is to have",
    ),
}


@pytest.mark.parametrize("case", DECLARATIONS)
def test_faulty_declarations_are_found(case: str) -> None:
    changes, message = DECLARATIONS[case]
    with pytest.raises(AssertionError, match=message):
        check_effect(make(**changes))  # type: ignore[arg-type]


# Where `check_effect` takes the slope: 13 % of the range beyond the default.
KINK = TAU.typical() + 0.13 * (600.0 - 60.0)
SIGNATURES = {
    "not finite with one sensor": (
        at(lambda i, s: 0.0 if "T_case" in i.temperatures else np.full(len(i), np.nan)),
        "not finite everywhere on 'only T'",
    ),
    "raises where a sensor is not there": (
        lambda self, i, **s: 1.0 * i.temperatures["T_case"],
        r"sample: KeyError \('T_case'\) on \d+ rows with T$",
    ),
    "raises without rows": (
        lambda self, i, **s: i.temperature("T") - i.temperature("T")[0],
        "sample: IndexError .* on 0 rows",
    ),
    "wrong shape": (lambda self, i, **s: np.zeros(3), "has shape"),
    "integers": (lambda self, i, **s: np.zeros(len(i), dtype=int), "no float64 array"),
    "changes its inputs": (inplace, "second call|changed T"),
    "random": (at(lambda i, s: np.random.default_rng().standard_normal(len(i))), "second call"),
    "later samples": (at(lambda i, s: i.u("T").mean() if len(i) else 0.0), "later samples exist"),
    "undeclared temperature": (at(lambda i, s: 1e-3 * i.u("T_case")), "inputs outside"),
    "undeclared drive": (at(lambda i, s: i.drive("supply")), "inputs outside"),
    "undeclared rate": (at(lambda i, s: i.table_rate), "inputs outside"),
    "undeclared Earth rate": (at(lambda i, s: i.earth_deg_h), "inputs outside"),
    "undeclared power-on": (at(lambda i, s: np.exp(-i.time_on_s)), "inputs outside"),
    "undeclared facts": (at(lambda i, s: float(i.facts.axis == "x")), "inputs outside"),
    "counts samples": (at(lambda i, s: i.memory.total("n", np.full(len(i), 1e-3))), "leaves a trace"),
    "forgets at borders": (at(lambda i, s: np.arange(len(i)) == 0), "block by block"),
    "kink in the shape": (at(lambda i, s: np.sign(s["time_constant"] - KINK)), "half the step"),
}


@pytest.mark.parametrize("case", SIGNATURES)
def test_faulty_signatures_are_found(case: str) -> None:
    signature, message = SIGNATURES[case]
    with pytest.raises(AssertionError, match=message):
        check_effect(make(signature=signature))


def test_dead_needs_and_parameters_are_found() -> None:
    with pytest.raises(AssertionError, match="needs 'T_case', which makes no difference"):
        check_effect(make(needs=("T", "T_case")))
    dead = quantity(name="dead_weight")
    with pytest.raises(AssertionError, match="dead_weight makes no difference"):
        check_effect(make(shape=(TAU, dead)))


def test_faulty_responses_and_hooks_are_found() -> None:
    ppm = Quantity("amplitude", "ppm", (1.0, 9.0), (0.1, 1.0), "c", signed=True)
    with pytest.raises(AssertionError, match="input rate times the ppm"):
        check_effect(make(ScaleFactorEffect, amplitude=ppm, response=good))
    loop = {"needs": ("output",), "shape": (), "signature": lambda self, i, **s: np.tanh(i.output / 10.0)}
    check_effect(make(LoopEffect, **loop))
    with pytest.raises(AssertionError, match="amplitude 0 changes something"):
        check_effect(make(LoopEffect, **loop, apply=lambda self, o, i, a, **s: o + 1e-6))
    with pytest.raises(AssertionError, match="not the amplitude times the signature"):
        check_effect(make(LoopEffect, **loop, apply=lambda self, o, i, a, **s: o - a * np.tanh(o / 10.0)))
    with pytest.raises(AssertionError, match="sense with amplitude 0"):
        check_effect(make(SensorEffect, sense=lambda self, n, t, i, a, **s: t + 0.1))
    with pytest.raises(AssertionError, match="record gives a wrong shape"):
        check_effect(make(LoggerEffect, record=lambda self, o, i, a, **s: o if a == 0.0 else o[1:]))
    check_effect(make(RigEffect, added_rate=lambda self, b, i, a, **s: np.sin(a) * b))
    with pytest.raises(AssertionError, match="slope of added_rate"):
        check_effect(make(RigEffect, added_rate=lambda self, b, i, a, **s: 1.01 * a * b))
    noise = {"signature": NoiseEffect.signature, "shape": (), "needs": ()}
    with pytest.raises(AssertionError, match="same seed"):
        drawn = lambda self, r, n, dt, a, **s: a * np.random.default_rng().standard_normal(n)  # noqa: E731
        check_effect(make(NoiseEffect, **noise, draw=drawn))
    steady = {**noise, "draw": lambda self, r, n, dt, a, **s: a * r.standard_normal(n)}
    check_effect(make(NoiseEffect, **steady))
    with pytest.raises(AssertionError, match="inputs outside"):
        check_effect(make(NoiseEffect, **steady, strength=lambda self, i, **s: 1.0 + np.square(i.u("T"))))
