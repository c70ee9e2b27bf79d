"""Settings: flags over YAML over defaults, unknown keys named, values after --test."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path

import pytest
import yaml

from fogml.cli import settings as settings_module
from fogml.cli.command import SettingsCommand, spread_values
from fogml.cli.lab import NorthSettings
from fogml.cli.model_commands import (
    CompareSettings,
    CompensateSettings,
    ExportJobSettings,
    SweepSettings,
    TrainSettings,
)
from fogml.cli.run_commands import ImportSettings
from fogml.cli.settings import Settings, given_settings
from fogml.cli.twin_commands import DiagnoseSettings, PlanSettings, ReplaySettings, SimulateSettings
from fogml.errors import InputError
from fogml.runs.reading import read_run
from fogml.yaml_text import parse_yaml


def config(folder: Path, text: str) -> Path:
    path = folder / "settings.yaml"
    path.write_text(text)
    return path


def test_flags_override_the_file_and_the_file_overrides_defaults(tmp_path):
    path = config(tmp_path, "model: rbf\naveraging: 10\nlimits: {rms: 0.5}\n")
    settings = TrainSettings.gather(path, {"model": "M2", "features": None, "limits": None})
    assert (settings.model, settings.averaging, settings.limits) == ("M2", 10.0, {"rms": 0.5})
    assert settings.out == "train-results"


def test_limits_from_flags():
    settings = TrainSettings.gather(None, {"limits": ["bias_stability=0.02", "range = 1"]})
    assert settings.limits == {"bias_stability": 0.02, "range": 1.0}


@pytest.mark.parametrize("text", ["bias_stability", "bias_stability=", "bias_stability=low"])
def test_a_limit_without_a_number_is_an_error(text):
    with pytest.raises(InputError, match="NAME=VALUE"):
        TrainSettings.gather(None, {"limits": [text]})


def test_an_unknown_key_is_named_with_the_nearest_known(tmp_path):
    with pytest.raises(InputError, match=r"settings.yaml: unknown key 'feature'; did you mean 'features'"):
        TrainSettings.gather(config(tmp_path, "feature: T\n"), {})


@pytest.mark.parametrize("text", ["- a\n- b\n", "just text", "1: 2"])
def test_a_file_without_keys_is_an_error(tmp_path, text):
    with pytest.raises(InputError, match="key: value"):
        TrainSettings.gather(config(tmp_path, text), {})


def test_a_file_that_is_no_yaml_names_its_line(tmp_path):
    with pytest.raises(InputError, match=r"settings.yaml, line 2"):
        TrainSettings.gather(config(tmp_path, "model: M1\nfeatures: T: dT\n"), {})


def test_a_binary_file_as_configuration_is_an_error(tmp_path):
    path = tmp_path / "settings.yaml"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match=r"settings\.yaml"):
        TrainSettings.gather(path, {})


def test_a_missing_file_and_a_folder_are_errors(tmp_path):
    with pytest.raises(InputError, match=r"none\.yaml.*No such file"):
        TrainSettings.gather(tmp_path / "none.yaml", {})
    with pytest.raises(InputError, match="directory"):
        TrainSettings.gather(tmp_path, {})


def test_a_path_with_backslashes_that_is_there_with_slashes_is_told(tmp_path, monkeypatch):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.csv").touch()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    where = r"\.\.\\in\\a\.csv: no such file; did you mean \.\./in/a\.csv\?"
    with pytest.raises(InputError, match=rf"^{where}"):
        TrainSettings.gather(None, {"runs": [r"..\in\a.csv"]})
    path = config(tmp_path / "here", "runs: ['..\\in\\a.csv']\n")
    monkeypatch.chdir(tmp_path / "in")  # the path is meant from where the file lies
    with pytest.raises(InputError, match=rf"^settings\.yaml: 'runs': {where}"):
        TrainSettings.gather(path, {})
    with pytest.raises(InputError, match=r"No such file .*; did you mean \.\./here/settings\.yaml\?"):
        TrainSettings.gather(Path(r"..\here\settings.yaml"), {})
    with pytest.raises(InputError, match=r"did you mean \.\./in/a\.csv\?"):
        read_run(r"..\in\a.csv")


def test_backslashes_of_what_is_nowhere_or_is_named_so_are_left(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / r"in\a.csv").touch()
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.csv").touch()
    runs = [r"in\a.csv", "a" * 5000]
    assert TrainSettings.gather(config(tmp_path, f"runs: {json.dumps(runs)}\n"), {}).runs == runs
    with pytest.raises(InputError, match=r"^settings\.yaml: 'runs': no\\a\.csv: no such file$"):
        TrainSettings.gather(config(tmp_path, r"runs: [in\a.csv, no\a.csv]"), {})


def test_a_value_of_the_wrong_kind_names_its_key(tmp_path):
    with pytest.raises(InputError, match=r"settings.yaml: 'averaging': .*'long'"):
        TrainSettings.gather(config(tmp_path, "averaging: long\n"), {})


def test_runs_beside_the_file_are_found(tmp_path, monkeypatch):
    folder = tmp_path / "data"
    folder.mkdir()
    (folder / "a.csv").write_text("")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    Path("here.csv").touch()
    settings = TrainSettings.gather(config(folder, "runs: [a.csv]\ntest: [here.csv]\n"), {})
    assert settings.runs == [str(folder / "a.csv")]
    assert settings.test == ["here.csv"]


@pytest.mark.parametrize(
    ("settings", "given"),
    [
        (ImportSettings, {"file": "a.csv", "draft": True}),
        (CompensateSettings, {"run": "a.csv", "model": "."}),
        (ReplaySettings, {"twin": "tactical", "run": "b.csv", "truth": "a.csv"}),
        (ReplaySettings, {"twin": "tactical", "run": "b.csv", "after": ["b.csv", "a.csv"]}),
        (SimulateSettings, {"schema": "fogml.simulate/1", "programme": "a.csv"}),
    ],
)
@pytest.mark.parametrize("out", ["a.csv", "./linked.csv"])
def test_a_file_that_is_read_is_never_written(tmp_path, monkeypatch, settings, given, out):
    monkeypatch.chdir(tmp_path)
    for name in ("a.csv", "b.csv"):
        Path(name).write_text("time [s],gyro [deg/h]\n0,1\n")
    Path("linked.csv").symlink_to("a.csv")
    with pytest.raises(InputError, match=r"\.csv: is itself read"):
        settings.model_validate({**given, "out": out}).check_given()
    settings.model_validate({**given, "out": "c.csv"}).check_given()


def test_written_settings_read_back_the_same(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("b.csv").touch()
    settings = TrainSettings.gather(
        None, {"runs": ["shipped:cold-start-x"], "test": ["b.csv"], "limits": ["rms=0.1"], "seed": 3}
    ).in_full()
    path = config(tmp_path, settings.yaml("train"))
    assert TrainSettings.gather(path, {}) == settings
    assert yaml.safe_load(path.read_text())["runs"] == ["shipped:cold-start-x"]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (["a", "--test", "b", "c", "--seed", "1"], ["a", "--test", "b", "--test", "c", "--seed", "1"]),
        (["a", "--test", "b", "--test", "c"], ["a", "--test", "b", "--test", "c"]),
        (["--test", "b", "-o", "x", "a"], ["--test", "b", "-o", "x", "a"]),
        (["a", "--test=b", "--seed", "1", "c"], ["a", "--test=b", "--seed", "1", "c"]),
        (["a", "--test=b", "--", "c"], ["a", "--test=b", "--", "c"]),
        (["a", "--test"], ["a", "--test"]),
        (["a", "--test", "--json"], ["a", "--test", "--json"]),
        (["--test", "b", "--", "c"], ["--test", "b", "--", "c"]),
    ],
)
def test_values_after_an_option_belong_to_it(given, expected):
    assert spread_values(given, "--test") == expected


def test_a_name_after_a_joined_value_is_not_guessed_to_be_a_training_run() -> None:
    for given in (["--test=b", "c"], ["a", "--test", "b", "--test=c", "d"]):
        with pytest.raises(InputError, match=r"write '--test . .' if it does, else name it before --test"):
            spread_values(given, "--test")


def test_runs_after_an_option_are_none_of_the_command_s_own() -> None:
    """Of ``--held-out c d`` d was fitted to, in silence."""
    command = SettingsCommand("diagnose", DiagnoseSettings)
    told = command.make_context("diagnose", ["a", "--held-out", "c", "d"])
    assert (told.params["runs"], told.params["held_out"]) == (("a",), ("c", "d"))
    for kind in kinds_of_settings():
        lists = {
            key: given
            for key, given in given_settings(kind).items()
            if given.reads and "list[" in str(kind.model_fields[key].annotation)
        }
        if any(given.argument for given in lists.values()):
            assert all(given.argument or given.spread for given in lists.values()), kind


def kinds_of_settings() -> list[type[Settings]]:
    for path in Path(settings_module.__file__).parent.glob("*_job.py"):
        import_module(f"fogml.cli.{path.stem}")
    found: list[type[Settings]] = [Settings]
    for kind in found:
        found += [derived for derived in kind.__subclasses__() if derived not in found]
    return [kind for kind in found if kind.__module__.startswith("fogml.")]


def test_settings_that_are_written_are_read_back():
    """Whatever their types: a pair is a list in YAML."""
    kinds = kinds_of_settings()
    assert len(kinds) > 15
    needed = {"SweepSettings": {"space": {"features": ["T"], "models": ["M1"]}}}
    stated = [kind.model_validate(needed.get(kind.__name__, {})) for kind in kinds]
    stated.append(NorthSettings(azimuth=30.0, transients=[(0.2, 600.0), (1.0, 5.0)]))
    for settings in stated:
        again = type(settings).model_validate(parse_yaml(settings.yaml("any"), "config.yaml"))
        assert again == settings


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ("averaging: yes", "'averaging': .*number .found 'yes'"),
        ("averaging: true", "'averaging': .*number .found True"),
        ("averaging: '10'", "'averaging': .*number .found '10'"),
        ("seed: 3.0", "'seed': .*integer"),
        ("repair: 1", "'repair': .*boolean"),
        ("model: 5", "'model': .*string"),
        ("averaging: 010", "'010' begins with a zero"),
        ("seed: 4294967296", "'seed': .*less than 4294967296"),
        ("runs: [a.csv, '']", "'runs': .*empty name; a file or folder was expected"),
        ("out: ''", "'out': .*empty name"),
    ],
)
def test_a_value_of_another_type_is_told(tmp_path, values, told):
    with pytest.raises(InputError, match=told):
        TrainSettings.gather(config(tmp_path, values), {})


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ("spce: {}", "unknown key 'spce'; did you mean 'space'"),
        ("space: {features: [T], modles: [M1]}", "unknown key 'modles'; did you mean 'models'"),
        ("space: {models: [M1]}", "nothing is given for 'features'"),
    ],
)
def test_a_mistyped_key_is_told_before_what_is_missing_for_it(tmp_path, values, told):
    with pytest.raises(InputError, match=told):
        SweepSettings.gather(config(tmp_path, values), {})


@pytest.mark.parametrize(
    ("settings", "in_full"),
    [
        (
            TrainSettings(runs=["a.csv", "shipped:thermal-cycle-1-x"], test=["b.csv"]),
            {
                "runs": ["/here/a.csv", "shipped:thermal-cycle-1-x"],
                "test": ["/here/b.csv"],
                "out": "/here/train-results",
            },
        ),
        (CompensateSettings(run="a.csv", model="m"), {"run": "/here/a.csv", "model": "/here/m", "out": None}),
        (
            ImportSettings(file="a.log", profile="ring-laser-static"),
            {"file": "/here/a.log", "profile": "ring-laser-static"},
        ),
        (ImportSettings(file="a.log", profile="own.yaml"), {"profile": "/here/own.yaml"}),
        (
            ReplaySettings(twin="nominal", run="a.csv", truth="t"),
            {"twin": "nominal", "run": "/here/a.csv", "truth": "/here/t"},
        ),
        (SimulateSettings(twin="t.yaml", out="b.csv"), {"twin": "/here/t.yaml", "out": "/here/b.csv"}),
        (
            SimulateSettings(programme=["soak 1 h"], truth="t"),
            {"programme": ["soak 1 h"], "truth": "/here/t"},
        ),
    ],
)
def test_paths_are_written_in_full_and_names_as_they_are(
    settings: Settings, in_full: dict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    changed = yaml.safe_load(settings.in_full().yaml("any").replace(str(tmp_path), "/here"))
    assert {key: changed.get(key) for key in in_full} == in_full
    # All else, and the order of the keys, is as stated.
    stated = yaml.safe_load(settings.yaml("any"))
    assert list(changed) == list(stated)
    paths = {*type(settings).path_keys, *type(settings).written_keys}
    assert {k: v for k, v in changed.items() if k not in paths} == {
        k: v for k, v in stated.items() if k not in paths
    }


@pytest.mark.parametrize(
    ("settings", "values"),
    [
        (CompareSettings, {"models": "M1, none", "limits": ["rms=0.1"]}),
        (TrainSettings, {"parameters": ["ridge=1"]}),
        (ExportJobSettings, {"model": "results/model"}),
        (NorthSettings, {"order": "0,90", "transients": ["0.2,600", [0.1, 60.0]]}),
        (PlanSettings, {"separate": ["kerr,moisture", ["kerr"]]}),
        (
            SweepSettings,
            {
                "schema": "fogml.sweep/1",
                "space": {"features": "T", "models": ["rbf"]},
                "objectives": "rms, bytes",
            },
        ),
    ],
)
def test_the_schema_takes_what_the_command_takes_and_writes(settings, values):
    jsonschema = pytest.importorskip("jsonschema")
    check = jsonschema.Draft202012Validator(settings.model_json_schema()).validate
    check(values)
    check(settings.model_validate(values).as_written())
