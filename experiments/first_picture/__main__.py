"""The picture of the README: a real thermal cycle before and after compensation (MEMS).

``python -m experiments.first_picture`` writes ``docs/pictures/first-model.svg``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import fogml
from fogml.arrays import FloatArray
from fogml.outputs import whole_file
from fogml.pictures import Curve, line_figure
from fogml.report import style

PICTURE = Path(__file__).parents[2] / "docs" / "pictures" / "first-model.svg"
AXIS, TRAINING_LEG, TEST_LEG = "y", 2, 3
AVERAGING_S = 10.0


def _binned(x: FloatArray, y: FloatArray, bins: int = 150) -> tuple[FloatArray, FloatArray]:
    """Means of y over even bins of x."""
    place = np.digitize(x, np.linspace(x.min(), x.max(), bins + 1)[1:-1])
    held = np.unique(place)
    return (np.array([v[place == k].mean() for k in held]) for v in (x, y))  # type: ignore[return-value]


def main() -> None:
    """Train on one leg, judge on another, draw drift against temperature."""
    training, test = (fogml.shipped_run(f"thermal-cycle-{leg}-{AXIS}") for leg in (TRAINING_LEG, TEST_LEG))
    model = fogml.make_model("auto").fit(training)
    judgement = fogml.judge(model, training, test, averaging_s=AVERAGING_S)
    (fitted,), (judged,) = judgement.train, judgement.test
    curves = [
        Curve(*_binned(series.temperature, values), colour, width=1.8, label=label)
        for series, values, colour, label in (
            (fitted.series, fitted.series.before, style.GREY, "run trained on"),
            (
                judged.series,
                judged.series.before,
                style.BLUE,
                f"run judged on: rms {judged.before.rms:.1f} deg/h",
            ),
            (
                judged.series,
                judged.series.after,
                style.ORANGE,
                f"compensated: rms {judged.after.rms:.1f} deg/h",
            ),
        )
    ]
    figure = line_figure(
        curves,
        "temperature [°C]",
        "drift [deg/h]",
        f"Drift of a MEMS gyro against temperature, {judged.before.rms:.1f} deg/h rms before and "
        f"{judged.after.rms:.1f} deg/h after compensation, noise floor {judged.floor:.2f} deg/h",
        width=720,
        height=300,
    )
    # White also where the page about it is dark.
    picture = str(figure).replace("<svg ", '<svg style="background:#fff" ', 1)
    with whole_file(PICTURE) as partial:
        partial.write_text(picture + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
