"""``python -m experiments.benchmarks``: every job, results into this folder."""

from __future__ import annotations

import sys

from experiments.benchmarks.run import main

sys.exit(main())
