"""A command on files that hold three gyros: its job once an axis, a folder each, and an index page."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fogml.cli.given import load
from fogml.cli.settings import Settings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.outputs import whole_folder

SCHEMA = "fogml.axes/1"


def do_job(settings: Settings, command: str, terminal: Terminal) -> bool:
    """Do a command's job; on files of several gyros once an axis. False where a limit was not met."""
    settings.check_given()
    from fogml.runs.three_axes import SeveralAxes

    job = load(settings.job)
    try:
        return job(settings, terminal) is not False
    except SeveralAxes as several:
        if "axis" not in type(settings).model_fields:
            raise
        return _each(settings, command, several.axes, terminal)


class _OfAxis(Terminal):
    """Prints what an axis' job says under its name, keeps its result, and names what will be its folder."""

    def __init__(self, terminal: Terminal, axis: str, staged: str, final: str) -> None:
        super().__init__(terminal.as_json, terminal.quiet)
        self.values: Any = None
        self.written: list[str] = []
        self._names = staged, final
        self.say(f"Axis {axis}")

    def say(self, text: str) -> None:
        """A line; one that names the folder is kept until that is there, with its name as it will be."""
        staged, final = self._names
        if staged != final and staged in text:
            self.written.append(text.replace(staged, final))
        else:
            super().say(text)

    def result(self, values: Any) -> None:
        """Kept for the axes' one result."""
        self.values = values


def _each(settings: Settings, command: str, axes: tuple[str, ...], terminal: Terminal) -> bool:
    values, met, written = {}, True, list[str]()
    with _places(settings, command, axes) as places:
        for axis, (staged, final) in places.items():
            own = _for_axis(settings, axis, staged)
            printed = _OfAxis(terminal, axis, str(staged), str(final))
            met = load(own.job)(own, printed) is not False and met
            values[axis] = printed.values
            written += printed.written
            if staged is not None and staged != final:
                # The job wrote its settings with the folder's passing name.
                _for_axis(settings, axis, final).write_into(staged, command)
        result = {"schema": SCHEMA, "command": command, "axes": values}
        staged, final = next(iter(places.values()))
        if staged != final and staged is not None and final is not None:
            from fogml.report.axes_page import PAGES, axes_page

            page = axes_page(result, {axis: f"{axis}/{PAGES[command]}" for axis in axes})
            (staged.parent / "index.html").write_text(page, encoding="utf-8")
            settings.write_into(staged.parent, command)
            written.append(f"Open {final.parent / 'index.html'}: the axes side by side")
    for text in written:
        terminal.say(text)
    terminal.result(result)
    return met


def _for_axis(settings: Settings, axis: str, out: Path | None) -> Settings:
    """The settings of one axis: its model, and where its results go."""
    update: dict[str, Any] = {"axis": axis, "out": None if out is None else str(out)}
    model = getattr(settings, "model", None)
    if "model" in settings.path_keys and model is not None:
        update["model"] = str(Path(model) / axis)
    return settings.model_copy(update=update)


@contextmanager
def _places(
    settings: Settings, command: str, axes: tuple[str, ...]
) -> Iterator[dict[str, tuple[Path | None, Path | None]]]:
    """Where each axis' results are written, and where they will be: a folder or a file each, or nowhere."""
    out = getattr(settings, "out", None)
    if "model" in settings.path_keys:
        _check_models(settings, axes)
    if out is None:
        yield dict.fromkeys(axes, (None, None))
    elif command == "compensate":
        file = Path(out)
        named = {axis: file.with_name(f"{file.stem}-{axis}{file.suffix}") for axis in axes}
        yield {axis: (path, path) for axis, path in named.items()}
    else:
        with whole_folder(out) as folder:
            yield {axis: (folder / axis, Path(out) / axis) for axis in axes}


def axis_folders(model: str) -> list[str]:
    """The folder of a model; of results of a file of three gyros, those of its axes."""
    from fogml.models.saved import MODEL_FILE

    home = Path(model)
    held = [home / axis for axis in ("x", "y", "z") if (home / axis / "model" / MODEL_FILE).is_file()]
    alone = (home / MODEL_FILE).is_file() or (home / "model" / MODEL_FILE).is_file()
    return [model] if alone or not held else [str(folder) for folder in held]


def _check_models(settings: Settings, axes: tuple[str, ...]) -> None:
    """Refuse before anything is written where an axis has no model."""
    from fogml.cli.runs import open_model

    model = getattr(settings, "model", None)
    for axis in axes if model is not None else ():
        folder = Path(str(model)) / axis
        if not folder.is_dir():
            raise InputError(
                f"{model}: holds no folder '{axis}', and the run holds the axes {', '.join(axes)}; name the "
                "folder that 'fogml train' wrote for a file of three axes, or one axis with --axis"
            )
        open_model(folder, Terminal(quiet=True))  # its own job tells
