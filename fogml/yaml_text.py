"""YAML as every file of the toolkit is read and written: data alone, each value what it looks like.

Scalars are those of the YAML 1.2 core schema (https://yaml.org/spec/1.2.2/#103-core-schema): ``yes``,
``on``, ``1:30``, ``1_000`` and ``2026-03-02`` are text; ``1e3`` is a number; true and false are truth values.
A number with a leading zero is refused, since YAML 1.1 reads 24 in ``030`` and YAML 1.2 reads 30.
Numbers are finite, and whole ones fit into 64 bits. There are no tags and no merge keys, one document a file,
and each key once. An alias counts as all that it stands for, so that a short text can't stand for a huge one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Hashable, Iterator
from pathlib import Path
from typing import Any, NoReturn

import yaml

from fogml.errors import InputError, other_schema, printable, quoted
from fogml.folders import with_slashes

MOST_BYTES = 4 << 20
"""Size of a file: a manifest of 30,000 units takes as much, and it is read within seconds."""
MOST_NODES = 500_000
"""Keys and values of a file, an alias counted as what it stands for: what 4 MB can state without aliases."""
DEEPEST = 32
"""Levels of lists and mappings; files of the toolkit have up to 8."""

_NULL = frozenset({"", "~", "null", "Null", "NULL"})
_TRUTH = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_INTEGER = re.compile(r"[-+]?[0-9]+\Z")
_LEADING_ZERO = re.compile(r"[-+]?0[0-9]")
_OTHER_BASE = re.compile(r"0o[0-7]+\Z|0x[0-9a-fA-F]+\Z")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)\Z|\.(nan|NaN|NAN)\Z")
_SURROGATE_ESCAPE = re.compile(r"\\u[dD][89a-fA-F]")


def read_yaml(path: Path, as_text: Collection[str] = (), schema: str | None = None) -> Any:
    """The content of a YAML file.

    Parameters
    ----------
    path
        The file, UTF-8.
    as_text
        Keys whose values are names: a serial number 0417 stays the text that was written.
    schema
        What it may state as its own, such as ``fogml.twin/1``; ``none`` where it may state none.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise _too_long(path.name)
        text = content.decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}){with_slashes(path)}") from None
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path.name}, line {line}: is no UTF-8 text; save it in UTF-8") from None
    values = parse_yaml(text, path.name, as_text)
    stated = values.get("schema", schema) if isinstance(values, dict) else schema
    if schema is not None and isinstance(stated, str) and stated != schema:
        raise InputError(f"{path.name}: {other_schema(stated, schema, '')}")
    return values


def parse_yaml(text: str, source: str, as_text: Collection[str] = ()) -> Any:
    """The content of YAML text.

    Parameters
    ----------
    text
        The text.
    source
        What messages call it.
    as_text
        As `read_yaml`.

    Returns
    -------
    object
        Nothing but dict, list, str, bool, int, finite float and None.
    """
    if len(text) > MOST_BYTES:
        raise _too_long(source)
    try:
        return _Builder(text, source, frozenset(as_text)).document()
    except yaml.reader.ReaderError as error:
        before = text[: error.position]
        place = f"line {before.count(chr(10)) + 1}, column {error.position - before.rfind(chr(10))}"
        raise InputError(f"{source}, {place}: a character that is no text; correct or remove it") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        problem = printable(error.problem or "")
        raise InputError(f"{source}{place}: not readable as YAML ({problem}); correct or remove it") from None
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(f"{source}: not readable as YAML ({quoted(str(error))})") from None


def _too_long(source: str) -> InputError:
    return InputError(f"{source}: longer than {MOST_BYTES >> 20} MB; that is no text of settings")


def yaml_text(values: Any, width: int = 110) -> str:
    """The text that `parse_yaml` reads back as the same values, in blocks and in the order of the keys."""
    return yaml.dump(
        values, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=width, default_flow_style=False
    )


class _Builder:
    """Builds values from the events of a parser; nothing is made of anything but plain data."""

    def __init__(self, text: str, source: str, as_text: frozenset[str]) -> None:
        self.source = source
        self.as_text = as_text
        # The fast parser knows no halves of characters, which stand for bytes of names that are not UTF-8.
        plain = _SURROGATE_ESCAPE.search(text) is not None
        loader = yaml.SafeLoader if plain else getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        self.events: Iterator[Any] = iter(yaml.parse(text, Loader=loader))
        self.anchors: dict[str, tuple[Any, int]] = {}
        self.nodes = 0
        self.keys: list[Hashable] = []

    def document(self) -> Any:
        next(self.events)
        if isinstance(next(self.events), yaml.StreamEndEvent):
            return None
        value = self._value(next(self.events), 0)
        next(self.events)
        if not isinstance(event := next(self.events), yaml.StreamEndEvent):
            self._fail(event, "a second document begins; one was expected")
        return value

    def _fail(self, event: Any, what: str) -> NoReturn:
        mark = event.start_mark
        key = f", key {quoted('.'.join(map(str, self.keys)))}" if self.keys else ""
        raise InputError(f"{self.source}, line {mark.line + 1}, column {mark.column + 1}{key}: {what}")

    def _value(self, event: Any, depth: int, is_text: bool = False) -> Any:
        before = self.nodes
        self.nodes += 1
        if isinstance(event, yaml.AliasEvent):
            value, size = self._anchored(event)
            self.nodes += size
        if self.nodes > MOST_NODES:
            self._fail(event, f"more than {MOST_NODES} values, aliases counted as what they stand for")
        if isinstance(event, yaml.AliasEvent):
            return value
        if depth > DEEPEST:
            self._fail(event, f"more than {DEEPEST} levels of lists and mappings")
        if event.tag not in (None, "!") or (event.tag == "!" and not isinstance(event, yaml.ScalarEvent)):
            self._fail(event, f"the tag {quoted(event.tag)} is not accepted; write plain values")
        if isinstance(event, yaml.ScalarEvent):
            value = self._scalar(event, is_text)
        elif isinstance(event, yaml.SequenceStartEvent):
            value = []
            while not isinstance(item := next(self.events), yaml.SequenceEndEvent):
                value.append(self._value(item, depth + 1, is_text))
        else:
            value = self._mapping(depth)
        if event.anchor is not None:
            self.anchors[event.anchor] = (value, self.nodes - before)
        return value

    def _mapping(self, depth: int) -> dict[Hashable, Any]:
        values: dict[Hashable, Any] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent | yaml.AliasEvent):
                self._fail(event, "a key is a list or a mapping; a name was expected")
            key = self._value(event, depth + 1)
            if isinstance(key, list | dict):
                self._fail(event, "a key is a list or a mapping; a name was expected")
            if key == "<<" and getattr(event, "implicit", (False,))[0]:
                self._fail(event, "merge keys '<<' are not accepted; write the keys themselves")
            if key in values:
                self._fail(event, f"key {quoted(key)} is stated twice; keep one of the two")
            self.keys.append(key)
            values[key] = self._value(next(self.events), depth + 1, is_text=key in self.as_text)
            self.keys.pop()
        return values

    def _anchored(self, event: Any) -> tuple[Any, int]:
        if event.anchor not in self.anchors:
            self._fail(event, f"alias {quoted('*' + event.anchor)} stands for nothing above it")
        return self.anchors[event.anchor]

    def _scalar(self, event: Any, is_text: bool) -> Any:
        text: str = event.value
        if "\0" in text:
            self._fail(event, "a character of code 0, which no name or path may have; remove it")
        if not event.implicit[0]:  # in quotation marks, or a block of text
            return text
        if text in _NULL:
            return None
        if is_text:
            return text
        if text in _TRUTH:
            return _TRUTH[text]
        if _OTHER_BASE.match(text):
            return self._fitting(event, int(text[2:], 8 if text[1] == "o" else 16))
        if _NOT_FINITE.match(text):
            self._fail(event, f"{quoted(text)}: a finite number was expected")
        if not _FLOAT.match(text):
            return text
        if _LEADING_ZERO.match(text):
            self._fail(
                event,
                f"{quoted(text)} begins with a zero; write the number without, a name in quotation marks",
            )
        if _INTEGER.match(text) and len(text) < 25:
            return self._fitting(event, int(text))
        number = float(text)
        if _INTEGER.match(text) or not math.isfinite(number):
            self._fail(event, f"{quoted(text)}: the number is too large")
        return number

    def _fitting(self, event: Any, number: int) -> int:
        if not -(1 << 63) <= number < 1 << 63:
            self._fail(event, f"{quoted(event.value)}: the number is too large")
        return number


class _Dumper(yaml.SafeDumper):
    """Writes in quotation marks whatever YAML 1.1 or 1.2 could take for anything but text; no aliases."""

    def ignore_aliases(self, data: Any) -> bool:
        return True

    def represent_str(self, data: str) -> yaml.ScalarNode:
        """Ends of line that readers fold or take for others are written as escapes."""
        style = '"' if any(end in data for end in "\x85\u2028\u2029") else None
        return self.represent_scalar("tag:yaml.org,2002:str", data, style=style)

    def represent_array(self, data: Any) -> yaml.Node:
        """Numbers and arrays of numpy, as those of Python."""
        if not hasattr(data, "tolist"):
            raise TypeError(f"{data!r} is no plain value of a YAML file")
        node: yaml.Node = self.represent_data(data.tolist())
        return node


_Dumper.add_representer(str, _Dumper.represent_str)
_Dumper.add_multi_representer(object, _Dumper.represent_array)
_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+0123456789."))
_Dumper.add_implicit_resolver("tag:yaml.org,2002:int", _OTHER_BASE, ["0"])
