"""What features cost: time for a million samples, and libraries loaded."""

from __future__ import annotations

import subprocess
import sys
from time import perf_counter

import numpy as np

from fogml.features.parse import parse_features
from fogml.runs.run import Run


def test_a_million_samples_take_a_fraction_of_a_second() -> None:
    time = 0.1 * np.arange(1_000_000)
    temperature = 25.0 + np.cumsum(np.random.default_rng(2).normal(0.0, 1e-3, 1_000_000))
    run = Run(name="long", columns={"time": time, "gyro": time, "T": temperature})
    features = parse_features("T, dT, T*dT")
    took = []
    for _ in range(5):
        begin = perf_counter()
        features.transform(run)
        took.append(perf_counter() - begin)
    assert min(took) < 0.1


def test_the_default_features_load_no_heavy_library() -> None:
    code = (
        "import sys, numpy as np\n"
        "from fogml.features.parse import parse_features\n"
        "from fogml.runs.run import Run\n"
        "time = np.arange(500.0)\n"
        "features = parse_features('T, dT, T*dT').fit(Run.from_columns(time=time, gyro=time, T=time))\n"
        "features.stream(1.0, limited=True).step(0.0, {'T': 20.0})\n"
        "print(*sorted({'torch', 'sklearn', 'pandas', 'scipy', 'numba'} & set(sys.modules)))\n"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == ""
