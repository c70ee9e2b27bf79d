"""What the README and the pages of docs/ say is what there is: commands, files, schemas, examples, links."""

from __future__ import annotations

import doctest
import re
import shlex
import tomllib
from collections.abc import Iterable
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import fogml
from experiments.guide_commands.__main__ import NEEDS_NETWORK, ROOT, blocks_of, files_of, lines_of, pages
from fogml.cli.docs_job import page_names
from fogml.cli.main import app
from fogml.features.parse import parse_features
from fogml.lab.acceptance_rows import BY_KEY
from fogml.runs.shipped import shipped_names
from fogml.validation.limits import QUANTITIES

CODE = Path(fogml.__file__).parent
PAGES = pages()
TEXTS = {path: path.read_text(encoding="utf-8") for path in [*PAGES, *(ROOT / "docs").glob("*.md")]}
README = TEXTS[ROOT / "README.md"]
GROUP: Any = app
SHELL = [(path, line) for path in PAGES for line in lines_of(path)]
WRITTEN = {"--out", "-o", "--truth"}
"""Options whose value a command makes."""


def resolved(arguments: list[str]) -> tuple[Any, list[str], Any]:
    """A command, what is left of the arguments for it, and its context above."""
    context = GROUP.make_context("fogml", list(arguments))
    _, command, rest = GROUP.resolve_command(context, list(arguments))
    while hasattr(command, "list_commands"):
        context = command.make_context(command.name, rest, parent=context)
        _, command, rest = command.resolve_command(context, rest)
    return command, rest, context


def test_there_are_commands_to_check() -> None:
    assert len(SHELL) > 40 and len({path for path, _ in SHELL}) > 10


@pytest.mark.parametrize("line", sorted({line for _, line in SHELL if line.startswith("fogml ")}))
def test_a_command_is_taken_as_it_stands(line: str) -> None:
    if line == "fogml --version":
        return
    command, rest, context = resolved(shlex.split(line)[1:])
    command.make_context(command.name, rest, parent=context)


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.name)
def test_commands_and_options_within_the_text_exist(path: Path) -> None:
    for text in re.findall(r"`fogml (\w[^`]*)`", TEXTS[path]):
        words = text.split()
        if words[0].isupper():
            continue
        command, _, context = resolved([word for word in words if word != "…"])
        known = {name for p in command.get_params(context) for name in (*p.opts, *p.secondary_opts)}
        assert {word for word in words if word.startswith("--")} <= known, text


def test_features_in_the_tables_are_understood() -> None:
    text = TEXTS[ROOT / "docs" / "models.md"]
    tables = text[text.index("## Features") : text.index("The lag and the play")]
    named = {
        name for row in re.findall(r"^\| (`[^|]*) \|", tables, re.MULTILINE) for name in row.split("`")[1::2]
    }
    assert len(named) > 10
    for name in sorted(named):
        parse_features(name.replace("(…)", "(T, 8 degC, 600 s)"))


def test_recordings_that_are_named_ship() -> None:
    named = {name for text in TEXTS.values() for name in re.findall(r"shipped:([a-z][\w-]*)", text)}
    assert named and named <= set(shipped_names())


def test_each_file_is_there_or_made_before() -> None:
    made: set[str] = set()
    for path in PAGES:
        made |= set(files_of(path))
        for line in lines_of(path):
            words = shlex.split(line)
            outputs = {after for word, after in pairwise(words) if word in WRITTEN}
            if line.startswith("fogml fleet"):
                outputs.add("next.csv")
            if not line.startswith((*NEEDS_NETWORK, ".", "fogml docs")):
                for word in set(words[1:]) - outputs:
                    if re.search(r"\.(csv|yaml|c|json)$|/", word) and "=" not in word:
                        parents = {str(parent) for parent in (Path(word), *Path(word).parents)}
                        assert parents & made or (ROOT / word).exists(), f"{path.name}: {line}: {word}"
            made |= outputs


def test_blocks_of_python_name_what_there_is() -> None:
    found = [(path, block) for path in TEXTS for block in blocks_of(path, "python") if ">>>" not in block]
    assert found
    for path, block in found:
        compile(block, path.name, "exec")
        for name in re.findall(r"\bfogml\.(\w+)", block):
            assert hasattr(fogml, name), name


@pytest.mark.parametrize("path", [p for p in TEXTS if ">>> " in TEXTS[p]], ids=lambda path: path.name)
def test_examples_give_what_they_show(path: Path) -> None:
    outcome = doctest.testfile(str(path), module_relative=False, encoding="utf-8")
    assert outcome.attempted and not outcome.failed


def test_every_schema_that_is_read_or_compared_is_named() -> None:
    named = set(re.findall(r"`(fogml\.[a-z_]+/\d+)`", TEXTS[ROOT / "docs" / "schemas.md"]))
    written = set()
    for path in CODE.rglob("*.py"):
        written |= set(re.findall(r"\"(fogml\.[a-z_]+/\d+)\"", path.read_text(encoding="utf-8")))
    assert named - {"fogml.blind_uses/1"} <= written
    assert not written - named


@pytest.mark.parametrize(("page", "known"), [("acceptance.md", BY_KEY), ("figures.md", QUANTITIES)])
def test_figures_that_may_have_a_limit_are_named(page: str, known: Iterable[str]) -> None:
    told = TEXTS[ROOT / "docs" / page].partition("Figures that may have")[2].partition("\n\n")[0]
    assert set(re.findall(r"`(\w+)`", told)) == set(known)


def test_links_lead_somewhere() -> None:
    for path, text in TEXTS.items():
        for address in re.findall(r"\]\(([^)\s]+)\)", text):
            if not address.startswith(("http", "#")):
                assert (path.parent / address.partition("#")[0]).is_file(), f"{path.name}: {address}"


def test_every_page_is_on_the_first() -> None:
    names = {path.stem for path in (ROOT / "docs").glob("*.md")}
    index = TEXTS[ROOT / "docs" / "index.md"]
    listed = set(re.findall(r"\]\(([\w-]+)\.md\)", index))
    assert listed == names - {"index"}
    assert set(page_names(ROOT / "docs")) == names


def test_the_distribution_brings_the_pages_along() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    data = settings["tool"]["setuptools"]["data-files"]
    for folder, patterns in data.items():
        for pattern in patterns:
            assert list(ROOT.glob(pattern)), f"{folder}: {pattern}"
    brought = {path for patterns in data.values() for pattern in patterns for path in ROOT.glob(pattern)}
    assert {*(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "pictures").iterdir()} <= brought


def test_the_readme_is_short() -> None:
    assert len(README.splitlines()) < 150


def test_nobody_is_sent_to_another_project() -> None:
    texts = [*TEXTS.values(), *(path.read_text(encoding="utf-8") for path in ROOT.glob("*.md"))]
    texts += [path.read_text(encoding="utf-8") for path in CODE.rglob("*.py")]
    assert not [text for text in texts if re.search(r"pip install (-\S+ )*['\"]?fogml(?!-lab)\b", text)]


def test_the_version_is_the_same_everywhere() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = re.findall(
        r"^## (\d+\.\d+\.\d+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert {settings["project"]["version"], changes[0]} == {fogml.__version__}
    assert re.search(rf"^version: {re.escape(fogml.__version__)}$", citation, re.MULTILINE)


def test_every_package_says_what_it_is() -> None:
    for path in sorted((ROOT / "fogml").glob("*/__init__.py")):
        package = import_module(f"fogml.{path.parent.name}")
        assert (package.__doc__ or "").strip(), f"{package.__name__} has no docstring"
