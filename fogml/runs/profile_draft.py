"""A first import profile for a file that nobody has described: guesses with reasons, to be corrected."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from fogml.errors import InputError
from fogml.escaping import visible
from fogml.numerals import duration
from fogml.runs.columns import column_spec, is_accepted, parse_header
from fogml.runs.container_files import groups_of
from fogml.runs.csv_dialect import decoded_head
from fogml.runs.csv_header import fields_of, is_number_like, labview_header
from fogml.runs.csv_source import PLAIN, CsvSource, Marks, marks_of, number
from fogml.runs.header_spelling import canonical_cells, face_of, with_units_below
from fogml.runs.opening import opened
from fogml.runs.profile_parts import SEPARATORS
from fogml.runs.reader_process import stored_file
from fogml.runs.reading_limits import DEFAULT_LIMITS
from fogml.runs.stamps import stamp_form
from fogml.yaml_text import parse_yaml

_MOST_ROWS = 200
_TIME = re.compile(r"time|stamp|clock|zeit|epoch|^t$|^ts$|^[mun]?s(ec)?$|sow|tow|时间", re.IGNORECASE)
_DATE = re.compile(r"date|datum|日期", re.IGNORECASE)
_GYRO = re.compile(r"gyr|fog|omega|^om|ang.*(vel|rate)|^w[_.]?[xyz]?$|^g[_.]?[xyz]$|rate|陀螺", re.IGNORECASE)
_WARM = re.compile(r"temp|die|oven|therm|^t[_.]?\w{0,3}$|温", re.IGNORECASE)
_AXIS = re.compile(r"([xyz])\W*\Z", re.IGNORECASE)
_UNIT_IN_NAME = (("us", r"us\b|µs|micro"), ("ns", r"ns\b|nano"), ("ms", r"ms\b|milli"))
_FEW_VALUES = 20  # of 200: a state, a flag; the noise of a gyro takes more
_TAIL_BYTES = 1 << 12
_DAYS = (30_000.0, 80_000.0)  # since 1900, of the years 1982 to 2119
_KELVIN = 200.0  # no chamber is so hot in degC, and none so cold in kelvin
_MARK = "# GUESS: "


@dataclass
class _Field:
    """A field of the file: how a profile names it, its name and unit, and its first values as text."""

    source: str | int
    name: str
    unit: str | None
    first: list[str] = field(default_factory=list)
    marks: Marks = PLAIN

    @property
    def numbers(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        found = (number(t.strip(' "'), self.marks.decimal, self.marks.grouped) for t in self.first)
        return np.array([np.nan if value is None else value for value in found])


def draft_profile(path: Path) -> str:
    """The text of an import profile (YAML) for a file: what is sure, and what is a guess and why."""
    file = opened(path)
    layout, fields = _of_text(file.path) if file.kind == "csv" else _of_container(path, file.kind)
    if file.within is not None:
        for one in fields:
            # Without its values another column would be taken for what it is.
            file.within.check_column(one.name, sum(bool(text.strip()) for text in one.first), len(one.first))
    lines = ["schema: fogml.import/1", f"description: {_quoted('draft for ' + path.name)}"]
    lines += [*layout, *_columns(fields)]
    # Names may hold marks that end a line of YAML.
    return "\n".join(map(visible, lines)) + "\n"


def _of_text(path: Path) -> tuple[list[str], list[_Field]]:
    """The layout's keys and the fields of a text file."""
    head, encoding = decoded_head(path)
    name, lines, data = _table_of(head)
    mark = SEPARATORS[name]
    if data is None:
        raise InputError(f"{path.name}: no rows of numbers in its first lines; a draft needs some")
    rows = [_split(line, mark) for line in lines[data : data + _MOST_ROWS] if line.strip()]
    width = len(rows[0])
    marks = marks_of(CsvSource(path), rows, mark or " ")
    layout = [f"separator: {name}"] + ([f'decimal: "{marks.decimal}"'] if marks.decimal != "." else [])
    if encoding not in ("utf-8-sig", "utf-8"):
        layout.append(f"encoding: {encoding}")
    above = [i for i in range(data) if lines[i].strip() and len(_split(lines[i], mark)) == width]
    names = [
        _split(lines[i], mark) for i in above if not any(is_number_like(f) for f in _split(lines[i], mark))
    ]
    units: tuple[str, ...] | None = None
    if labview := labview_header(lines):
        layout += [f"skip_lines: {data}", "header: false", f"fields: {width}"]
        fields = [_Field(i, *parse_header(cell)) for i, cell in enumerate(canonical_cells(labview.cells))]
        layout.append(f"# Fields: {', '.join(f'{f.source} {f.name}' for f in fields)}")
    elif not names:
        layout += [f"skip_lines: {data}"] if data else []
        layout += ["header: false", f"fields: {width}"]
        fields = [_Field(i, f"column {i}", None) for i in range(width)]
    else:
        cells = names[-1]
        if len(names) > 1 and (units := with_units_below([c.strip() for c in names[-2]], names[-1])):
            cells = names[-2]
        line = lines[above[len(above) - (2 if units else 1)]].strip()
        if next(i for i, text in enumerate(lines) if text.strip()) < data - (2 if units else 1):
            layout.append(
                f"header_text: {_quoted(line[:60])}    # the header is the first line that holds this"
            )
        known = units or canonical_cells([cell.strip().strip('"') for cell in cells])
        fields = [
            _Field(cell.strip(' "'), *parse_header(right)) for cell, right in zip(cells, known, strict=False)
        ]
    below = _are_below(path, encoding, mark, width)
    if units or below:
        keys = ["not_numbers: true", *(["wrong_field_count: true"] if below else [])]
        what = ["the row of units below the header"] * bool(units) + ["the lines below the data"] * below
        layout.append(f"reject: {{{', '.join(keys)}}}    # {' and '.join(what)}: left out")
    for place, one in enumerate(fields):
        one.first, one.marks = [row[place] for row in rows if len(row) == width], marks
    return layout, fields


def _are_below(path: Path, encoding: str, mark: str | None, width: int) -> bool:
    """Whether lines other than of numbers stand below them."""
    wide = encoding if encoding.startswith("utf-16") else None
    tail = CsvSource(path, wide).tail(_TAIL_BYTES).decode(errors="replace").rstrip("\0")
    lines = [line for line in re.split(r"\r\n|\r|\n", tail)[1:] if line.strip()]
    return any(not _is_data(_split(line, mark), width) for line in lines)


def _table_of(text: str) -> tuple[str, list[str], int | None]:
    """The separator's name, the lines, and the first line of numbers."""
    lines = re.split(r"\r\n|\r|\n", text)[:-1] or [text]
    best: tuple[float, str, int | None] = (0.0, "comma", None)
    for name, mark in SEPARATORS.items():
        rows = [_split(line, mark) for line in lines[-_MOST_ROWS:] if line.strip()]
        counts = [len(row) for row in rows]
        width = max(set(counts), key=counts.count) if counts else 0
        first = _first_of_longest([not t.strip() or _is_data(_split(t, mark), width) for t in lines], lines)
        numbers = [sum(is_number_like(f.strip(' "')) for f in row) for row in rows]
        score = float(np.median(numbers)) if numbers else 0.0
        if first is not None and score > best[0]:
            best = (score, name, first)
    return best[1], lines, best[2]


def _first_of_longest(is_data: Sequence[bool], lines: Sequence[str]) -> int | None:
    """Where the longest stretch of lines of numbers begins, blank ones apart; None where there is none."""
    ends = [-1, *(i for i, data in enumerate(is_data) if not data), len(lines)]
    stretches = [range(a + 1, b) for a, b in pairwise(ends)]
    return next((i for i in max(stretches, key=len) if lines[i].strip()), None)


def _is_data(fields: Sequence[str], width: int) -> bool:
    return len(fields) == width and 2 * sum(is_number_like(f.strip(' "')) for f in fields) >= width


def _split(line: str, mark: str | None) -> list[str]:
    return line.split() if mark is None else fields_of(line, mark)


def _of_container(path: Path, kind: str) -> tuple[list[str], list[_Field]]:
    """The fields of the group that looks most like a gyro's, and of the others' temperatures."""
    with stored_file(path, kind, (), DEFAULT_LIMITS) as stored:
        groups = groups_of(stored, kind)
        scores = {g.name: sum(bool(_GYRO.search(n)) for n in g.names) + 2 * g.is_run for g in groups}
        if not scores:
            raise InputError(f"{path.name}: holds no columns of numbers; a draft needs some")
        main = max(scores, key=lambda name: scores[name])
        fields = []
        for group in groups:
            for cell, array in group.columns:
                name, unit = parse_header(cell)
                if group.name == main or (_WARM.search(name) and name != "time"):
                    source = f"{group.name}/{array.name}" if group.name else array.name
                    held = stored.read(array, 0, min(max(array.shape), _MOST_ROWS)) if array.is_vector else ()
                    fields.append(_Field(source, name, unit, [repr(float(value)) for value in held]))
    others = [name for name in scores if name != main]
    return ([f"# Other groups of the file: {', '.join(others[:20])}"] if others else []), fields


def _columns(fields: Sequence[_Field]) -> list[str]:
    """The keys that say which field is which."""
    left = list(fields)
    clock = _clock(left)
    lines = ["columns:", *clock]
    gyros = _taken(left, lambda f: f.name == "gyro" or f.name.startswith("gyro_")) or _taken(
        left, lambda f: bool(_GYRO.search(f.name)) and not _DATE.search(f.name)
    )
    if not gyros:
        held = [f for f in left if np.isfinite(f.numbers).any() or not f.first]
        # States and marks take few values; a thermometer is named as one.
        gyros = sorted(held, key=lambda f: (bool(_WARM.search(f.name)), _takes_few(f)))[:1]
        left = [f for f in left if f not in gyros]
    axes = {m[1].lower(): f for f in gyros if (m := _AXIS.search(f.name))}
    many = len(gyros) > 1 and len(axes) == len(gyros)
    lines.append("  gyro: " + _gyro(gyros[0] if gyros else None, many))
    used: set[str] = set()
    warm_before = len(lines)
    of_a_run = _taken(left, lambda f: _is_of_a_run(f) and not (clock and f.name == "time"))
    faces = [face_of(one.name) for one in of_a_run]
    for one, face in zip(of_a_run, faces if "T_in" in faces else [None] * len(faces), strict=True):
        lines.append(_other(one, face, used))
    if len(lines) == warm_before and (rest := sorted((f for f in left if f not in gyros), key=_takes_few)):
        lines.append(f"  # T: {{source: {_quoted(rest[0].source)}, unit: degC}}    # a drift model needs one")
    if many:
        lines.append("axes: {" + ", ".join(f"{axis}: {_quoted(f.source)}" for axis, f in axes.items()) + "}")
    if not any(line.startswith("  time:") for line in lines):
        lines.append(f"sample_s: 0.01    {_MARK}no clock was found; write the true interval [s]")
    others = [*left, *([] if many else gyros[1:])]
    rest = [f for f in others if isinstance(f.source, str) and (np.isfinite(f.numbers).any() or not f.first)]
    if rest:
        lines.append(
            f"# keep: [{', '.join(_quoted(f.source) for f in rest)}]    # other columns, under their names"
        )
    lines += [
        "# facts: {unit: FOG-0417, latitude: 39.9, input_axis: up}",
        "# where: [{source: STATE, equals: 2}]        # rows to keep",
        "# legs: {up: {from_s: 0, to_s: 3600}}        # runs of their own",
    ]
    return lines


def _takes_few(one: _Field) -> bool:
    """Whether a field takes few values, as a state does, or none that is a number."""
    return len(set(one.numbers[np.isfinite(one.numbers)].tolist())) < _FEW_VALUES


def _is_of_a_run(one: _Field) -> bool:
    """Whether a field is a column of the run format, or a temperature by name or unit."""
    is_warm = bool(_WARM.search(one.name)) or (one.unit is not None and is_accepted("T", one.unit))
    return column_spec(one.name) is not None or is_warm


def _clock(left: list[_Field]) -> list[str]:
    """The clock's line: stamps, else a column that only grows and is named as one."""
    stamped = [(f, form.kind) for f in left if f.first and (form := stamp_form([f.first[0].strip()]))]
    # What stands still is no time of day.
    stamped.sort(key=lambda one: len(set(one[0].first)) == 1)
    if stamped:
        left[:] = [f for f in left if all(f is not one for one, _ in stamped)]
        whole = [f for f, kind in stamped if kind.startswith("date and")]
        parts = [[f for f, kind in stamped if (kind == "date") is is_date][:1] for is_date in (True, False)]
        used = whole[:1] or [f for part in parts for f in part]
        shown = [_quoted(f.source) for f in used]
        others = ", ".join(_quoted(f.source) for f, _ in stamped if f not in used)
        source = shown[0] if len(shown) == 1 else f"[{', '.join(shown)}]"
        doubt = f"    {_MARK}or by {others}?" if others else ""
        return [f"  time: {{source: {source}, unit: stamp}}{doubt}"]
    # Other columns of the run format, such as a T that grows, are no clocks.
    free = [f for f in left if f.name == "time" or column_spec(f.name) is None]
    named = [f for f in free if f.name == "time" or _TIME.search(f.name) or _DATE.search(f.name)]
    known = sorted(named, key=lambda f: f.name != "time") or [f for f in free if _grows(f)][:1]
    growing = [f for f in known if _grows(f) or not f.first]
    if not growing:
        return []
    one = growing[0]
    left.remove(one)
    if one.unit is not None and is_accepted("time", one.unit):
        return [f"  time: {{source: {_quoted(one.source)}, unit: {_quoted(one.unit)}}}"]
    if _DATE.search(one.name) and one.first and _DAYS[0] < np.median(one.numbers) < _DAYS[1]:
        why = "days, as a spreadsheet counts them"
        return [f"  time: {{source: {_quoted(one.source)}, unit: d}}    {_MARK}{why}"]
    unit = next((u for u, hint in _UNIT_IN_NAME if re.search(hint, one.name, re.IGNORECASE)), "s")
    step = ""
    if len(one.first) > 1:
        apart = float(np.median(np.diff(one.numbers)))
        ms = f", or {duration(apart / 1000.0)} if they are ms" if unit == "s" and apart > 1.0 else ""
        step = f"steps of {apart:.6g}{f': {duration(apart)}{ms}' if ms else ''}; "
    return [f"  time: {{source: {_quoted(one.source)}, unit: {unit}}}    {_MARK}{step}is the unit right?"]


def _grows(one: _Field) -> bool:
    values = one.numbers
    return len(values) > 1 and bool(np.all(np.diff(values) > 0.0))


def _gyro(one: _Field | None, many: bool) -> str:
    """The gyro's entry."""
    if one is None:
        return f"{{source: GYRO, unit: deg/h}}    {_MARK}no column looks like a gyro; name it"
    source = "" if many else f"source: {_quoted(one.source)}, "
    if one.unit is not None and is_accepted("gyro", one.unit):
        return f"{{{source}unit: {_quoted(one.unit)}}}"
    values = one.numbers
    hints = (("deg/h", r"dph|deg_?h|grad/h"), ("deg/s", r"dps|deg_?s|grad/s"), ("rad/s", r"(?<!g)rad"))
    text = f"{one.name} {one.unit or ''}".lower()
    unit = next((u for u, hint in hints if re.search(hint, text)), None)
    if unit is None and len(values) and np.all(values == np.round(values)):
        unit, why = "count", "whole numbers; with 'scale: 1/K' it may be deg/s or deg/h"
    else:
        why = f"the file says '{one.unit}': state a scale" if one.unit else "the file states no unit"
    return f"{{{source}unit: {unit or 'deg/s'}}}    {_MARK}{why}"


def _other(one: _Field, face: str | None, used: set[str]) -> str:
    """The entry of a temperature, perhaps of a face of the coil, or another column of the run format."""
    others = ["T", *(f"T{i}" for i in range(1, 99))]
    named = [name for name in (one.name, face) if name is not None and column_spec(name) is not None]
    name = next(n for n in [*named, *others] if n not in used)
    guessed = name == face != one.name
    used.add(name)
    spec = column_spec(name)
    assert spec is not None
    if one.unit is not None and is_accepted(name, one.unit):
        doubt = f"    {_MARK}of the coil's face? else T_case or T_chamber" if guessed else ""
        return f"  {name}: {{source: {_quoted(one.source)}, unit: {_quoted(one.unit)}}}{doubt}"
    values = one.numbers
    warm = float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0
    unit = "K" if spec.internal == "degC" and warm > _KELVIN else spec.internal
    entry = f"  {name}: {{source: {_quoted(one.source)}, unit: {unit}}}"
    return f"{entry}    {_MARK}which sensor, and is the unit right?"


def _taken(left: list[_Field], is_one: Callable[[_Field], bool]) -> list[_Field]:
    """The fields of which something is true, taken from those that are left."""
    found = [f for f in left if is_one(f) and (np.isfinite(f.numbers).any() or not f.first)]
    for one in found:
        left.remove(one)
    return found


def _quoted(value: str | int) -> str:
    """A value for YAML."""
    if isinstance(value, int):
        return str(value)
    # Words such as 'no' and 'on' are truth values there.
    is_plain = re.fullmatch(r"[A-Za-z_][\w./]*", value) and parse_yaml(value, value) == value
    return value if is_plain else json.dumps(value, ensure_ascii=False)
