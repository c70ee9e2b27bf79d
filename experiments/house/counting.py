"""Counts over source files: lines by kind, constants, functions, public names, circles."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

_CONSTANT = re.compile(r"_*[A-Z][A-Z0-9_]*")
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Counted:
    """What one file holds, in lines but for ``constants``, ``public``, ``documented`` and ``typed``.

    ``longest`` is the longest function with its name, docstring included.
    """

    lines: int
    code: int
    docstring: int
    blank: int
    constants: int
    public: int
    documented: int
    typed: int
    longest: tuple[int, str]


def counted(path: Path) -> Counted:
    """The counts of a Python file."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    docs: set[int] = set()
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            docs.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    told = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _NO_CODE:
            told.update(range(token.start[0], token.end[0] + 1))
    lines = text.splitlines()
    blank = sum(not line.strip() for i, line in enumerate(lines, 1) if i not in docs)
    spans = [
        (node.end_lineno - node.lineno + 1, f"{path.name}: {node.name}")
        for node in ast.walk(tree)
        if isinstance(node, Function) and node.end_lineno
    ]
    public = list(_public(tree.body))
    return Counted(
        lines=len(lines),
        code=len(told - docs),
        docstring=len(docs),
        blank=blank,
        constants=sum(_is_constant(node) for node in tree.body),
        public=len(public),
        documented=sum(ast.get_docstring(node) is not None for node in public),
        typed=sum(_typed(node) for node in public),
        longest=max(spans, default=(0, "")),
    )


_NO_CODE = (
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER,
)  # fmt: skip


def _is_constant(node: ast.stmt) -> bool:
    """Whether a statement at a module's head names a number."""
    target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
    if not (isinstance(target, ast.Name) and _CONSTANT.fullmatch(target.id)) or node.value is None:
        return False
    return _is_number(node.value)


def _is_number(value: ast.expr) -> bool:
    if isinstance(value, ast.UnaryOp):
        return _is_number(value.operand)
    if isinstance(value, ast.BinOp):
        return _is_number(value.left) and _is_number(value.right)
    return isinstance(value, ast.Constant) and type(value.value) in (int, float)


def _public(body: list[ast.stmt]) -> Iterator[Function | ast.ClassDef]:
    """Public functions and classes with their public methods."""
    for node in body:
        if isinstance(node, Function | ast.ClassDef) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from _public(node.body)


def _typed(node: Function | ast.ClassDef) -> bool:
    """Whether arguments and result all state their types; a class does by its members."""
    if isinstance(node, ast.ClassDef):
        return True
    given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return node.returns is not None and all(a.annotation or a.arg in ("self", "cls") for a in given)


def circles(root: Path) -> list[str]:
    """Circles of packages that import each other, within functions and for types too; one at a time."""
    package = root.name
    found: dict[str, set[str]] = {}
    for path in root.rglob("*.py"):
        home = path.relative_to(root).parts[0]
        if home.endswith(".py"):
            continue
        names = found.setdefault(home, set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                modules = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            parts = [m.split(".") for m in modules]
            names.update(p[1] for p in parts if p[0] == package and len(p) > 1 and (root / p[1]).is_dir())
        names.discard(home)
    told = []
    while True:
        try:
            TopologicalSorter(found).prepare()
        except CycleError as error:
            ring = error.args[1]
            told.append(" → ".join(ring))
            found[ring[1]].discard(ring[0])
        else:
            return told
