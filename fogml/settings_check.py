"""Numbers that decide a result, checked where they are set: a dataclass of settings refuses what can't be."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import fields
from numbers import Integral, Real
from typing import Any

from fogml.errors import InputError


def check_numbers(
    settings: Any,
    *,
    signed: Collection[str] = (),
    may_be_0: Collection[str] = (),
    shares: Collection[str] = (),
    chances: Collection[str] = (),
    above_1: Collection[str] = (),
) -> None:
    """Check the numbers of a dataclass, those in its tuples too; others are left alone.

    Each is finite and above 0, and whole where its standard one is. A tuple has as many numbers as it says,
    or one at least.

    Parameters
    ----------
    settings
        The dataclass; fields without a standard value are left alone.
    signed, may_be_0
        Fields that may be any number, and 0 as well.
    shares, chances
        Fields above 0 and at most 1, and between 0 and 1.
    above_1
        Fields above 1: factors, and counts of which one alone would not do.

    Raises
    ------
    InputError
        Naming the class, the field, what it is and what is expected.
    """
    for entry in fields(settings):
        standard: Any = entry.default
        given: Any = getattr(settings, entry.name)
        several = isinstance(standard, tuple)
        like = standard[0] if several and standard else standard
        if isinstance(like, bool) or not isinstance(like, Real):
            continue
        low, high, words = 0.0, math.inf, "above 0"
        if entry.name in signed:
            low, words = -math.inf, "of any sign"
        elif entry.name in may_be_0:
            low, words = -math.ulp(0.0), "of 0 or more"
        elif entry.name in shares:
            high, words = math.nextafter(1.0, 2.0), "above 0 and at most 1"
        elif entry.name in chances:
            high, words = 1.0, "between 0 and 1"
        elif entry.name in above_1:
            low, words = 1.0, "above 1"
        whole = "whole " if isinstance(like, int) else ""
        values, count = (given, None) if several else ((given,), 1)
        if several and not str(entry.type).endswith("...]"):
            count = len(standard)
        if not (
            isinstance(values, tuple)
            and (values if count is None else len(values) == count)
            and all(_number(value) and low < value < high and not (whole and value % 1) for value in values)
        ):
            asked = (
                f"{count or 'some'} {whole}numbers {words} are" if several else f"a {whole}number {words} is"
            )
            raise InputError(f"{type(settings).__name__}: '{entry.name}' is {given!r}; {asked} needed")


def check_whole(name: str, value: object, least: int = 0, most: int | None = None) -> None:
    """Refuse what is no whole number within bounds, as of a seed or a count; NumPy's integers are some.

    Raises
    ------
    InputError
        Naming it, what it is and what is needed.
    """
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not whole or value < least or (most is not None and value > most):  # type: ignore[operator]
        wanted = f"of {least} or above" if most is None else f"from {least} to {most}"
        raise InputError(f"'{name}' is {value!r}; a whole number {wanted} is needed")


GREATEST_SEED = (1 << 32) - 1
"""Of models and commands: scikit-learn's generators take no greater one."""


def _number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def check_rising(settings: Any, name: str) -> None:
    """Refuse a pair that does not go up: from where to where something is looked for."""
    low, high = getattr(settings, name)
    if not low < high:
        raise InputError(
            f"{type(settings).__name__}: '{name}' is from {low:g} to {high:g}; the first is the lower one"
        )
