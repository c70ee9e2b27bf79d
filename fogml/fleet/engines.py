"""What runs a fleet's tasks: this process, loky's processes here, a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, as_completed
from pathlib import Path
from secrets import token_hex
from typing import Any

from fogml.errors import InputError, first_line, install_words
from fogml.fleet.tasks import Task, finished, lost, run_task
from fogml.folders import nearest_folder
from fogml.outputs import settle
from fogml.processes import one_thread, worker_pool
from fogml.settings_check import check_whole

Outcome = dict[str, Any]
Progress = Callable[[Outcome], None]
_ANSWER_S = 10
_SUSPECTS_EACH = 2
# Units for each worker that a broken pool may have been at: the first that are left, as they begin in turn.


def run_tasks(
    tasks: Sequence[Task],
    *,
    workers: int = 1,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> list[Outcome]:
    """Run every task that is not done yet; outcomes in the order of the tasks.

    Parameters
    ----------
    tasks
        What to do.
    workers
        Processes on this machine; with one, tasks run in this process.
    cluster
        Address of a Dask scheduler, ``tcp://host:port``; its workers do the tasks, and need the
        runs and the fleet's folder at the same paths.
    progress
        Called with each outcome as it comes.

    Raises
    ------
    InputError
        If the cluster does not answer, or the disk is full; finished units are kept.
    """
    check_whole("workers", workers, 1)
    told = progress or (lambda outcome: None)
    outcomes: dict[str, Outcome] = {}

    def keep(task: Task, outcome: Outcome) -> None:
        outcomes[task.unit.folder] = outcome
        told(outcome)

    todo = []
    for task in tasks:
        known = finished(task)
        if known is None:
            todo.append(task)
        else:
            keep(task, known)
    if cluster is not None:
        _on_cluster(todo, cluster, keep)
    elif workers == 1:
        with one_thread():
            for task in todo:
                keep(task, run_task(task))
    else:
        _in_processes(todo, min(workers, max(len(todo), 1)), keep)
    return [outcomes[task.unit.folder] for task in tasks]


def _in_processes(tasks: Sequence[Task], workers: int, keep: Callable[[Task, Outcome], None]) -> None:
    """Run tasks in processes; one that ends its process is found, and the rest go on."""
    left = {task.unit.folder: task for task in tasks}

    def run(some: Sequence[Task], processes: int) -> bool:
        from joblib.externals.loky.process_executor import BrokenProcessPool

        with worker_pool(processes) as pool:
            futures: dict[Future[Outcome], Task] = {}
            unbroken = True
            try:
                for task in some:
                    futures[pool.submit(run_task, task)] = task
            except BrokenProcessPool:
                unbroken = False
            try:
                for future in as_completed(futures):
                    task = futures[future]
                    try:
                        outcome = future.result()
                    except BrokenProcessPool:
                        # Others that were done before are still to be told of.
                        unbroken = False
                        continue
                    del left[task.unit.folder]
                    keep(task, outcome)
            except InputError:
                # What others are writing comes to its end: killed, they would leave it half-written.
                for future in futures:
                    future.cancel()
                pool.shutdown(wait=True)
                raise
        return unbroken

    try:
        while left and not run(list(left.values()), workers):
            # One by one, to find the one that breaks them; the rest then go on side by side.
            for task in list(left.values())[: _SUSPECTS_EACH * workers]:
                if not run([task], 1):
                    del left[task.unit.folder]
                    keep(task, lost(task, "ended its process: out of memory, or killed"))
    finally:
        # What workers that were ended had begun to write: above the home, too, where it was not there yet.
        homes = {Path(task.home) for task in tasks}
        above = {nearest_folder(home.parent) for home in homes}
        for place in homes | above | {task.folder for task in tasks}:
            settle(place)


def _on_cluster(tasks: Sequence[Task], address: str, keep: Callable[[Task, Outcome], None]) -> None:
    if not tasks:
        return
    try:
        from distributed import Client
        from distributed import as_completed as completed_on
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise InputError(f"a cluster needs Dask: {install_words('cluster')}") from None
    try:
        client = Client(address, timeout=_ANSWER_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"--cluster {address}: does not answer ({first_line(error)}); start it with 'dask scheduler' "
            "and 'dask worker', or leave --cluster out"
        ) from None
    with client:
        # Tasks have effects: each is its own, and none may be taken for another.
        futures = {
            client.submit(run_task, task, key=f"fogml-{task.unit.folder}-{token_hex(8)}", pure=False): task
            for task in tasks
        }
        for future in completed_on(list(futures), loop=client.loop, raise_errors=False):
            task = futures[future]
            try:
                outcome = future.result()
            except InputError:
                raise
            except KilledWorker:
                outcome = lost(task, "ended several workers: out of memory, or killed")
            except Exception as error:
                raise InputError(
                    f"--cluster {address}: stopped answering ({first_line(error)}); finished units are "
                    "kept, run the command again"
                ) from error
            keep(task, outcome)
            # The outcome is on disk: a worker that dies later takes nothing along.
            future.release()
