"""Content of files that were written by the toolkit: exactly the stated keys, and types as they stand."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from fogml.errors import InputError, quoted

CONTENT = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False, protected_namespaces=())
"""Of `Strict`; a dataclass that has it by `pydantic.with_config` is held to it where it is read."""


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)  # which has no public name


class _Called(ModelMetaclass):
    """Of classes whose objects, made by a call, are refused as any input is."""

    def __call__(cls, *args: Any, **values: Any) -> Any:
        try:
            return super().__call__(*args, **values)
        except ValidationError as error:
            raise InputError(f"{cls.__name__}: {_words(error)}") from None


class Strict(BaseModel, metaclass=_Called):
    """A mapping of a file: no unknown key, no text for a number, no bool for a number, numbers finite.

    A whole number stands for a float too, as JSON does not tell them apart. One that is made by a call and is
    not as it should be is an `InputError`; `strictly` says so of a file's.
    """

    model_config = CONTENT


def first_fault(error: ValidationError) -> Any:
    """The fault to tell: an unknown key before what is missing, as it may be its name mistyped."""
    unknown = ("extra_forbidden", "unexpected_keyword_argument")
    return min(error.errors(include_url=False), key=lambda fault: fault["type"] not in unknown)


def _words(error: ValidationError, key: str = "") -> str:
    """The fault to tell, below a key."""
    first = first_fault(error)
    place = ".".join(str(part) for part in ((key,) if key else ()) + first["loc"]) or "content"
    found = "" if first["type"] == "missing" else f" (found {quoted(first['input'])})"
    return f"key '{place}': {first['msg'].removeprefix('Value error, ')}{found}"


Content = TypeVar("Content")


def as_written(content: Any) -> dict[str, Any]:
    """What a file holds of a dataclass or a `Strict`, JSON-ready; `strictly` reads it."""
    found: dict[str, Any] = TypeAdapter(type(content)).dump_python(content, mode="json")
    return found


def strictly(kind: type[Content], values: Any, key: str = "") -> Content:
    """Values as a kind of content.

    Parameters
    ----------
    kind
        What they should be: a `Strict`, or a dataclass with `CONTENT`.
    values
        What was read.
    key
        Where they stand in the file, for the message.

    Raises
    ------
    InputError
        Naming the first key that is not as it should be, what it is, and what was expected.
    """
    try:
        if issubclass(kind, BaseModel):
            return kind.model_validate(values)
        # As JSON, lists stand for tuples.
        read: Content = TypeAdapter(kind).validate_json(json.dumps(values))
        return read
    except ValidationError as error:
        raise InputError(_words(error, key)) from None
