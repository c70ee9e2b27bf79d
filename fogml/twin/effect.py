"""The effect: one declaration that simulator, diagnosis, documentation and tests all read."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, known_are
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Grade, Quantity

if TYPE_CHECKING:
    from fogml.twin.plant.network import ThermalNetwork

SET_UP = ("rate", "angle", "earth", "powered_on", "facts", "output", "slopes")
"""What an effect may need beside temperatures and drives; `angle` is that of `Inputs.angle_deg`.

With the angle goes the rate, which tells its whole turns.
"""
Stage = Literal["thermal", "rig", "bias", "scale_factor", "loop", "readout", "sensor", "logger", "noise"]
STAGES: tuple[Stage, ...] = get_args(Stage)


class Effect(ABC):
    """An entry of the catalogue. The docstring of each class states its equation and source.

    Attributes
    ----------
    id, code, title
        Name that configurations and reports use, that of the class, ``sensor_lag`` of ``SensorLag``, unless
        it is stated; letter code; a few words.
    stage
        Where in the chain it acts.
    amplitude
        The linear coefficient of the equation.
    shape
        Parameters that the response is not linear in.
    needs
        What the signature asks of `Inputs`, beside time: temperatures, drives, names of `SET_UP`.
        Nothing else may change it.
    conflicts
        Ids that can't be on at the same time.
    sources
        Where equation and ranges come from.
    shows
        Where in a recording it shows.
    shown_on
        What its picture is drawn on: a name of `fogml.twin.scenes.scene_names`.
    confused_with
        Id of a look-alike to what separates the two.
    candidate
        Whether a diagnosis offers it unless told otherwise.
    told_by
        Columns without whose changes a run can't tell the effect from others: of each group one has to be
        recorded to change.
    amplitudes
        Of an effect whose response is not in proportion to its amplitude, amplitudes about which a
        diagnosis takes it; the signature is then the one about the usual amplitude.
    drawn_per_run
        Whether the amplitude is another one each time that the unit is used: then repeats of one
        unit draw it anew.
    family
        All that it can do in a diagnosis: a name of `fogml.gap.catalogue.FAMILIES`; ``signature`` is
        its own signature over a grid of its shapes.
    place
        Where it sits: what temperature drives it, and where to look for it.
    digitises
        Whether it acts on the number that is read, behind a sensor's lag and noise.
    compensated_by
        Of family ``signature``: features of a drift model that hold it, as text with names of its shape in
        braces, ``lag(T, {time_constant:g} s)``; `fogml train --from-diagnosis` fits them.
    seeded
        Whether a simulation draws what differs each time itself, from its seed: then repeats leave the
        amplitude alone, and a replay, which can't know the draw, has what is expected of it.
    """

    id: ClassVar[str]
    code: ClassVar[str]
    title: ClassVar[str]
    stage: ClassVar[Stage]
    amplitude: ClassVar[Quantity]
    shape: ClassVar[tuple[Quantity, ...]] = ()
    needs: ClassVar[tuple[str, ...]] = ()
    conflicts: ClassVar[tuple[str, ...]] = ()
    sources: ClassVar[tuple[str, ...]] = ()
    shows: ClassVar[str] = ""
    shown_on: ClassVar[str] = "separating"
    confused_with: ClassVar[Mapping[str, str]] = {}
    candidate: ClassVar[bool] = True
    told_by: ClassVar[tuple[tuple[str, ...], ...]] = ()
    amplitudes: ClassVar[tuple[float, ...]] = ()
    drawn_per_run: ClassVar[bool] = False
    seeded: ClassVar[bool] = False
    family: ClassVar[str] = "signature"
    place: ClassVar[str] = ""
    compensated_by: ClassVar[tuple[str, ...]] = ()
    digitises: ClassVar[bool] = False

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if "id" not in vars(cls):
            cls.id = re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()

    @abstractmethod
    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per unit of amplitude, shape (n,): ppm for scale factor effects, else deg/h."""

    def in_hindsight(self, inputs: Inputs, **shape: float) -> FloatArray:
        """The signature on a whole recorded run, where what came later may tell more; shape (n,)."""
        return self.signature(inputs, **shape)

    def response(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Change of the gyro's output [deg/h] on a whole run per unit of amplitude, shape (n,)."""
        return self.in_hindsight(inputs, **shape)

    @property
    def in_proportion(self) -> bool:
        """Whether the output changes in proportion to the amplitude."""
        return True

    def change(self, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """Change of the gyro's output [deg/h] on a whole run at an amplitude, shape (n,)."""
        return amplitude * self.response(inputs, **shape)

    def default_shape(self, grade: Grade = "tactical") -> dict[str, float]:
        """Shape parameters in the middle of a grade's range."""
        return {parameter.name: parameter.typical(grade) for parameter in self.shape}

    def checked(self, values: Mapping[str, Any]) -> tuple[float, dict[str, float]]:
        """Amplitude and shape from a mapping such as a twin file's.

        Shape parameters that are not stated take their tactical middle.
        """
        owner = f"effect '{self.id}'"
        known = {"amplitude": self.amplitude, **{p.name: p for p in self.shape}}
        for key in values:
            if key not in known:
                raise InputError(f"{owner}: unknown key '{key}'; {known_are(key, known, 'known keys')}")
        if "amplitude" not in values:
            raise InputError(f"{owner}: 'amplitude' [{self.amplitude.unit}] is missing")
        shape = self.default_shape() | {
            key: known[key].check(value, owner) for key, value in values.items() if key != "amplitude"
        }
        return self.amplitude.check(values["amplitude"], owner), shape


class BiasEffect(Effect):
    """Adds to the bias [deg/h]."""

    stage: ClassVar[Stage] = "bias"


class RigEffect(Effect):
    """Adds to the rate about the input axis [deg/h], before the scale factor.

    `signature` is what it adds per unit of a small amplitude; one that is not linear in its amplitude
    states all of it in `added_rate`.
    """

    stage: ClassVar[Stage] = "rig"

    def added_rate(
        self, signature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What it adds to the rate about the input axis [deg/h], shape (n,), given its signature there."""
        return amplitude * signature

    @property
    def in_proportion(self) -> bool:
        return type(self).added_rate is RigEffect.added_rate

    def change(self, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        return self.added_rate(self.response(inputs, **shape), inputs, amplitude, **shape)


class ScaleFactorEffect(Effect):
    """Adds to the scale factor error [ppm]."""

    stage: ClassVar[Stage] = "scale_factor"

    def response(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Change of the gyro's output [deg/h] per unit of amplitude, shape (n,)."""
        return 1e-6 * inputs.input_rate_deg_h * self.in_hindsight(inputs, **shape)


class LoopEffect(Effect):
    """Distorts the rate that the closed loop gives; `signature` reads ``inputs.output``."""

    stage: ClassVar[Stage] = "loop"

    def apply(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The loop's output [deg/h] for an undistorted `output` [deg/h], both of shape (n,)."""
        return output + amplitude * self.signature(inputs.with_output(output), **shape)

    @property
    def in_proportion(self) -> bool:
        return type(self).apply is LoopEffect.apply

    def change(self, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        output = inputs.met_output
        return self.apply(output, inputs, amplitude, **shape) - output


class ReadoutEffect(LoopEffect):
    """Acts on the samples as they are read out; `signature` reads ``inputs.output``."""

    stage: ClassVar[Stage] = "readout"


class SensorEffect(Effect):
    """Falsifies measured temperatures.

    The signature is what the output differs from a replay that trusts the sensors, to first
    order: the replay's slope against temperature times the sensors' error.
    """

    stage: ClassVar[Stage] = "sensor"

    @abstractmethod
    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What the sensor `name` gives [degC] where its place has `temperature` [degC]; shape (n,)."""

    def replayed_amplitude(self, amplitude: float) -> float:
        """What the signature is multiplied by where the inputs are what falsified sensors gave."""
        return amplitude


class LoggerEffect(Effect):
    """Falsifies the recording: clocks and columns."""

    stage: ClassVar[Stage] = "logger"

    @abstractmethod
    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The output as logged [deg/h], shape (n,)."""

    def ahead_s(self, hours: float, amplitude: float, **shape: float) -> float:
        """How far beyond a sample it looks in a recording of so many hours [s]."""
        return 0.0

    @property
    def in_proportion(self) -> bool:
        return False

    def change(self, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        output = inputs.met_output
        return self.record(output, inputs, amplitude, **shape) - output


class ThermalEffect(Effect):
    """Changes what the plant does; in a replay its signature is what sensors don't show, if anything."""

    stage: ClassVar[Stage] = "thermal"

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return np.zeros(len(inputs))

    def change_chamber(
        self, chamber: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """Chamber air [degC] with the effect, shape (n,)."""
        return chamber

    def change_plant(self, plant: ThermalNetwork, amplitude: float, **shape: float) -> ThermalNetwork:
        """The plant with the effect."""
        return plant


class NoiseEffect(Effect):
    """A random error; its mean response is zero, `draw` gives one realisation.

    Where its size goes with the inputs, `strength` says how, sample by sample; what acts on the gyro
    is the realisation times that.
    """

    stage: ClassVar[Stage] = "noise"
    candidate = False
    steady: ClassVar[bool] = False
    """Whether it is the same in every run: then its signature acts, in a replay too, and nothing is drawn."""

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Zeros: a noise has no mean response."""
        return np.zeros(len(inputs))

    @abstractmethod
    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        """One realisation [deg/h], of strength 1 throughout; shape (count,)."""

    def strength(self, inputs: Inputs, **shape: float) -> FloatArray | float:
        """Size of the noise over that of `draw`, shape (n,) or one number; no memory of other samples."""
        return 1.0


class WhiteNoiseEffect(NoiseEffect):
    """White noise of the rate; its amplitude is an angle random walk in deg/sqrt(h) for a strength of 1."""

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        """One realisation [deg/h], of strength 1 throughout; shape (count,)."""
        from fogml.signals.random_noise import white_noise

        # From deg/sqrt(h) to deg/h sqrt(s).
        return white_noise(rng, count, sample_s, 60.0 * amplitude)
