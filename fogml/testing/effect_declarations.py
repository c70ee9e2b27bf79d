"""What an effect declares of itself, as a check: texts, needs, quantities and their priors."""

from __future__ import annotations

import math
import re

import numpy as np

from fogml.errors import InputError
from fogml.twin import registry
from fogml.twin.effect import SET_UP, STAGES, Effect
from fogml.twin.inputs import REST, STAND_INS
from fogml.twin.quantities import GRADES
from fogml.twin.scenes import scene_names

_WORD = re.compile(r"[a-z]{2,}(_[a-z]{2,})*\Z")


def check_declaration(effect: Effect) -> None:
    """Names, texts and needs are stated and whole."""
    name = type(effect).__name__
    for attribute in ("id", "code", "title", "stage", "amplitude"):
        assert hasattr(effect, attribute), f"{name} does not state '{attribute}'"
    assert name == registry.class_name(effect.id), (
        f"the class of '{effect.id}' is to be called {registry.class_name(effect.id)}, not {name}"
    )
    assert effect.title.strip() and effect.code.strip(), f"{name}: title or letter code is empty"
    assert effect.stage in STAGES, f"{name}: stage '{effect.stage}' is none of {', '.join(STAGES)}"
    text = type(effect).__doc__ or ""
    assert "=" in text and "::" in text, f"{name}: the docstring states no equation after '::'"
    assert re.search(r"\bSources?:", text), f"{name}: the docstring has no line 'Source:'"
    assert effect.sources and all(source.strip() for source in effect.sources), f"{name} states no sources"
    assert effect.shows.strip(), f"{name} does not say where it shows"
    assert effect.shown_on in scene_names(), f"{name} is shown on '{effect.shown_on}', which is no scene"
    for other, what in effect.confused_with.items():
        assert other != effect.id and what.strip(), f"{name}: confused_with '{other}' says nothing"
    known = {*STAND_INS, *REST, *SET_UP}
    assert set(effect.needs) <= known, f"{name} needs {sorted(set(effect.needs) - known)}, which no input has"
    assert len(set(effect.needs)) == len(effect.needs), f"{name}: needs repeat"
    assert effect.id not in effect.conflicts, f"{name} conflicts with itself"
    assert effect.amplitude.name == "amplitude", f"{name}: the amplitude's key is 'amplitude'"
    names = [quantity.name for quantity in effect.shape]
    assert len(set(names)) == len(names) and "amplitude" not in names, f"{name}: shape names repeat: {names}"
    for quantity in names:
        assert _WORD.match(quantity), f"{name}: shape parameter '{quantity}' must be whole lower-case words"


def check_priors(effect: Effect) -> None:
    """Units, ranges, limits and the draws from the priors fit together."""
    rng = np.random.default_rng(0)
    for quantity in (effect.amplitude, *effect.shape):
        owner = f"{effect.id}: {quantity.name}"
        assert quantity.unit.strip(), f"{owner} has no unit; a pure number has unit '1'"
        low, high = quantity.limits
        assert low < high, f"{owner}: limits {quantity.limits} hold nothing"
        for grade in GRADES:
            least, most = quantity.range(grade)
            assert math.isfinite(least) and math.isfinite(most) and least <= most, (
                f"{owner}: {grade} range {least:g} to {most:g}"
            )
            assert low <= least and most <= high, f"{owner}: the {grade} range passes the limits"
            assert not quantity.signed or least >= 0.0, f"{owner}: a signed quantity's range is of its size"
            assert not quantity.signed or low == -high, f"{owner}: limits of a signed quantity are lopsided"
            assert quantity.check(quantity.typical(grade), owner) == quantity.typical(grade)
            drawn = np.array([quantity.draw(rng, grade) for _ in range(400)])
            assert np.isfinite(drawn).all() and drawn.min() >= low and drawn.max() <= high, (
                f"{owner}: its prior leaves the limits"
            )
            size = np.abs(drawn) if quantity.signed else drawn
            slack = 1e-9 * max(abs(least), abs(most))
            inside = np.mean((size >= least - slack) & (size <= most + slack))
            assert inside >= 0.8, f"{owner}: only {inside:.0%} of its {grade} prior lie in the range"
    most_n, most_t = effect.amplitude.navigation[1], effect.amplitude.tactical[1]
    assert most_n <= most_t, f"{effect.id}: a navigation gyro is to have no more of it than a tactical one"


def check_values(effect: Effect) -> None:
    """Values as a twin file gives them: defaults are filled in, faults are named."""
    stated = {"amplitude": effect.amplitude.typical(), **effect.default_shape()}
    amplitude, shape = effect.checked({"amplitude": stated["amplitude"]})
    assert amplitude == stated["amplitude"] and shape == effect.default_shape(), (
        "values that are not stated do not take their defaults"
    )
    for values in ({**stated, "nonsense": 1.0}, {**stated, "amplitude": math.nan}, effect.default_shape()):
        try:
            effect.checked(values)
        except InputError as error:
            assert effect.id in str(error), f"the message does not name the effect: {error}"
        else:
            raise AssertionError(f"{effect.id} accepts {values}")
