"""Frozen dataclasses with read-only mappings, which pickle and copy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any


class FrozenMappings:
    """A frozen dataclass whose mappings are read-only: it is pickled and copied as what it is made of."""

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[type, Mapping[str, Any]]]:
        given = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        plain = {n: dict(v) if isinstance(v, MappingProxyType) else v for n, v in given.items()}
        return _made, (type(self), plain)


def _made(kind: type, given: Mapping[str, Any]) -> Any:
    return kind(**given)
