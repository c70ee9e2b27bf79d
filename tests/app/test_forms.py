"""Forms of the app: what is filled in is what the command line takes, and paths stay in the folder."""

from __future__ import annotations

from typing import Any

import pytest

from fogml.cli.app_job import INPUTS, check_form, forms, words_of
from fogml.cli.main import app
from fogml.errors import InputError

KNOWN = {
    "run": ["files/a.csv", "files/b c.csv"],
    "model": ["jobs/0001/results/model"],
    "file": ["files/m.yaml"],
    "models": ["jobs/0001/results/model"],
    "twin": ["jobs/0002/results/twin.yaml"],
    "profile": ["files/logger.yaml"],
    "manifest": ["files/line.csv"],
    "fleet": ["jobs/0004/results/fleet.json"],
}


def settings(words: list[str]) -> dict[str, Any]:
    """What a command line sets."""
    program: Any = app
    command = program.get_command(None, words[0])
    return dict(command.make_context(words[0], list(words[1:])).params)


def words(command: str, **values: Any) -> list[str]:
    return words_of(command, values, lambda takes: KNOWN[takes], "jobs/0003/results")


@pytest.mark.parametrize("command", INPUTS)
def test_every_form_gives_a_command_line_that_is_taken(command: str) -> None:
    (form,) = [one for one in forms() if one["command"] == command]
    values: dict[str, Any] = {}
    for one in form["inputs"]:
        values[one["key"]] = KNOWN[one["takes"]][: 2 if one["several"] else 1]
    filled = {"text": "3", "switch": True, "lines": ["x=1\ny=2"]}
    for one in form["settings"]:
        values[one["key"]] = one["choices"][-1] if one["choices"] else filled[one["kind"]]
        if one["kind"] == "switch":
            values[one["key"]] = not one["default"]
    told = settings(words(command, **values))
    for one in form["inputs"]:
        held = told[one["key"]]
        assert list(held if isinstance(held, (tuple, list)) else [held]) == values[one["key"]], one
    assert told["out"] == "jobs/0003/results" + "/profile.yaml" * (command == "import")
    changed = [one["key"] for one in form["settings"] if told[one["key"]] in (None, ())]
    assert not changed
    # What is as it is without is not said.
    assert words(command)[-2:] == ["--out", "jobs/0003/results"]
    defaults = {one["key"]: one["default"] for one in form["settings"]}
    assert words(command, **defaults) == words(command)


@pytest.mark.parametrize("path", ["/etc/passwd", "files/../../x.csv", "files/none.csv", "a.csv", "--out=x"])
def test_paths_are_those_that_are_listed(path: str) -> None:
    inputs = "fleet manifest, import profile, inspect runs, export model, diagnose twin, train noise"
    for command, key in (one.split() for one in inputs.split(", ")):
        with pytest.raises(InputError, match="choose one that is listed"):
            words(command, **{key: [path]})


@pytest.mark.parametrize("command", INPUTS)
def test_a_form_that_no_job_can_begin_with_says_what_is_missing_or_wrong(command: str) -> None:
    def checked(**values: Any) -> None:
        check_form(command, values, words(command, **values))

    with pytest.raises(InputError, match=r"no .* is given; name"):
        checked()
    with pytest.raises(InputError, match=r"no .* is given; name"):
        # On the line what is chosen would come first.
        checked(**{key: KNOWN[takes][:1] for key, takes in [*INPUTS[command].items()][1:]})
    with pytest.raises(InputError, match="seed"):
        checked(seed="x", **{key: KNOWN[takes][:1] for key, takes in INPUTS[command].items()})


def test_values_are_no_options_and_other_settings_are_refused() -> None:
    assert settings(words("train", features="--out=/tmp/x"))["features"] == "--out=/tmp/x"
    assert words("diagnose", twin=["nominal"])[1:3] == ["--twin", "nominal"]
    assert "shipped:thermal-cycle-1-y" in words("inspect", runs=["shipped:thermal-cycle-1-y"])
    others = "monitor out, monitor store, fleet cluster, fleet track, train config, train nothing"
    for command, key in (one.split() for one in others.split(", ")):
        with pytest.raises(InputError, match="no setting"):
            words(command, **{key: "x"})
    with pytest.raises(InputError, match="no command"):
        words("blind")
