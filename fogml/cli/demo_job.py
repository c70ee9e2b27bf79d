"""The job of ``fogml demo``."""

from __future__ import annotations

from pathlib import Path

from fogml.cli.run_commands import DemoSettings
from fogml.cli.runs import open_runs
from fogml.cli.settings import SHIPPED
from fogml.cli.terminal import Terminal
from fogml.cli.train_job import TrainSettings, fit_and_judge, say_advice, write_results
from fogml.outputs import whole_folder
from fogml.validation.judge import judge
from fogml.validation.report_json import judgement_json
from fogml.validation.results import Judgement

AXES = ("x", "y", "z")
TRAINING_LEG, TEST_LEG = 2, 3
"""The leg up to 74 degC, and the last leg down."""
AVERAGED_ROWS = 20
CUBIC = "cubic in T"
"""What autopilots fit (ArduPilot and PX4), shown beside the default."""


def demo_and_write(settings: DemoSettings, terminal: Terminal) -> None:
    """Train and judge on three axes of the shipped thermal cycle, and write an index page."""
    judgements: dict[str, Judgement] = {}
    cubics: dict[str, Judgement] = {}
    with whole_folder(settings.out) as folder:
        with terminal.work("three axes", total=len(AXES)) as work:
            for axis in AXES:
                work.doing(f"axis {axis}")
                judgements[axis], cubics[axis] = _axis(folder / axis, axis, settings, Terminal(quiet=True))
                work.advance()
        from fogml.report.index_page import index_page

        page = index_page(judgements, title="A chamber cycle, three axes", beside={CUBIC: cubics})
        (folder / "index.html").write_text(page, encoding="utf-8")
        settings.write_into(folder, "demo")
    _print(judgements, cubics, settings, terminal)
    terminal.result(
        {
            "schema": "fogml.demo/1",
            "axes": {axis: judgement_json(judgement) for axis, judgement in judgements.items()},
        }
    )


def _axis(folder: Path, axis: str, settings: DemoSettings, terminal: Terminal) -> tuple[Judgement, Judgement]:
    """The judgement of the default on one axis, its results written, and of the cubic in T."""
    from fogml.models.names import make_model

    runs = [f"{SHIPPED}thermal-cycle-{leg}-{axis}" for leg in (TRAINING_LEG, TEST_LEG)]
    training, test = open_runs(runs[:1], terminal), open_runs(runs[1:], terminal)
    train_settings = TrainSettings(
        runs=runs[:1],
        test=runs[1:],
        averaging=round(AVERAGED_ROWS * test[0].sample_s, 6),
        seed=settings.seed,
        out=str(Path(settings.out) / axis),
    )
    model, judgement = fit_and_judge(train_settings, training, test, terminal)
    folder.mkdir()
    write_results(folder, train_settings, model, judgement, terminal)
    cubic = make_model("polynomial", "T^1..3").fit(training)
    averaging_s = train_settings.averaging
    return judgement, judge(cubic, training, test, averaging_s=averaging_s, beside=[model])


def _print(
    judgements: dict[str, Judgement],
    cubics: dict[str, Judgement],
    settings: DemoSettings,
    terminal: Terminal,
) -> None:
    from fogml.report.index_page import axes_table

    title = "A MEMS unit, trained going up, judged going down"
    terminal.show(axes_table(judgements, {CUBIC: cubics}), title)
    for axis, judgement in judgements.items():
        say_advice(judgement, terminal, f"Axis {axis}: ")
    for axis, judgement in judgements.items():
        for note in judgement.test[0].notes:
            terminal.say(f"{axis}: {note}")
            break
    terminal.say(f"Open {Path(settings.out) / 'index.html'} in a browser.")
