"""Every job, in the order of the page."""

from __future__ import annotations

from experiments.benchmarks.command_jobs import COMMAND_JOBS
from experiments.benchmarks.compensation_jobs import COMPENSATION_JOBS
from experiments.benchmarks.harness import Job
from experiments.benchmarks.numeric_jobs import NUMERIC_JOBS
from experiments.benchmarks.twin_jobs import TWIN_JOBS

JOBS: tuple[Job, ...] = (*NUMERIC_JOBS, *TWIN_JOBS, *COMMAND_JOBS, *COMPENSATION_JOBS)
