"""The catalogue's index: built-in effects, those of outside packages, and any registered by hand.

A module of ``fogml.twin.effects`` holds the effects of one subject, each a class whose name is its id, in
CamelCase; they are found by being there. Another package adds its effects by the entry point group
``fogml.effects``, each naming a class or an object.
"""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Iterable, Iterator
from importlib import import_module
from importlib.metadata import entry_points
from inspect import isabstract
from numbers import Real
from typing import Any, TypeVar

from fogml.entry_points import EFFECTS as GROUP
from fogml.entry_points import loaded, origin
from fogml.errors import InputError, did_you_mean
from fogml.twin.effect import STAGES, Effect
from fogml.twin.effect_guard import guard, unguard
from fogml.twin.quantities import Quantity

_ID = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*\Z")
_CODE = re.compile(r"([A-Za-z]*)(\d*)")
_Declared = TypeVar("_Declared", bound="type[Effect] | Effect")

_catalogue: dict[str, Effect] = {}
_discovered = False


def effects() -> dict[str, Effect]:
    """Every effect by its id, in the order of the catalogue's letter codes.

    Raises
    ------
    InputError
        If a package's effect cannot be loaded or its id is taken.
    """
    _discover()
    return {declared.id: declared for declared in sorted(_catalogue.values(), key=catalogue_order)}


def catalogue_order(declared: Effect) -> tuple[str, int, str]:
    """What sorts effects by the catalogue's letter codes."""
    match = _CODE.match(declared.code)
    letters, digits = match.groups() if match else ("", "")
    return letters, int(digits or 0), declared.id


def effect(id: str) -> Effect:
    """The effect of an id.

    Raises
    ------
    InputError
        If there is none; the message names ids that look alike.
    """
    _discover()
    if id not in _catalogue:
        hint = did_you_mean(id, _catalogue, most=3)
        raise InputError(f"there is no effect '{id}'; {hint}`fogml effects` lists them")
    return _catalogue[id]


def clashing(declared: Effect, others: Iterable[str]) -> list[str]:
    """Ids among others of effects that can't be on together with one, whichever of the two says so."""
    return [id for id in others if id in declared.conflicts or declared.id in effect(id).conflicts]


def register(declared: _Declared) -> _Declared:
    """Add an effect, given as its class or an object of it; it can decorate a class.

    Raises
    ------
    InputError
        If the declaration is incomplete or its id is taken.
    """
    _discover()
    _add(declared, "register")
    return declared


def unregister(id: str) -> Effect:
    """Take an effect out of the catalogue and return it.

    Raises
    ------
    InputError
        If there is none of this id.
    """
    found = effect(id)
    del _catalogue[id]
    return unguard(found)


def _discover() -> None:
    global _discovered
    if _discovered:
        return
    found = dict(_catalogue)
    try:
        for declared in _built_in():
            _add(declared, declared.__module__)
        for point in entry_points(group=GROUP):
            _add(loaded(point), origin(point))
    except InputError:
        _catalogue.clear()
        _catalogue.update(found)
        raise
    _discovered = True


def _built_in() -> Iterator[type[Effect]]:
    """The classes of effects in the modules of the catalogue."""
    package = import_module("fogml.twin.effects")
    for found in pkgutil.iter_modules(package.__path__):
        module = import_module(f"{package.__name__}.{found.name}")
        for declared in vars(module).values():
            own = isinstance(declared, type) and declared.__module__ == module.__name__
            if own and issubclass(declared, Effect):
                yield declared


def _add(declared: Any, origin: str) -> None:
    if isinstance(declared, type) and issubclass(declared, Effect):
        if isabstract(declared):
            missing = ", ".join(sorted(declared.__abstractmethods__))
            raise InputError(f"{origin}: class {declared.__name__} does not define {missing}")
        declared = declared()
    if not isinstance(declared, Effect):
        raise InputError(f"{origin}: {declared!r} is no effect; a class derived from Effect is needed")
    for name in ("code", "title", "stage", "amplitude"):
        if not hasattr(declared, name):
            raise InputError(f"{origin}: class {type(declared).__name__} does not state '{name}'")
    if not _ID.match(declared.id):
        raise InputError(f"{origin}: id '{declared.id}' must be lower-case words joined by '_'")
    if declared.stage not in STAGES:
        raise InputError(
            f"{origin}: effect '{declared.id}' is in stage '{declared.stage}'; stages are {', '.join(STAGES)}"
        )
    if not isinstance(declared.amplitude, Quantity):
        raise InputError(f"{origin}: the amplitude of effect '{declared.id}' must be a Quantity")
    _check_lists(declared, f"{origin}: effect '{declared.id}'")
    if declared.id in _catalogue:
        raise InputError(f"{origin}: there is an effect '{declared.id}' already; unregister it first")
    guard(declared)
    _catalogue[declared.id] = declared


def _check_lists(declared: Effect, owner: str) -> None:
    """Refuse what should be a tuple of something and is not: a text is a tuple of letters."""

    def is_of(given: Any, kind: type) -> bool:
        return isinstance(given, tuple | list) and all(isinstance(one, kind) for one in given)

    for name in ("needs", "conflicts", "sources", "compensated_by"):
        if not is_of(getattr(declared, name), str):
            raise InputError(f"{owner}: '{name}' is a tuple of texts, such as ('T',)")
    if not is_of(declared.shape, Quantity):
        raise InputError(f"{owner}: 'shape' is a tuple of Quantity")
    groups = declared.told_by
    if not (is_of(groups, tuple) and all(is_of(group, str) for group in groups)):
        raise InputError(f"{owner}: 'told_by' is a tuple of groups of columns, such as (('supply',),)")
    if not (is_of(declared.amplitudes, Real) and all(a != 0.0 for a in declared.amplitudes)):
        raise InputError(f"{owner}: 'amplitudes' is a tuple of numbers other than 0")
