"""What sweeps and fleets tell MLflow, where that is asked for: a run of it for each trial and each unit.

Nothing depends on it: results stand in their own files, and a tracker that is away costs a note. A trial or
unit that was told before is known by a tag, so that a command that goes on doubles none.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import urlsplit, urlunsplit

from fogml.errors import InputError, install_words

KEY = "fogml.key"
"""Tag that tells a trial or unit from every other."""
_LONGEST = 500
"""Characters of a parameter's value, which MLflow bounds."""
_QUIET = {
    # MLflow tells its makers of its use unless told not to; fogml's promise is that nothing goes anywhere.
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "DO_NOT_TRACK": "true",
    # Its notes on tables it makes are none of the command's.
    "MLFLOW_LOGGING_LEVEL": "WARNING",
    # A server that is away is not worth minutes.
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "1",
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "10",
    # Who names a folder wants one.
    "MLFLOW_ALLOW_FILE_STORE": "true",
}


def shown_tracker(place: str) -> str:
    """A tracker's address without user and password."""
    parts = urlsplit(place)
    if not parts.netloc:
        return place
    return urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2]))


class Tracker:
    """An experiment of MLflow.

    Parameters
    ----------
    place
        Its tracking address: ``http://host:5000``, ``sqlite:///mlflow.db``, or a folder.
    experiment
        Name of the experiment, made where it is not there yet.
    note
        Told in a sentence once the tracker does not answer; from then on it is left alone.

    Raises
    ------
    InputError
        If MLflow is not installed.
    """

    def __init__(self, place: str, experiment: str, note: Callable[[str], None]) -> None:
        for name, value in _QUIET.items():
            os.environ.setdefault(name, value)
        try:
            from mlflow import MlflowClient
        except ImportError as error:
            raise InputError(f"--track needs MLflow ({error}): {install_words('mlflow')}") from None
        self._place, self._note, self._away = place, note, False
        self._client: Any = None
        self._known: set[str] = set()
        self._experiment = ""
        self._try(lambda: self._open(MlflowClient(tracking_uri=place), experiment))

    def _open(self, client: Any, name: str) -> None:
        found = client.get_experiment_by_name(name)
        self._experiment = client.create_experiment(name) if found is None else found.experiment_id
        page = None
        while True:
            runs = client.search_runs([self._experiment], page_token=page)
            self._known |= {run.data.tags[KEY] for run in runs if KEY in run.data.tags}
            page = runs.token
            if not page:
                break
        self._client = client

    def log(
        self,
        key: str,
        name: str,
        parameters: Mapping[str, Any],
        metrics: Mapping[str, float | None],
        tags: Mapping[str, str],
    ) -> None:
        """Tell of a trial or a unit, unless it was told before.

        Parameters
        ----------
        key
            What tells it from every other, and from itself with other runs or settings.
        name
            For people.
        parameters, metrics, tags
            What MLflow shows; metrics that are no number are left out.
        """
        if key in self._known:
            return

        def tell() -> None:
            run = self._client.create_run(self._experiment, run_name=name).info.run_id
            for parameter, value in parameters.items():
                self._client.log_param(run, parameter, str(value)[:_LONGEST])
            for metric, number in metrics.items():
                if number is not None and math.isfinite(number):
                    self._client.log_metric(run, metric, float(number))
            for tag, text in tags.items():
                self._client.set_tag(run, tag, text)
            # Last: what was told by half is told again.
            self._client.set_tag(run, KEY, key)
            self._client.set_terminated(run)
            self._known.add(key)

        self._try(tell)

    def _try(self, action: Callable[[], None]) -> None:
        if self._away:
            return
        try:
            action()
        except Exception as error:
            # Whatever a tracker runs into, the results stand in their files.
            self._away = True
            told = str(error).strip().partition("\n")[0]
            user, at, _ = urlsplit(self._place).netloc.rpartition("@")
            # MLflow's own messages quote the address whole.
            told = told.replace(user + at, "") if at else told
            self._note(
                f"--track {shown_tracker(self._place)}: does not answer ({told}); results are kept here"
            )
