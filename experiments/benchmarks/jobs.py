"""Every job and every study, in the order of the page."""

from __future__ import annotations

from experiments.benchmarks.accuracy import ACCURACY_STUDIES
from experiments.benchmarks.all_rows import ALL_ROWS_STUDY
from experiments.benchmarks.allan_jobs import ALLAN_JOBS
from experiments.benchmarks.command_jobs import COMMAND_JOBS
from experiments.benchmarks.compensation_jobs import COMPENSATION_JOBS
from experiments.benchmarks.compensation_study import COMPENSATION_STUDIES
from experiments.benchmarks.diagnosis import DIAGNOSIS_STUDIES
from experiments.benchmarks.feature_jobs import FEATURE_JOBS
from experiments.benchmarks.file_jobs import FILE_JOBS
from experiments.benchmarks.harness import Job
from experiments.benchmarks.limits import LIMIT_STUDIES
from experiments.benchmarks.numeric_jobs import NUMERIC_JOBS
from experiments.benchmarks.study import Study
from experiments.benchmarks.training import TRAINING_STUDIES
from experiments.benchmarks.twin_jobs import TWIN_JOBS

JOBS: tuple[Job, ...] = (
    *NUMERIC_JOBS,
    *FILE_JOBS,
    *FEATURE_JOBS,
    *ALLAN_JOBS,
    *TWIN_JOBS,
    *COMMAND_JOBS,
    *COMPENSATION_JOBS,
)
STUDIES: tuple[Study, ...] = (
    *ACCURACY_STUDIES,
    *TRAINING_STUDIES,
    ALL_ROWS_STUDY,
    *COMPENSATION_STUDIES,
    *DIAGNOSIS_STUDIES,
    *LIMIT_STUDIES,
)
