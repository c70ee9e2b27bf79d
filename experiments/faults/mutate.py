"""Ways to spoil an input: bytes, lines and cells of text, values of a tree; all drawn from one generator."""

from __future__ import annotations

import copy
import json
from random import Random
from typing import Any

MARKER = "fogml-ran-this"
"""Name of the file that code in an input would make, if any of it ran."""
NUMBERS = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "1e308",
    "-1e308",
    "1e309",
    "nan",
    "inf",
    "-inf",
    "NaN",
    "Infinity",
    "1e-299",
    "5e-324",
    "9007199254740993",
    "1e18",
    "1e999",
    "0x10",
    "030",
    "1_000",
    "1,5",
    "1:30",
    "yes",
    "true",
    "null",
    "~",
    "-127",
    "85",
    "-9999",
    "0.1.2",
    "+5",
    ".5",
    "5.",
    "1e",
    "--1",
    "٣",
    "½",
    "1e400",
    "20260302",
    "99999999999999999999",
    "0b1",
    "1e-5",
]
"""How people, loggers and attackers write numbers, and what only looks like one."""
TEXTS = (
    "",
    " ",
    "\x00",
    "'",
    '"',
    "\n",
    "\t",
    "a\nb: c",
    "../../up",
    "/",
    "-",
    "--help",
    "\u202e",
    "\ufeff",
    "é°",
    "\U0001f600",
    "a" * 5000,
    "(" * 3000,
    "[" * 3000,
    "{" * 3000,
    "T*" * 1000 + "T",
    "T," * 1000 + "T",
    "%s%n%d",
    "{0.__class__}",
    "=1+1",
    "<script>alert(1)</script>",
    f'*/ __attribute__((constructor)) void z(void) {{ system("touch {MARKER}"); }} /*',
    f"$(touch {MARKER})",
    f"`touch {MARKER}`",
    f"; touch {MARKER}",
    f"!!python/object/apply:os.system ['touch {MARKER}']",
    f"__import__('os').system('touch {MARKER}')",
    "shipped:nothing",
    "https://example.invalid/x",
    "nominal",
    "auto",
    "all",
    "none",
)
_LITERALS: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2, 10**30, -(10**30), 1e308, -1e308, 1e-299, 5e-324, 0.5, float("nan"),
    float("inf"), -float("inf"), "", [], {}, [[]], {"": None}, [None], [1, 2], "1", "nan", "1e400",
    2**63, 2**31,
)  # fmt: skip
_MOST_EDITS = 3


def scalar(rng: Random) -> Any:
    """A value that a field does not expect."""
    pick = rng.random()
    if pick < 0.6:
        return rng.choice(_LITERALS)
    return rng.choice(NUMBERS) if pick < 0.8 else rng.choice(TEXTS)


def word(rng: Random) -> str:
    """A text that a number or a name does not expect."""
    return rng.choice(NUMBERS) if rng.random() < 0.6 else rng.choice(TEXTS)


def edits(rng: Random) -> range:
    """One to three edits, mostly one."""
    return range(rng.choice((1, 1, 1, 2, _MOST_EDITS)))


def data(rng: Random, content: bytes) -> bytes:
    """Bytes with bits turned, cut, doubled, moved or put in."""
    held = bytearray(content)
    for _ in edits(rng):
        size = len(held)
        at = rng.randrange(size + 1)
        length = min(rng.choice((1, 1, 2, 4, 8, 64, 512)), size - at)
        way = rng.randrange(8)
        if way == 0 and at < size:
            held[at] ^= 1 << rng.randrange(8)
        elif way == 1 and at < size:
            held[at] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, 0x22, 0x0A, 0x2C))
        elif way == 2:
            del held[at:]
        elif way == 3:
            del held[at : at + length]
        elif way == 4:
            held[at:at] = held[at : at + length]
        elif way == 5:
            held[at:at] = rng.randbytes(rng.choice((1, 2, 8, 64)))
        elif way == 6:
            number = rng.choice((0, 1, 0x7F, 0xFF, 0x7FFFFFFF, 0xFFFFFFFF, 2**63 - 1, 2**64 - 1))
            wide = rng.choice((2, 4, 8))
            held[at : at + wide] = (number % 256**wide).to_bytes(wide, rng.choice(("little", "big")))
        else:
            other = rng.randrange(size + 1)
            held[at : at + length] = held[other : other + length]
    return bytes(held)


def text(rng: Random, content: str) -> str:
    """Text with lines or words replaced, doubled, moved, cut or put in."""
    for _ in edits(rng):
        lines = content.split("\n")
        at = rng.randrange(len(lines))
        way = rng.randrange(9)
        if way == 0:
            lines.insert(at, lines[rng.randrange(len(lines))])
        elif way == 1:
            del lines[at]
        elif way == 2:
            lines[at] = (
                rng.choice((" ", "  ", "\t", "- ", "? ", "&a ", "*a ", "!!float ", "%", "#")) + lines[at]
            )
        elif way == 3:
            lines[at] += rng.choice((" ", ":", ",", " #", "]", "}", " &b", "\x00", "\r", " *b", ": {", ": ["))
        elif way == 4:
            head, colon, _ = lines[at].partition(":")
            lines[at] = f"{head}{colon} {word(rng)}"
        elif way == 5:
            other = rng.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
        elif way == 6:
            lines = lines[:at] or [""]
        elif way == 7:
            lines.insert(at, word(rng))
        else:
            words = lines[at].split(" ")
            words[rng.randrange(len(words))] = word(rng)
            lines[at] = " ".join(words)
        content = "\n".join(lines)
    return content


def tree(rng: Random, value: Any) -> Any:
    """A copy of a JSON-like value in which a few nodes are replaced, removed, renamed, doubled or nested."""
    root = [copy.deepcopy(value)]
    for _ in edits(rng):
        places = list(_places(root))
        home, key = rng.choice(places)
        way = rng.randrange(10)
        if way < 4:
            home[key] = scalar(rng)
        elif way == 4 and home is not root:
            del home[key]
        elif way == 5 and isinstance(home, dict):
            home[str(scalar(rng))] = home.pop(key)
        elif way == 6 and isinstance(home, dict):
            home[str(word(rng))] = scalar(rng)
        elif way == 7:
            home[key] = rng.choice(([home[key]], {"x": home[key]}, [home[key]] * rng.choice((2, 1000))))
        elif way == 8 and isinstance(home[key], int | float) and not isinstance(home[key], bool):
            home[key] = rng.choice(
                (-home[key], str(home[key]), 1e300 if home[key] else 1e-300, home[key] + 1, 7)
            )
        else:
            other, name = rng.choice(places)
            if isinstance(other, dict | list) and (
                name in other if isinstance(other, dict) else name < len(other)
            ):
                home[key] = copy.deepcopy(other[name])
    return root[0]


def _places(value: Any) -> Any:
    pairs = enumerate(value) if isinstance(value, list) else value.items()
    for key, item in list(pairs):
        yield value, key
        if isinstance(item, dict | list) and item:
            yield from _places(item)


def document(rng: Random, value: Any, *, as_yaml: bool) -> bytes:
    """The text of a spoiled tree as JSON or YAML, now and then spoiled as text or bytes as well."""
    pick = rng.random()
    spoiled = value if pick > 0.75 else tree(rng, value)
    content = _written(rng, spoiled, as_yaml)
    if pick > 0.7:
        content = text(rng, content)
    held = content.encode("utf-8", errors="surrogatepass")
    return data(rng, held) if pick > 0.95 else held


def _written(rng: Random, value: Any, as_yaml: bool) -> str:
    if as_yaml and rng.random() < 0.8:
        import yaml

        return str(
            yaml.dump(
                value,
                Dumper=getattr(yaml, "CSafeDumper", yaml.SafeDumper),
                allow_unicode=True,
                sort_keys=False,
            )
        )
    return json.dumps(value, indent=1)


def table(rng: Random, rows: list[list[str]]) -> list[list[str]]:
    """A copy of a table in which a few cells, rows or columns are spoiled."""
    rows = [list(row) for row in rows]
    for _ in edits(rng):
        at = rng.randrange(len(rows))
        column = rng.randrange(max(len(rows[0]), 1))
        way = rng.randrange(12)
        if way < 4 and column < len(rows[at]):
            rows[at][column] = word(rng)
        elif way == 4:
            rows.insert(at, list(rows[rng.randrange(len(rows))]))
        elif way == 5 and len(rows) > 2:
            del rows[at]
        elif way == 6:
            other = rng.randrange(len(rows))
            rows[at], rows[other] = rows[other], rows[at]
        elif way == 7:
            rows[at] = rows[at][: rng.randrange(len(rows[at]) + 1)]
        elif way == 8:
            rows[at].append(word(rng))
        elif way == 9:
            rows = [row[:column] + row[column + 1 :] for row in rows]
        elif way == 10:
            rows = [row + row[column : column + 1] for row in rows]
        elif rows[0]:
            rows[0][column % len(rows[0])] = rng.choice(_HEADERS)
        if not rows[0]:
            rows[0] = [""]
    return rows


_HEADERS = (
    "time [s]", "time [ms]", "time [us]", "time [h]", "time", "Time [s]", "gyro [deg/s]", "gyro [rad/s]",
    "gyro [count]", "gyro", "gyro (deg/h)", "T [K]", "T [degC]", "T [°C]", "T1 [degC]", "T2 [degC]",
    "T_in [degC]",
    "T_out [degC]", "rate [deg/s]", "rate [rad/s]", "angle [rad]", "fan [%]", "own", "own [V]", "flag",
    "gyro_compensated [deg/h]", "drift [deg/h]", "[s]", "time []", "time [s", "T [F]", "T]",
    "T1000000 [degC]",
)  # fmt: skip
