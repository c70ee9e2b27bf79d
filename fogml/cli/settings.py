"""Settings of a command: a YAML file, overridden by flags, checked, and written beside the results."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from inspect import get_annotations
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import Field, ValidationError, ValidationInfo, field_validator

from fogml import __version__
from fogml.cli.given import Given, argument, option
from fogml.errors import InputError, known_are, listed, printable, quoted
from fogml.folders import not_there, with_slashes
from fogml.locks import sole_writer
from fogml.outputs import check_is_no_folder, whole_file
from fogml.strict import Strict, first_fault
from fogml.yaml_text import read_yaml, yaml_text

SHIPPED = "shipped:"
"""What a run's path begins with when it names a recording that ships."""
RUN: dict[str, Any] = {"reads": True, "known": "fogml.cli.runs:shipped_places", "lost": "no such file"}
"""What is declared of a setting that names runs: recordings that ship by their names, else files."""


def setting(default: Any, help: str, *names: str, **more: Any) -> Any:
    """A setting's default, and how an option gives it; `more` as of `Given`, and bounds as of `Field`."""
    bounds = {key: more.pop(key) for key in ("gt", "ge", "lt", "le") if key in more}
    return Field(default, json_schema_extra=option(help, *names, **more), **bounds)


def placed(default: Any, metavar: str, help: str, **more: Any) -> Any:
    """A setting's default, and how its place on the command line gives it; `more` as of `Given`."""
    return Field(default, json_schema_extra=argument(metavar, help, **more))


class Settings(Strict):
    """What every command takes. Unknown keys are errors.

    A setting is declared once: its type, default and checks, and as `Given` how it stands on a command line.
    """

    job: ClassVar[str] = ""
    """``module:function`` that does the job, of settings and terminal; False: a limit was not met."""
    config_argument: ClassVar[str] = ""
    """Help of the configuration file as an argument; where there is none, it goes after ``--config``."""
    path_keys: ClassVar[tuple[str, ...]] = ()
    """Settings that name files to read."""
    written_keys: ClassVar[tuple[str, ...]] = ()
    """Settings that name files or folders to write."""
    seed: int = setting(0, "Seed of everything random.", ge=0, lt=1 << 32)

    @classmethod
    def __pydantic_init_subclass__(cls, **more: Any) -> None:
        super().__pydantic_init_subclass__(**more)
        given = given_settings(cls)
        cls.path_keys = tuple(key for key, one in given.items() if one.reads)
        cls.written_keys = tuple(key for key, one in given.items() if one.writes)

    @field_validator("*")
    @classmethod
    def _named(cls, value: Any, info: ValidationInfo) -> Any:
        is_path = info.field_name in (*cls.path_keys, *cls.written_keys)
        if is_path and (value == "" or (isinstance(value, list) and "" in value)):
            raise ValueError("an empty name; a file or folder was expected")
        return value

    @classmethod
    def gather(cls, config: Path | None, flags: Mapping[str, Any]) -> Self:
        """The settings from a YAML file and from flags; a flag that is None or empty is not set."""
        own = cls.model_fields.get("schema_")
        stated = read_config(config, own.default if own else "none") if config is not None else {}
        # A path in a configuration file may be meant from where the file lies.
        source = config.name if config is not None else "settings"
        for key in [key for key in stated if key in cls.path_keys]:
            assert config is not None
            stated[key] = _beside(stated[key], config.parent)
        given = {name: value for name, value in flags.items() if value is not None and value != []}
        try:
            settings = cls.model_validate({**stated, **given})
        except ValidationError as error:
            raise InputError(_message(cls, error, source, stated | given)) from None
        for key, one in given_settings(cls).items():
            from_file = config is not None and key in stated and key not in given
            place, folders = (f"{source}: '{key}': ", [config.parent]) if config and from_file else ("", [])
            _check_there(getattr(settings, key), one, place, folders)
        return settings

    def check_given(self) -> None:
        """Hold that nothing is missing that the job can't do without, and that no file to read is written.

        Raises
        ------
        InputError
            With what to give, or which file it is.
        """
        for key, one in given_settings(type(self)).items():
            if one.needed and not getattr(self, key):
                raise InputError(one.needed)
        for out in self._files(self.written_keys):
            for key in self.path_keys:
                if any(os.path.samefile(out, path) for path in self._files([key])):
                    raise InputError(f"{printable(out)}: is itself read ('{key}'); choose another --out")

    def _files(self, keys: Sequence[str]) -> list[str]:
        """Files that are there, of settings that name some."""
        values = [getattr(self, key) for key in keys]
        paths = [path for value in values for path in (value if isinstance(value, list) else [value])]
        return [path for path in paths if isinstance(path, str) and os.path.isfile(path)]

    def refuse_idle(self, names: Sequence[str], why: str) -> None:
        """Refuse settings that would change nothing as the others are.

        `why` says what they belong to, and what to do.

        Raises
        ------
        InputError
            Naming the first that is stated.
        """
        for name in names:
            if getattr(self, name) != type(self).model_fields[name].default:
                own = given_settings(type(self)).get(name)
                option = (own.names or ("--" + name.replace("_", "-"),))[0] if own else quoted(name)
                raise InputError(f"{option.partition('/')[0]} {why}")

    def in_full(self) -> Self:
        """The settings with every path in full, to be run from anywhere; what ships keeps its name."""
        keys = (*self.path_keys, *self.written_keys)
        return self.model_copy(update={key: self._in_full(key, getattr(self, key)) for key in keys})

    def _in_full(self, key: str, value: Any) -> Any:
        if isinstance(value, list):
            return [self._in_full(key, item) for item in value]
        return absolute(value) if isinstance(value, str) and not self._ships(key, value) else value

    def _ships(self, key: str, value: str) -> bool:
        """Whether a value of a path's setting names something that ships rather than a file."""
        return value.startswith(SHIPPED) or value in given_settings(type(self))[key].known_names()

    def as_written(self) -> dict[str, Any]:
        """The values of a configuration file."""
        return self.model_dump(mode="json")

    def yaml(self, command: str, name: str | None = None) -> str:
        """The settings as the text of a configuration file, called as `config_file` has it unless named."""
        option = "" if self.config_argument else "--config "
        again = f"fogml {command} {option}{name or config_file(command)}"
        head = f"# fogml {__version__}: run it again with  {again}\n"
        return head + yaml_text(self.as_written())

    def write_into(self, folder: Path, command: str) -> None:
        """Write the settings in full into a folder of results, named after the command."""
        text = self.in_full().yaml(command)
        (folder / config_file(command)).write_text(text, encoding="utf-8")

    @contextmanager
    def written_beside(self, out: Path, command: str) -> Iterator[None]:
        """Write a file in the block, and then the settings in full beside it, named after file and command.

        Raises
        ------
        InputError
            If it is a folder, or another process writes the file.
        """
        check_is_no_folder(out)
        name = f"{out.stem}.{config_file(command)}"
        with sole_writer(out), whole_file(out.with_name(name)) as config:
            config.write_text(self.in_full().yaml(command, name), encoding="utf-8")
            yield


def given_settings(settings: type[Settings]) -> dict[str, Given]:
    """How settings stand on a command line, by name: a class's own first, then what it shares."""
    fields = settings.model_fields
    names = [name for cls in settings.__mro__ for name in get_annotations(cls) if name in fields]
    held = {name: (*fields[name].metadata, fields[name].json_schema_extra) for name in names}
    return {name: given for name in names for given in held[name] if isinstance(given, Given)}


def config_file(command: str) -> str:
    """Name of the file that a command's settings are written to: two commands may share a folder."""
    return f"{command.replace(' ', '-')}.config.yaml"


def read_config(path: Path, schema: str) -> dict[str, Any]:
    """The mapping in a YAML file, which may state a schema of its own."""
    values = read_yaml(path, schema=schema)
    if values is None:
        return {}
    if not isinstance(values, dict) or not all(isinstance(key, str) for key in values):
        raise InputError(f"{path.name}: 'key: value' lines were expected")
    return values


def _beside(value: Any, folder: Path) -> Any:
    """A path as it stands if something is there, else the one in the configuration's folder if so."""
    if isinstance(value, list):
        return [_beside(item, folder) for item in value]
    if isinstance(value, str) and not os.path.exists(Path(value)) and os.path.exists(folder / value):
        return str(folder / value)
    return value


def _check_there(value: Any, given: Given, place: str, folders: Sequence[Path]) -> None:
    """Refuse a path that is not there, before the job loads; of others one that is there with slashes."""
    paths = (value if isinstance(value, list) else [value]) if given.reads else []
    for path in (path for path in paths if isinstance(path, str) and not path.startswith(SHIPPED)):
        hint = with_slashes(path, *folders)
        if hint or (given.lost and not_there(path)):
            raise InputError(f"{place}{printable(path)}: {'no such file' if hint else given.lost}{hint}")


def absolute(path: str) -> str:
    """The path in full."""
    return str(Path(path).absolute())


def _message(settings: type[Settings], error: ValidationError, source: str, stated: Mapping[str, Any]) -> str:
    first = first_fault(error)
    key = str(first["loc"][0]) if first["loc"] else "?"
    # A key within an entry of a list, such as runs.0.started.
    within = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden" and len(first["loc"]) > 1:
        return f"{source}: unknown key {quoted(within)}"
    if first["type"] == "extra_forbidden":
        known = [field.alias or name for name, field in settings.model_fields.items()]
        return f"{source}: unknown key {quoted(key)}; {known_are(key, known, 'known keys')}"
    place = f"{source}: " if key in stated else ""
    if first["type"] == "missing":
        lacking = [quoted(".".join(map(str, e["loc"]))) for e in error.errors() if e["type"] == "missing"]
        needed = [name for name, one in given_settings(settings).items() if one.needed]
        lacking += [quoted(name) for name in needed if not stated.get(name)]
        return f"{place}nothing is given for {listed(lacking)}"
    reason = str(first["ctx"]["error"]) if "ctx" in first and "error" in first["ctx"] else first["msg"]
    return f"{place}'{key}': {reason} (found {quoted(first['input'])})"
