"""Changes of one operator or one number of a source text, each of which the tests should notice."""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_OPERATORS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Add,
    ast.Pow: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
}


@dataclass(frozen=True)
class Mutant:
    """One change.

    Attributes
    ----------
    path
        File, from the root of the project.
    first, last
        Lines of the expression that is changed.
    function
        Qualified name of what it is in; empty at the module's level.
    before, after
        The expression.
    span
        Where the expression begins and ends, in bytes of the file.
    """

    path: str
    first: int
    last: int
    function: str
    before: str
    after: str
    span: tuple[int, int]

    @property
    def key(self) -> str:
        """What stays of it when lines move: file, function and change."""
        return f"{self.path} | {self.function} | {self.before} -> {self.after}"

    @property
    def package(self) -> str:
        """The package or module under ``fogml``."""
        return Path(self.path).with_suffix("").parts[1]

    def applied(self, source: bytes) -> bytes:
        """The file with the change."""
        start, stop = self.span
        return source[:start] + f"({self.after})".encode() + source[stop:]


def mutants_of(path: str, source: bytes) -> list[Mutant]:
    """Every change of a file, in its order; annotations, text and imports for types alone stay."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for node, function, after in _changes(ast.parse(source), ""):
        span = (starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset)
        before = " ".join(source[slice(*span)].decode().split())
        found.append(Mutant(path, node.lineno, node.end_lineno, function, before, after, span))
    return found


def drawn(root: Path, count: int, seed: int) -> list[Mutant]:
    """So many changes drawn from all of the project's own code; the first of them are a sample too."""
    files = sorted((root / "fogml").rglob("*.py"))
    named = [(file.relative_to(root).as_posix(), file.read_bytes()) for file in files]
    every = [one for name, source in named for one in mutants_of(name, source)]
    return random.Random(seed).sample(every, min(count, len(every)))


def _changes(node: ast.AST, function: str) -> Iterator[tuple[ast.expr, str, str]]:
    if isinstance(node, ast.expr):
        for changed in _changed(node):
            yield node, function, " ".join(ast.unparse(changed).split())
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        function = f"{function}.{node.name}" if function else node.name
    for_types = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
    if for_types or isinstance(node, ast.JoinedStr):
        return
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _changes(child, function)


def _changed(node: ast.expr) -> Iterator[ast.expr]:
    if isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
        yield ast.Constant(_other(node.value))
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield node.operand
    elif isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in _OPERATORS:
        yield _with(node, op=_OPERATORS[type(node.op)]())
    elif isinstance(node, ast.Compare):
        for place, operator in enumerate(node.ops):
            if type(operator) in _OPERATORS:
                others = [*node.ops[:place], _OPERATORS[type(operator)](), *node.ops[place + 1 :]]
                yield _with(node, ops=others)


def _other(value: bool | int | float) -> bool | int | float:
    if isinstance(value, bool):
        return not value
    return value + 1 if isinstance(value, int) or value == 0.0 else 1.1 * value


def _with(node: ast.expr, **changes: object) -> ast.expr:
    return type(node)(**{name: changes.get(name, value) for name, value in ast.iter_fields(node)})
