"""Constants of `fogml.gap.confidence` from suites that the diagnosis has answered.

``python -m experiments.gap_blind.calibrate DIR`` prints logistic constants of named effects over the
features of their evidence, and of the unknown over its log odds and the number of names. Suites are those
to develop on, and final ones that are spent: figures were taken from them, and ``config.yaml`` keeps
another seed for the next ones.

Probabilities are to hold in the mix. Cases drawn by their kind or strength beside it tell how evidence
grows, but not how often there is an effect or an unknown at all: ``--beside`` lets them weigh less.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import fields
from functools import cache
from pathlib import Path

import yaml
from sklearn.linear_model import LogisticRegression

from fogml.errors import InputError
from fogml.gap.blind.folders import DIAGNOSIS, BlindFolder
from fogml.gap.blind.seeds import is_final, uses
from fogml.gap.blind.truth import Truth
from fogml.gap.confidence import Support, unknown_features
from fogml.gap.result import NAMED

HERE = Path(__file__).parent
Row = tuple[tuple[float, ...], bool, float]
"""Features of a finding, whether it is right, and its weight."""


def main() -> None:
    """Read answers and truths, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", nargs="+", help="answered development suites, or spent final ones")
    parser.add_argument("--answers", default=DIAGNOSIS, help="name of the answers")
    parser.add_argument("--beside", type=float, default=1.0, help="weight of cases beside the mix, from 0")
    args = parser.parse_args()
    named: list[Row] = []
    unknown: list[Row] = []
    for directory in args.directory:
        folder = BlindFolder(Path(directory))
        answers = sorted(folder.answers(args.answers).glob("*/gap.json"))
        if not answers:
            raise SystemExit(f"{directory}: no answers; run the diagnosis first: fogml blind run {directory}")
        for path in answers:
            truth = Truth.model_validate_json((folder.truth / f"{path.parent.name}.json").read_text())
            if not may_be_learned_from(truth.seed):
                raise InputError(f"{directory}: made from a seed that is kept for final figures")
            weight = 1.0 if truth.mix else args.beside
            try:
                _read(json.loads(path.read_text()), truth, weight, named, unknown)
            except KeyError as error:
                raise InputError(f"{path}: an older diagnosis's, without {error}; answer it again") from error
    for name, rows in (("NAMED", named), ("UNKNOWN", unknown)):
        print(f"{name} = ({', '.join(f'{c:.2f}' for c in _fitted(rows))})   from {len(rows)} findings")


@cache
def may_be_learned_from(seed: int) -> bool:
    """Whether a suite's seed is one to develop on, or one that is kept no longer."""
    kept = yaml.safe_load((HERE / "config.yaml").read_text(encoding="utf-8"))["final"]["seed"]
    spent = {use["seed"] for use in uses(HERE / "final_uses.json")} - {kept}
    return not is_final(seed) or seed in spent


def _read(gap: dict, truth: Truth, weight: float, named: list[Row], unknown: list[Row]) -> None:
    for item in gap["which"]:
        if item["margin"] <= 0.0:
            # The best explanation does without it, and it is not named whatever the constants are.
            continue
        support = Support(**{field.name: item[field.name] for field in fields(Support)})
        named.append((support.features, bool(set(item["class"]) & truth.right_names), weight))
    if truth.kind != "wrong_thermal":
        names = sum(item["probability"] >= NAMED for item in gap["which"])
        features = unknown_features(gap["unknown"]["log_odds"], names)
        unknown.append((features, truth.kind.startswith("unknown"), weight))


def _fitted(rows: list[Row]) -> list[float]:
    features, right, weights = zip(*rows)
    fit = LogisticRegression(C=1.0, max_iter=2000).fit(features, right, sample_weight=weights)
    return [float(fit.intercept_[0]), *map(float, fit.coef_[0])]


if __name__ == "__main__":
    main()
