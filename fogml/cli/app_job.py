"""The job of ``fogml app``: forms made of the commands' settings, and the command line of a filled form."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path, PurePosixPath
from typing import Any, Literal, get_args

from fogml.cli.command import SettingsCommand
from fogml.cli.given import Given, load
from fogml.cli.main import COMMANDS
from fogml.cli.run_commands import AppSettings
from fogml.cli.settings import SHIPPED, Settings, given_settings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError, install_words, quoted
from fogml.folders import refuse_file
from fogml.locks import Held, sole_writer
from fogml.processes import needs_posix

INPUTS: Mapping[str, Mapping[str, str]] = {
    "import": {"file": "run", "profile": "profile"},
    "inspect": {"runs": "run"},
    "noise": {"run": "run"},
    "train": {"runs": "run", "test": "run", "noise": "run"},
    "compare": {"runs": "run", "test": "run", "noise": "run"},
    "diagnose": {"runs": "run", "held_out": "run", "noise": "run", "twin": "twin"},
    "export": {"model": "model", "train": "run", "matrix": "file"},
    "monitor": {"model": "models", "runs": "run"},
    "fleet": {"manifest": "manifest", "prior": "fleet", "twin": "twin", "acceptance_limits": "file"},
}
"""Commands of the app in the order of work, and what each of their settings that name files takes."""
LABELS = {
    ("train", "runs"): "train",
    ("compare", "runs"): "train",
    ("import", "file"): "read",
    ("diagnose", "runs"): "fit",
    ("monitor", "runs"): "new",
    ("train", "test"): "judge",
    ("compare", "test"): "judge",
    ("diagnose", "held_out"): "held out",
}
FIXED = {"monitor": ["--store", "store"]}
"""What the app adds: units in service share one store in the app's folder."""
LEFT_OUT = frozenset({"out", "store", "cluster", "track"})
"""Settings that the app makes itself, or that ask another machine."""
NAMED = frozenset({"twin", "profile"})
"""What an input takes that a name may stand for: what ships is listed beside the folder's."""


def forms() -> list[dict[str, Any]]:
    """The commands with their inputs and settings, JSON-ready."""
    return [_form(command, settings_of(command)) for command in INPUTS]


def settings_of(command: str) -> type[Settings]:
    """The settings of a command of the app."""
    found: type[Settings] = load(COMMANDS[command][0].replace(".", "fogml.cli.", 1))
    return found


def _form(command: str, settings: type[Settings]) -> dict[str, Any]:
    given = given_settings(settings)
    inputs = [
        {
            "key": key,
            "takes": takes,
            "label": LABELS.get((command, key), key.replace("_", " ")),
            "help": given[key].help,
            "several": "list" in str(settings.model_fields[key].annotation),
            "known": list(given[key].known_names()) if takes in NAMED else [],
        }
        for key, takes in INPUTS[command].items()
    ]
    own = [
        _field(settings, key, one)
        for key, one in given.items()
        if key not in INPUTS[command] and key not in LEFT_OUT and not (one.reads or one.writes)
    ]
    return {"command": command, "help": COMMANDS[command][1], "inputs": inputs, "settings": own}


def _field(settings: type[Settings], key: str, given: Given) -> dict[str, Any]:
    field = settings.model_fields[key]
    annotation = str(field.annotation)
    is_literal = getattr(field.annotation, "__origin__", None) is Literal
    choices = [str(choice) for choice in get_args(field.annotation)] if is_literal else []
    kind = "choice" if choices else "switch" if "bool" in annotation else "text"
    if kind == "text" and not given.as_text and ("dict[" in annotation or "list[" in annotation):
        kind = "lines"
    default = field.get_default(call_default_factory=True)
    shown = default if isinstance(default, (bool, int, float, str)) else ""
    return {
        "key": key,
        "kind": kind,
        "help": given.help,
        "metavar": given.metavar or "",
        "default": shown,
        "choices": choices,
        "known": [str(name) for name in given.known_names()] if kind == "text" else [],
    }


def words_of(
    command: str, values: Mapping[str, Any], known: Callable[[str], Sequence[str]], results: str
) -> list[str]:
    """The words of a command line of a form.

    Parameters
    ----------
    command
        Of the app.
    values
        What was filled in, by setting; empty text is not filled in.
    known
        Paths that may be named, by what an input takes.
    results
        Folder that the command writes.

    Raises
    ------
    InputError
        If the command or a setting is none of the app's, or a path is none that the app offers.
    """
    if command not in INPUTS:
        raise InputError(f"the app has no command {quoted(command)}")
    settings = settings_of(command)
    given = given_settings(settings)
    places: list[str] = []
    named: list[str] = []
    form = {field["key"]: field for field in _form(command, settings)["settings"]}
    for key in values:
        if key not in INPUTS[command] and key not in form:
            raise InputError(f"{command}: the app has no setting {quoted(key)}")
    for key, takes in INPUTS[command].items():
        paths = [_checked(path, takes, known, given[key]) for path in _texts(key, values.get(key))]
        if given[key].argument:
            places += paths
        elif paths:
            name = _option(key, given[key])
            named += [name, *paths] if given[key].spread else [w for path in paths for w in (name, path)]
    for key, field in form.items():
        named += _setting(key, given[key], field, values.get(key))
    # Of a draft --out names the file itself.
    out = f"{results}/profile.yaml" if command == "import" and values.get("draft") else results
    return [command, *places, *named, *FIXED.get(command, []), "--out", out]


def check_form(command: str, values: Mapping[str, Any], words: list[str]) -> None:
    """Hold that a job can begin with a form and its words: nothing is missing, values are as expected.

    Raises
    ------
    InputError
        With what is missing or wrong.
    """
    for key, given in given_settings(settings_of(command)).items():
        # On the line what comes next would stand in its place.
        if given.needed and not _texts(key, values.get(key)):
            raise InputError(given.needed)
    SettingsCommand(command, settings_of(command)).check_words(words[1:])


def _checked(path: str, takes: str, known: Callable[[str], Sequence[str]], given: Given) -> str:
    """A path that the app offers, or a name that ships."""
    ships = given.known_names() if path.startswith(SHIPPED) or takes in NAMED else ()
    if path not in ships and path not in known(takes):
        raise InputError(f"{quoted(path)} is no {takes} of the app's folder; choose one that is listed")
    return str(PurePosixPath(path)) if path not in ships else path


def _texts(key: str, value: Any) -> list[str]:
    texts = [value] if isinstance(value, str) else value or []
    if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
        raise InputError(f"'{key}': names were expected, found {quoted(value)}")
    return [text for text in texts if text]


def _option(key: str, given: Given) -> str:
    return given.names[0] if given.names else "--" + key.replace("_", "-")


def _setting(key: str, given: Given, field: Mapping[str, Any], value: Any) -> list[str]:
    """Words of a setting; none where it is not filled in, or as it is without."""
    name = _option(key, given)
    if field["kind"] == "switch":
        if value is None or bool(value) == bool(field["default"]):
            return []
        return [name.split("/")[0 if value else 1]]
    if field["kind"] == "lines":
        return [
            f"{name}={line.strip()}" for line in "\n".join(_texts(key, value)).splitlines() if line.strip()
        ]
    text = str(value).strip() if isinstance(value, (str, int, float)) else ""
    if not text or text == str(field["default"]):
        return []
    return [f"{name}={text}"]


def serve(settings: AppSettings, terminal: Terminal) -> None:
    """Serve the page until it is interrupted, or idle for as long as asked."""
    needs_posix("fogml app")
    try:
        from fogml.app.server import listen
        from fogml.app.server import serve as serve_app
    except ImportError as error:
        raise InputError(f"fogml app needs Tornado ({error}): {install_words('app')}") from None
    home = Path(settings.folder)
    refuse_file(home, "FOLDER")
    home.mkdir(parents=True, exist_ok=True)
    home = home.resolve()
    from fogml.app.state import App, Limits

    limits = Limits(int(settings.upload_limit * 1e6), settings.jobs, settings.idle)
    # A second server of the folder would start its waiting jobs again.
    with ExitStack() as held:
        try:
            held.enter_context(sole_writer(home / "server"))
        except Held as error:
            raise InputError(
                f"{home}: another fogml app serves this folder ({error.who}); open the address that it "
                "printed, or end it first"
            ) from None
        app = App(home, forms(), words_of, check_form, limits)
        listening, address = listen(app, settings.port)
        terminal.result({"address": address, "folder": str(home)})
        terminal.say(f"Open {address}")
        terminal.say("That address opens the page for whoever has it. End with Ctrl+C; jobs go on.")
        if settings.browser:
            import webbrowser

            webbrowser.open(address)
        serve_app(app, listening)
