"""Constants of `fogml.gap.confidence` from a development suite that the diagnosis has answered.

``python -m experiments.gap_blind.calibrate DIR`` prints logistic constants of named effects over the
margin of their evidence, and of the unknown over its log odds. Final seeds are refused.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from sklearn.linear_model import LogisticRegression

from fogml.errors import InputError
from fogml.gap.blind.folders import BlindFolder
from fogml.gap.blind.seeds import is_final
from fogml.gap.blind.truth import Truth


def main() -> None:
    """Read answers and truths, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", nargs="+", help="answered development suites")
    named: list[tuple[float, bool]] = []
    unknown: list[tuple[float, bool]] = []
    for directory in parser.parse_args().directory:
        folder = BlindFolder(Path(directory))
        for path in sorted(folder.answers().glob("*/gap.json")):
            truth = Truth.model_validate_json((folder.truth / f"{path.parent.name}.json").read_text())
            if is_final(truth.seed):
                raise InputError(f"{directory}: made from a seed that is kept for final figures")
            _read(json.loads(path.read_text()), truth, named, unknown)
    for name, rows in (("NAMED", named), ("UNKNOWN", unknown)):
        constant, slope = _fitted(rows)
        print(f"{name} = ({constant:.2f}, {slope:.2f})   from {len(rows)} findings")


def _read(
    gap: dict, truth: Truth, named: list[tuple[float, bool]], unknown: list[tuple[float, bool]]
) -> None:
    known = {e.id for e in truth.effects if e.id and e.id not in truth.left_out}
    # Names where something is left out may be relatives: they are scored, not calibrated on.
    if not truth.left_out:
        named += [(item["margin"], bool(set(item["class"]) & known)) for item in gap["which"]]
    is_unknown = truth.kind.startswith("unknown")
    if truth.kind != "wrong_thermal":
        unknown.append((gap["unknown"]["log_odds"], is_unknown))


def _fitted(rows: list[tuple[float, bool]]) -> tuple[float, float]:
    x = np.clip([row[0] for row in rows], -30.0, 30.0)[:, None]
    fit = LogisticRegression(C=10.0).fit(x, [row[1] for row in rows])
    return float(fit.intercept_[0]), float(fit.coef_[0, 0])


if __name__ == "__main__":
    main()
