"""What features cost at the start: libraries loaded."""

from __future__ import annotations

import subprocess
import sys


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
