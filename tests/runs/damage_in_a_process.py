"""Reads a file of a binary format with bytes changed at random, over and over."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tests.runs.test_damage import read_in_every_way, sound_bytes

TRIALS = 50


def main(folder: Path, suffix: str) -> None:
    rng = np.random.default_rng(0)
    sound = sound_bytes(suffix, folder)
    messages = 0
    for trial in range(TRIALS):
        content = bytearray(sound)
        for _ in range(rng.integers(1, 4)):
            at = int(rng.integers(0, len(content)))
            how = rng.integers(0, 4)
            if how == 0:
                content[at] ^= 1 << int(rng.integers(0, 8))
            elif how == 1:
                content[at : at + 8] = rng.bytes(8)
            elif how == 2:
                del content[at : at + int(rng.integers(1, 200))]
            elif trial % 4 == 0:
                del content[at:]
        path = folder / f"bad{suffix}"
        path.write_bytes(bytes(content))
        messages += read_in_every_way(path) is not None
    print(f"{messages} messages in {TRIALS} trials")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
