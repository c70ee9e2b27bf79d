"""Constants of `fogml.gap.confidence` from a development suite that the diagnosis has answered.

``python -m experiments.gap_blind.calibrate DIR`` prints logistic constants of named effects over the
features of their evidence, and of the unknown over its log odds. Final seeds are refused.
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
from fogml.gap.confidence import LARGEST_LOG_ODDS, named_features

Row = tuple[tuple[float, ...], bool]
"""Features of a finding, and whether it is right."""


def main() -> None:
    """Read answers and truths, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", nargs="+", help="answered development suites")
    named: list[Row] = []
    unknown: list[Row] = []
    for directory in parser.parse_args().directory:
        folder = BlindFolder(Path(directory))
        answers = sorted(folder.answers().glob("*/gap.json"))
        if not answers:
            raise SystemExit(f"{directory}: no answers; run the diagnosis first: fogml blind run {directory}")
        for path in answers:
            truth = Truth.model_validate_json((folder.truth / f"{path.parent.name}.json").read_text())
            if is_final(truth.seed):
                raise InputError(f"{directory}: made from a seed that is kept for final figures")
            _read(json.loads(path.read_text()), truth, named, unknown)
    for name, rows in (("NAMED", named), ("UNKNOWN", unknown)):
        print(f"{name} = ({', '.join(f'{c:.2f}' for c in _fitted(rows))})   from {len(rows)} findings")


def _read(gap: dict, truth: Truth, named: list[Row], unknown: list[Row]) -> None:
    for item in gap["which"]:
        if item["margin"] <= 0.0:
            # The best explanation does without it, and it is not named whatever the constants are.
            continue
        features = named_features(item["margin"], item["form_share"], item["rest"], item["length"])
        named.append((features, bool(set(item["class"]) & truth.right_names)))
    if truth.kind != "wrong_thermal":
        odds = float(np.clip(gap["unknown"]["log_odds"], -LARGEST_LOG_ODDS, LARGEST_LOG_ODDS))
        unknown.append(((odds,), truth.kind.startswith("unknown")))


def _fitted(rows: list[Row]) -> list[float]:
    fit = LogisticRegression(C=1.0, max_iter=1000).fit([f for f, _ in rows], [right for _, right in rows])
    return [float(fit.intercept_[0]), *map(float, fit.coef_[0])]


if __name__ == "__main__":
    main()
