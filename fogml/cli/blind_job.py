"""The jobs of ``fogml blind``, and the reports of a suite's worst cases that its score links to."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.blind.folders import DIAGNOSIS, OUTCOME, BlindFolder, read_json
from fogml.cli.blind import MakeSettings, MergeSettings, RunSettings, ScoreSettings
from fogml.cli.terminal import Terminal, Work
from fogml.errors import InputError, counted
from fogml.json_files import write_json
from fogml.outputs import folder_to_fill, whole_file, whole_folder

if TYPE_CHECKING:
    from fogml.blind.run import RunPlan
    from fogml.blind.scoring.marks_file import Marks

_REPORTS = "reports"


def draw_reports(folder: BlindFolder, worst: list[dict[str, Any]], seed: int, terminal: Terminal) -> None:
    """Diagnose the worst cases once more, to draw their pages into the suite's folder ``reports``."""
    from fogml.blind.run import RunPlan, run_cases

    names = tuple(case["case"] for case in worst if case["verdict"] != "failed")
    method = "fogml.report.gap_page:diagnosis_with_page"
    reports = folder.path / _REPORTS
    for name in names:
        held, answer = (place / name / "gap.json" for place in (reports, folder.answers()))
        # A page of an answer that was given anew since is another one's.
        if held.is_file() and held.read_bytes() != answer.read_bytes():
            shutil.rmtree(held.parent)
    plan = RunPlan(folder, method, name=DIAGNOSIS, only=names, into=reports, retry=True, seed=seed)
    with terminal.work("drawing the worst cases", total=len(plan.left())) as work:
        run_cases(plan, lambda case: work.advance(doing=f"drawing {case}"))


def link_reports(values: dict[str, Any], folders: Sequence[Path], out: Path) -> None:
    """Say of each worst case where its report lies, relative to the folder `out` of the score.

    That is the diagnosis's page where it was drawn, else the answer, else None.

    Parameters
    ----------
    values
        Schema ``fogml.blind_score/1``; the cases' ``report`` is set.
    folders
        Of the suite's parts; those that are not there, as they may be on another machine, hold nothing.
    """
    for method, found in values["methods"].items():
        for case in found["worst"]:
            places = (_reports(BlindFolder(folder), method, case["case"]) for folder in folders)
            report = next((path for held in places for path in held if path.is_file()), None)
            case["report"] = report and Path(os.path.relpath(report, out)).as_posix()


def _reports(folder: BlindFolder, method: str, case: str) -> list[Path]:
    drawn = [folder.path / _REPORTS / case / "gap.html"] if method == DIAGNOSIS else []
    return [*drawn, *(folder.answers(method) / case / f"{name}.json" for name in ("gap", "outcome"))]


_BASELINES = "baselines"


def make_and_tell(settings: MakeSettings, terminal: Terminal) -> None:
    """Make cases, and say how many there are."""
    from fogml.blind.make import make_cases

    folder, kinds = settings.folder(), settings.kinds or None
    if settings.leave_one_out:
        if kinds:
            raise InputError("--leave-one-out and --kind exclude each other; give one of them")
        kinds = ["unknown_left_out"]
    with terminal.work("making cases", total=settings.count) as work:
        made = make_cases(
            folder.path,
            settings.count,
            settings.seed,
            sample_s=settings.sample,
            workers=settings.workers,
            kinds=kinds,
            progress=_counted(work, "made"),
            first=settings.first,
            least_d_prime=settings.least_d_prime,
            of=settings.reality,
            d_prime=settings.bounds,
        )
    if not settings.relatives_stay:
        from fogml.blind.relatives import leave_out_relatives

        with terminal.work("leaving out relatives") as work:
            leave_out_relatives(folder, settings.workers, _counted(work, "relatives of"))
    from fogml.blind.relatives import measure_forms

    with terminal.work("measuring forms") as work:
        measure_forms(folder, settings.workers, _counted(work, "forms of"))
    config = settings.in_full().yaml("blind make", "make.yaml")
    with whole_file(folder.path / "make.yaml") as partial:
        partial.write_text(config, encoding="utf-8")
    terminal.result({"directory": str(folder.path), "cases": settings.count, "made": made})
    terminal.say(
        f"{counted(settings.count, 'case')} in {folder.cases}, {made} of them new; answer them: "
        f"fogml blind run {settings.directory}"
    )


def _counted(work: Work, what: str) -> Callable[[int, int], None]:
    """Says how many of how many are done."""
    return lambda done, total: work.reached(done, total, f"{what} {done} of {total}")


def run_and_tell(settings: RunSettings, terminal: Terminal) -> None:
    """Answer cases by each method, and say how many failed."""
    from fogml.blind.methods import BASELINES, ORACLE
    from fogml.blind.run import RunPlan, run_cases, run_oracle

    methods = [m for name in settings.methods for m in (BASELINES if name == _BASELINES else (name,))]
    if len(methods) > 1 and settings.name:
        raise InputError("--name: the answers of several methods can't have one name")
    cost = {"cost_of_false_name": settings.cost_of_false_name}
    if settings.cost_of_false_name != 1.0 and DIAGNOSIS not in methods:
        raise InputError(f"--cost-of-false-name: no method but '{DIAGNOSIS}' takes it")

    def plan_of(method: str) -> RunPlan:
        return RunPlan(
            folder=settings.folder(),
            method=method,
            name=settings.name or (method if ":" not in method else method.partition(":")[2]),
            code=Path(settings.code) if settings.code else None,
            workers=settings.workers,
            threads=settings.threads,
            limit_s=settings.limit,
            shard=settings.part,
            retry=settings.retry,
            seed=settings.seed,
            options=cost if method == DIAGNOSIS else {},
        )

    config = settings.in_full().yaml("blind run", "run.yaml")
    answer(methods, plan_of, lambda method: run_oracle if method == ORACLE else run_cases, config, terminal)


def answer(
    methods: Sequence[str],
    plan_of: Callable[[str], RunPlan],
    run_of: Callable[[str], Callable[..., tuple[int, int]]],
    config: str,
    terminal: Terminal,
) -> None:
    """Answer cases by each method, leave the configuration beside the answers, and say how many failed."""
    told = {}
    for method in methods:
        plan = plan_of(method)
        with terminal.work(method, total=len(plan.left())) as work:

            def progress(case: str, work: Any = work, method: str = method) -> None:
                work.advance(doing=f"{method}: {case}")

            answered, failed = run_of(method)(plan, progress)
        with folder_to_fill(plan.answers), whole_file(plan.answers / "run.yaml") as partial:
            partial.write_text(config, encoding="utf-8")
        told[str(plan.name)] = {"answered": answered, "failed": failed}
        terminal.say(f"{method}: {counted(answered, 'case')} answered in {plan.answers}, {failed} failed")
        files = sorted(plan.answers.glob(f"*/{OUTCOME}")) if failed else []
        if lost := next((told for told in (read_json(file) for file in files) if not told["done"]), None):
            terminal.say(f"  case {lost['case']}: {lost['message']} (each says why in its {OUTCOME})")
    terminal.result(told)


def score_and_write(settings: ScoreSettings, terminal: Terminal) -> bool:
    """Score a suite, write ``score.json``, its page and its marks; whether every gate is met."""
    folder = settings.folder()
    methods = settings.methods or list(folder.methods())
    cases = len(folder.names())
    from fogml.blind.score import gate, gather
    from fogml.blind.scoring.values import score_values
    from fogml.report.blind_tables import headline

    ledger = Path(settings.ledger) if settings.final else None
    with terminal.work("scoring", total=cases) as work:
        marks = gather(
            folder, methods, ledger, lambda case: work.advance(doing=f"scored {case}"), settings.workers
        )
    values = score_values(marks, ledger)
    judged = headline(methods)
    values["gates"] = gate(values, settings.gates, judged)
    if judged == DIAGNOSIS:
        draw_reports(folder, values["methods"][judged]["worst"], settings.seed, terminal)
    out = Path(settings.out) if settings.out else folder.path
    link_reports(values, [folder.path], out)
    _write(out, values, marks, settings.in_full().yaml("blind score", "score.yaml"))
    _tell(out, values, judged, terminal)
    return all(one["met"] for one in values["gates"])


def merge_and_write(settings: MergeSettings, terminal: Terminal) -> None:
    """Score the parts of a suite as one, write ``score.json``, its page and its marks."""
    from fogml.blind.scoring.marks_file import merged
    from fogml.blind.scoring.values import score_values
    from fogml.report.blind_tables import headline

    assert settings.out
    marks = merged([Path(path) for path in settings.marks])
    values = score_values(marks, Path(settings.ledger) if settings.final else None)
    out = Path(settings.out)
    link_reports(values, [Path(path).parent for path in settings.marks], out)
    _write(out, values, marks, settings.in_full().yaml("blind merge", "score.yaml"))
    _tell(out, values, headline(marks.methods), terminal)


def _write(out: Path, values: Mapping[str, Any], marks: Marks, config: str) -> None:
    from fogml.blind.scoring.marks_file import MARKS, write_marks
    from fogml.report.blind_page import blind_page

    with whole_folder(out, shared=True) as staging:
        write_json(staging / "score.json", values, indent=1)
        (staging / "score.yaml").write_text(config, encoding="utf-8")
        (staging / "score.html").write_text(blind_page(values), encoding="utf-8")
        write_marks(staging / MARKS, marks)


def _tell(out: Path, values: dict[str, Any], judged: str, terminal: Terminal) -> None:
    _print(values, judged, terminal)
    terminal.result(values)
    terminal.say(f"Written to {out}: open {out / 'score.html'}")


def _print(values: dict[str, Any], method: str, terminal: Terminal) -> None:
    from fogml.report.blind_page import figures_table, gates_table
    from fogml.report.blind_tables import by_reality_table

    wanted = by_reality_table(values["methods"][method]["by_reality"])
    terminal.show(wanted, f"{method}: what is wanted, by reality")
    figures = figures_table(values["methods"][method]["rows"], values)
    terminal.show(figures, f"{method}: {values['cases']} blind cases (synthetic), seed {values['seed']}")
    terminal.show(gates_table(values["gates"]), "Gates")
