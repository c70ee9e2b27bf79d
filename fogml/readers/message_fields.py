"""The numbers of a robot's message: their paths, and what gives the values of some of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from operator import attrgetter, itemgetter
from typing import Any

import numpy as np

ToFloats = Callable[[Any], Sequence[float]]
_NUMBER = (bool, int, float, np.number)
_DEEPEST = 5
"""Levels of a message; those that ROS 2 ships have three, results of ROS 1 actions six."""
_LONGEST_ARRAY = 16
"""Numbers of an array that are columns: vectors, and matrices up to 3 by 4; scans and images are longer."""
_STAMPS = {("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec")}


def leaves(message: Any, above: str = "", depth: int = 0) -> Iterator[tuple[str, Any, ToFloats]]:
    """What holds the numbers of a message: path, value, and what makes numbers of it.

    It is a number, a short array of numbers, or a stamp.
    """
    if isinstance(message, _NUMBER):
        yield above, message, _one
    elif isinstance(message, list | tuple | np.ndarray):
        if len(message) <= _LONGEST_ARRAY:
            if all(isinstance(item, _NUMBER) for item in message):
                yield above, message, list
            else:
                for i, item in enumerate(message):
                    yield from leaves(item, f"{above}.{i}", depth + 1)
    elif not isinstance(message, str | bytes | None.__class__):
        fields = message if isinstance(message, dict) else _fields(message)
        if tuple(fields) in _STAMPS:
            yield above, message, _stamp_of(fields, isinstance(message, dict))
        elif depth < _DEEPEST:
            for name, item in fields.items():
                yield from leaves(item, f"{above}.{name}" if above else str(name), depth + 1)


def _fields(message: Any) -> dict[str, Any]:
    known: Any = getattr(message, "__dataclass_fields__", None)
    names = tuple(known or getattr(message, "__slots__", ()))
    return {name: getattr(message, name) for name in names if not name.startswith("__")}


def _one(value: Any) -> tuple[float]:
    return (float(value),)


def _stamp_of(fields: dict[str, Any], is_dict: bool) -> ToFloats:
    """What gives the seconds of a stamp."""
    got = (itemgetter if is_dict else attrgetter)(*fields)

    def seconds(stamp: Any) -> tuple[float]:
        whole, parts = got(stamp)
        return (float(whole) + 1e-9 * float(parts),)

    return seconds


def numbers(message: Any) -> Iterator[tuple[str, float]]:
    """The numbers of a message by their paths, those of short arrays by place; stamps as seconds."""
    for path, value, to_floats in leaves(message):
        found = to_floats(value)
        if to_floats is list:
            yield from ((f"{path}.{i}", float(each)) for i, each in enumerate(found))
        else:
            yield path, found[0]


def stamps_in(message: Any) -> frozenset[str]:
    """Paths of the times that a message holds as seconds and their parts."""
    return frozenset(path for path, _, to_floats in leaves(message) if to_floats not in (_one, list))


def values_of(first: Any, names: Sequence[str]) -> Callable[[Any], Sequence[float]]:
    """What gives the numbers of these paths of a message, NaN where it has none.

    Messages of a topic are mostly of the shape of the first, whose attributes are got at once; what is of
    another, or no object, is searched through.
    """

    def search(message: Any) -> Sequence[float]:
        found = dict(numbers(message))
        return [found.get(name, math.nan) for name in names]

    held = [(path, to_floats, len(to_floats(value))) for path, value, to_floats in leaves(first)]
    paths = [path for path, _ in numbers(first)]
    is_listed = any(part.isdigit() for path, *_ in held for part in path.split("."))
    if isinstance(first, dict) or is_listed or list(names) != paths[: len(names)]:
        return search
    attributes = attrgetter(*(path for path, *_ in held))
    parts = [(to_floats, count) for _, to_floats, count in held]

    def get(message: Any) -> Sequence[float]:
        try:
            found: list[float] = []
            together = attributes(message) if len(parts) > 1 else (attributes(message),)
            for value, (to_floats, count) in zip(together, parts, strict=True):
                floats = to_floats(value)
                if len(floats) != count:
                    return search(message)
                found.extend(floats)
            return found[: len(names)]
        except (AttributeError, TypeError, ValueError):
            return search(message)

    return get
