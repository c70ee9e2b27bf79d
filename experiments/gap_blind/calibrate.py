"""Constants of `fogml.gap.confidence` from suites that the diagnosis has answered.

``python -m experiments.gap_blind.calibrate PATH ...`` prints logistic constants of named effects over the
features of their evidence, where all that acts is known and beside an unknown, and of the unknown over its
log odds and the number of names. A path is a suite with its answers, or a file of marks as ``fogml blind
score`` writes it, which holds all that is needed.
Suites are those to develop on, and final ones that are spent: figures were taken from them, and
``config.yaml`` keeps another seed for the next ones.

Probabilities are to hold in the mix. Cases drawn by their kind or strength beside it tell how evidence
grows, but not how often there is an effect or an unknown at all: ``--beside`` lets them weigh less. The mix
has few findings beside an unknown, and their weight is one by itself: ``--beside-unknown``.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
from sklearn.linear_model import LogisticRegression

from fogml.blind.folders import DIAGNOSIS, BlindFolder
from fogml.blind.scoring.answers import read_answer
from fogml.blind.scoring.marks import Mark, mark
from fogml.blind.scoring.marks_file import read_marks
from fogml.blind.seeds import is_final, uses
from fogml.blind.truth import read_truth
from fogml.errors import InputError
from fogml.gap.confidence import unknown_features
from fogml.yaml_text import read_yaml

HERE = Path(__file__).parent
Row = tuple[tuple[float, ...], bool, float]
"""Features of a finding, whether it is right, and its weight."""


def main() -> None:
    """Read answers and truths, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", nargs="+", type=Path, help="answered suites, or files of their marks")
    parser.add_argument("--answers", default=DIAGNOSIS, help="name of the answers")
    parser.add_argument("--beside", type=float, default=1.0, help="weight of cases beside the mix, from 0")
    parser.add_argument(
        "--beside-unknown", type=float, default=1.0, help="the same of findings beside an unknown"
    )
    args = parser.parse_args()
    rows: dict[str, list[Row]] = {"NAMED": [], "NAMED_BESIDE_UNKNOWN": [], "UNKNOWN": []}
    beside = {"NAMED": args.beside, "NAMED_BESIDE_UNKNOWN": args.beside_unknown, "UNKNOWN": args.beside}
    for path in args.path:
        for one in marks_of(path, args.answers):
            if not may_be_learned_from(one.truth.seed):
                raise InputError(f"{path}: made from a seed that is kept for final figures")
            for name, features, right in _findings(path, one):
                rows[name].append((features, right, 1.0 if one.truth.mix else beside[name]))
    for name, found in rows.items():
        if found:
            print(f"{name} = ({', '.join(f'{c:.2f}' for c in _fitted(found))})   from {len(found)} findings")


def marks_of(path: Path, answers: str) -> Iterable[Mark]:
    """The marks of a suite's answers, or of a file; relatives are known to a file alone.

    Raises
    ------
    InputError
        If there are none.
    """
    if path.is_file():
        found = read_marks(path).methods.get(answers)
        if not found:
            raise InputError(f"{path}: holds no marks of '{answers}'")
        return found
    folder = BlindFolder(path)
    answered = sorted(outcome.parent for outcome in folder.answers(answers).glob("*/gap.json"))
    if not answered:
        raise InputError(f"{path}: no answers; run the diagnosis first: fogml blind run {path}")
    return (mark(read_truth(folder.truth / f"{one.name}.json"), read_answer(one)) for one in answered)


@cache
def may_be_learned_from(seed: int) -> bool:
    """Whether a suite's seed is one to develop on, or one that is kept no longer."""
    kept = read_yaml(HERE / "config.yaml")["final"]["seed"]
    spent = {use["seed"] for use in uses(HERE / "final_uses.json")} - {kept}
    return not is_final(seed) or seed in spent


def _findings(path: Path, one: Mark) -> Iterator[tuple[str, tuple[float, ...], bool]]:
    """Which constants each finding of a case tells of, its features, and whether it is right."""
    if one.failure:
        return
    for item in (*one.items, *one.suspected):
        if item.support is None:
            raise InputError(f"{path}: case {one.truth.case} has names without support; answer it anew")
        # At no margin the best explanation does without it, and it is not named whatever the constants are.
        if item.support.margin > 0.0:
            name = "NAMED_BESIDE_UNKNOWN" if item.support.beside_unknown else "NAMED"
            yield name, item.support.features, item.right
    if one.truth.kind != "wrong_thermal" and one.log_odds is not None:
        features = unknown_features(one.log_odds, len(one.named))
        yield "UNKNOWN", features, one.truth.kind.startswith("unknown")


def _fitted(rows: list[Row]) -> list[float]:
    """Logistic constants with a ridge, that of features scaled to what they vary by."""
    if len({right for _, right, _ in rows}) < 2:
        raise InputError("there are not both right and wrong findings; give more cases")
    features, right, weights = zip(*rows)
    scale = np.std(features, axis=0)
    scale[scale == 0.0] = 1.0
    fit = LogisticRegression(C=1.0, max_iter=2000).fit(features / scale, right, sample_weight=weights)
    return [float(fit.intercept_[0]), *map(float, fit.coef_[0] / scale)]


if __name__ == "__main__":
    main()
