"""The frame of the command line: help, version, errors as one message and an exit status."""

from __future__ import annotations

import errno
import json
import os
import pty
import select
import shutil
import signal
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner

import fogml
from fogml.cli import each_axis, main
from fogml.cli.docs_job import commands_of
from fogml.cli.settings import given_settings
from fogml.errors import InputError
from fogml.export.noise_parameters import TARGETS
from fogml.export.settings import ALL_TARGETS, DTYPES
from fogml.processes import Terminated

runner = CliRunner()


def use_command(monkeypatch, action):
    """Make every command do something else."""
    monkeypatch.setattr(each_axis, "load", lambda place: lambda settings, terminal: action())


def every_command():
    """Words and command of each, those of groups too."""
    return [(name.split()[1:], found) for name, found in commands_of(main.app, "fogml")]


def run_program(*arguments: str, **options):
    code = "from fogml.cli.main import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=60, **options
    )


def test_version():
    result = runner.invoke(main.app, ["--version"])
    assert result.exit_code == 0
    assert result.stdout.strip() == f"fogml {fogml.__version__}"


def test_help_lists_every_command():
    result = runner.invoke(main.app, ["--help"])
    assert result.exit_code == 0
    for name in main.COMMANDS:
        assert f"\n  {name} " in result.stdout


@pytest.mark.parametrize("name", main.COMMANDS)
def test_the_line_in_the_list_is_the_command_s_own(name):
    found = main.app.get_command(click.Context(main.app), name)
    assert found.help.splitlines()[0] == main.COMMANDS[name][1]


@pytest.mark.parametrize(("words", "found"), every_command())
def test_every_command_has_help_and_the_common_options(words, found):
    result = runner.invoke(main.app, [*words, "--help"])
    assert result.exit_code == 0
    # A blind suite's or a round's folder, and that of the page, is named first and holds everything.
    own_folder = words == ["app"] or (words[0] in ("blind", "benchmark") and words[-1] in ("make", "run"))
    for option in ("--config", "--seed", "--json", "--quiet", *(() if own_folder else ("--out",))):
        assert option in result.stdout


@pytest.mark.parametrize(("words", "found"), every_command())
def test_every_option_is_a_setting_with_help_and_in_the_schema(words, found):
    schema = json.loads(runner.invoke(main.app, [*words, "--schema"]).stdout)
    for key, given in given_settings(found.settings).items():
        assert schema["properties"][key]["description"] == given.help
    settings = set(found.settings.model_fields)
    for param in found.params:
        assert param.help
        assert param.name.partition("__")[0] in settings | {"config", "as_json", "quiet", "schema"}


@pytest.mark.parametrize("columns", [60, 80])
def test_help_breaks_between_words(columns, monkeypatch, capsys):
    """Names of files, options and values stay whole, in every command's help."""
    monkeypatch.setenv("COLUMNS", str(columns))
    for words, found in every_command():
        with pytest.raises(SystemExit):
            main.app([*words, "--help"], prog_name="fogml")
        told = capsys.readouterr().out
        assert max(map(len, told.splitlines())) <= columns
        texts = [found.help, *(param.help for param in found.params)]
        held = {word for text in texts for word in text.split() if len(word) <= columns // 3}
        assert held <= set(told.split())


def test_a_switch_tells_which_way_holds():
    told = " ".join(runner.invoke(main.app, ["train", "--help"]).stdout.split())
    assert "is in every result (no-repair)." in told and "met there (train-once)." in told
    assert "(next-run)." in " ".join(runner.invoke(main.app, ["diagnose", "--help"]).stdout.split())


@pytest.mark.parametrize(("name", "needed"), [("sweep", True), ("simulate", False)])
def test_what_may_be_left_out_stands_in_brackets(name, needed):
    usage = runner.invoke(main.app, [name, "--help"]).stdout.splitlines()[0]
    assert usage.endswith("[OPTIONS] CONFIG" if needed else "[OPTIONS] [CONFIG]")


def completions(words, begun):
    context = main.app.make_context("fogml", [*words, "--help"], resilient_parsing=True)
    found = main.app
    for word in words[:2]:
        if isinstance(found, main.Group):
            found = found.get_command(context, word)
    param = next(p for p in found.params if words[-1] in p.opts or p.metavar == words[-1])
    return {item.value for item in param.shell_complete(click.Context(found), begun)}


@pytest.mark.parametrize(
    ("words", "begun", "name"),
    [
        (["train", "--model"], "poly", "polynomial"),
        (["train", "RUN..."], "shipped:ring", "shipped:ring-laser-x"),
        (["diagnose", "--twin"], "nom", "nominal"),
        (["diagnose", "--without"], "shupe_m", "shupe_mohr"),
        (["import", "--profile"], "therm", "thermal-cycle-mems"),
        (["lab", "rate", "--twin"], "tac", "tactical"),
        (["lab", "north", "--way"], "drift", "drift-observing"),
        (["compare", "--models"], "mean,poly", "mean,polynomial"),
        (["plan", "--separate"], "shupe_trim,shupe_m", "shupe_trim,shupe_mohr"),
        (["blind", "run", "--method"], "ran", "random-forest"),
        (["train", "--axis"], "", "y"),
        (["docs", "[PAGE]"], "fir", "firmware"),
    ],
)
def test_names_complete_in_a_shell(words, begun, name):
    assert name in completions(words, begun)


def test_formats_that_complete_are_those_that_are_known():
    assert completions(["export", "--to"], "") == set(ALL_TARGETS)
    assert completions(["export", "--dtype"], "") == set(DTYPES)
    assert completions(["noise", "--to"], "") == set(TARGETS)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_gets_its_script(shell):
    script = runner.invoke(main.app, ["--completion", shell]).stdout
    assert f"_FOGML_COMPLETE={shell}_complete" in script
    assert ('string split -m 1 "," ' in script) == (shell == "fish")


def test_bash_completes_names_and_files(tmp_path):
    """An interactive bash, to which Tab is typed."""
    if shutil.which("bash") is None:
        pytest.skip("no bash")
    program = tmp_path / "fogml"
    program.write_text(f"#!{sys.executable}\nfrom fogml.cli.main import main\nmain()\n")
    program.chmod(0o755)
    (tmp_path / "own-run.csv").touch()
    script = runner.invoke(main.app, ["--completion", "bash"]).stdout
    (tmp_path / "rc").write_text(f"PATH={tmp_path}:$PATH\ncd {tmp_path}\n{script}\nPS1=ready\n")
    child, terminal = pty.fork()
    if child == 0:
        os.execvp("bash", ["bash", "--noprofile", "--rcfile", str(tmp_path / "rc"), "-i"])
    steps = [
        (b"", b"ready"),
        (b"fogml lab rate --twin tac\t", b"tical "),
        (b"\x15fogml inspect shipped:r\t", b"ing-laser-"),
        (b"x own-r\t", b"un.csv "),
        (b"\x15fogml compare --models mean,pol\t", b"ynomial "),
    ]
    try:
        for typed, answer in steps:
            os.write(terminal, typed)
            heard = b""
            while answer not in heard:
                assert select.select([terminal], [], [], 120.0)[0], (typed, heard)
                heard += os.read(terminal, 65536)
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(terminal)


def test_help_loads_nothing_heavy():
    code = (
        "import sys\nfrom fogml.cli.main import app\n"
        "try:\n    app(['--help'])\nexcept SystemExit:\n    pass\n"
        "heavy = {'torch', 'sklearn', 'pandas', 'plotly', 'scipy', 'pyarrow', 'numpy', 'pydantic'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert found.stderr.strip() == "[]"


def test_an_unknown_command_names_the_nearest():
    result = runner.invoke(main.app, ["trian"])
    assert result.exit_code == 2
    assert "did you mean 'train'?" in result.stderr
    result = runner.invoke(main.app, ["sing"])
    assert result.exit_code == 2
    assert "commands are demo" in result.stderr


def test_an_unknown_option_is_a_usage_error():
    result = runner.invoke(main.app, ["train", "--modle", "rbf"])
    assert result.exit_code == 2
    assert result.stderr.startswith("fogml: no such option '--modle'; did you mean '--model'")
    result = runner.invoke(main.app, ["--versoin"])
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert "did you mean '--version'?" in result.stderr


@pytest.mark.parametrize(
    ("option", "value", "told"),
    [("--averaging", "ten", "'ten' is no number"), ("--seed", "1.5", "'1.5' is no whole number")],
)
def test_what_is_no_number_is_told_without_a_type_of_python(option, value, told):
    result = runner.invoke(main.app, ["train", "a.csv", option, value])
    assert result.exit_code == 2
    assert f"invalid value for '{option}': {told}" in result.stderr


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (InputError("a.csv: column 'time' is missing"), "a.csv: column 'time' is missing"),
        (OSError(errno.ENOSPC, "No space left on device", "/tmp/x"), "/tmp/x: No space left on device"),
        (OSError(errno.EROFS, "Read-only", "out"), "out: Read-only; choose another place"),
        (OSError(errno.ENAMETOOLONG, "Too long", "out"), "out: Too long; choose a shorter name"),
        (PermissionError(errno.EACCES, "Permission denied", "out"), "out: Permission denied"),
        (MemoryError(), "not enough memory"),
        (UnicodeEncodeError("utf-8", "a\udcff.csv", 1, 2, "surrogates not allowed"), "no text in UTF-8"),
    ],
)
def test_errors_are_one_message_and_status_2(monkeypatch, error, message):
    def action():
        raise error

    use_command(monkeypatch, action)
    result = runner.invoke(main.app, ["simulate"])
    assert result.exit_code == 2
    assert result.stdout == ""
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_an_interrupt_is_status_130(monkeypatch):
    def action():
        raise KeyboardInterrupt

    use_command(monkeypatch, action)
    assert runner.invoke(main.app, ["simulate"]).exit_code == 130


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (AssertionError("a defect"), "AssertionError: a defect"),
        (TypeError("x" * 500 + "\nsecond line"), "TypeError: xxx"),
        (RecursionError("too deep"), "RecursionError: too deep"),
        (UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"), "UnicodeDecodeError"),
    ],
)
def test_what_nobody_expected_is_one_line_a_report_and_status_3(monkeypatch, tmp_path, error, told):
    def action():
        raise error

    use_command(monkeypatch, action)
    result = runner.invoke(main.app, ["simulate", "--out", str(tmp_path / "out")])
    assert result.exit_code == 3
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"fogml: unexpected error ({told}")
    (report,) = tmp_path.iterdir()
    assert f"report written to {report};" in line
    text = report.read_text()
    assert "Traceback" in text and fogml.__version__ in text and "command: fogml simulate --out" in text


def test_an_error_out_of_another_package_names_it(monkeypatch, tmp_path):
    made = {"__name__": "labkit.effects"}
    exec("def signature(): return {}['T']", made)
    monkeypatch.setattr("fogml.cli.unexpected.others", lambda: {"labkit": "lab-kit"})
    use_command(monkeypatch, made["signature"])
    result = runner.invoke(main.app, ["simulate", "--out", str(tmp_path / "out")])
    assert result.exit_code == 3
    assert "(KeyError: 'T') in lab-kit, which is no part of fogml" in result.stderr
    assert "to the makers of lab-kit" in result.stderr


def test_a_report_that_finds_no_room_beside_the_output_goes_to_the_temporary_files(monkeypatch, tmp_path):
    def action():
        raise AssertionError("a defect")

    use_command(monkeypatch, action)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    result = runner.invoke(main.app, ["simulate", "--out=missing/folder/out"])
    assert result.exit_code == 3
    assert [path.suffix for path in tmp_path.iterdir()] == [".txt"]


def test_termination_is_status_143(monkeypatch):
    def action():
        raise Terminated(signal.SIGTERM)

    use_command(monkeypatch, action)
    assert runner.invoke(main.app, ["simulate"]).exit_code == 143


SWALLOWED = """
import os, signal, sys
from fogml.cli import command, main
from fogml.errors import InputError

def do_job(settings, name, terminal):
    number, error = sys.argv[1], sys.argv[2]
    try:
        os.kill(os.getpid(), getattr(signal, number))
    except KeyboardInterrupt:
        pass
    with terminal.work("training") as work:
        if error == "none":
            work.advance()
    raise {"import": ImportError, "input": InputError, "none": AssertionError}[error]("a library's own words")

command.do_job = do_job
signal.signal(signal.SIGINT, signal.default_int_handler)  # a suite in the background ignores it
main.app = lambda prog_name, app=main.app: app(["docs"], prog_name=prog_name)
main.main()
"""


@pytest.mark.parametrize(
    ("name", "error", "status"),
    [("SIGTERM", "import", 143), ("SIGINT", "input", 130), ("SIGINT", "none", 130)],
)
def test_an_interrupt_that_a_library_makes_another_error_of_is_one(tmp_path, name, error, status):
    """Raised while an extension module loads it comes out as an ImportError: that was exit 3."""
    command = [sys.executable, "-c", SWALLOWED, name, error]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (status, "")
    assert done.stderr.startswith("fogml: interrupted:")
    assert not list(tmp_path.iterdir())


def test_the_program_runs():
    found = run_program("--version")
    assert (found.returncode, found.stderr) == (0, "")


def test_a_command_of_a_group_is_named_where_the_group_is_left_out():
    assert "no such command 'acceptance'; did you mean 'lab acceptance'?" in run_program("acceptance").stderr


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        (("allan",), "'noise'"),
        (("apply",), "'compensate'"),
        (("trian",), "'train'"),
        (("diagnose", "--holdout"), "'--held-out'"),
    ],
)
def test_what_a_word_may_mean_is_told_by_spelling_or_by_what_is_said_of_it(given, meant):
    assert f"; did you mean {meant}?" in run_program(*given).stderr


def test_no_option_is_offered_that_only_shares_its_dashes():
    assert "did you mean" not in run_program("diagnose", "--test").stderr
