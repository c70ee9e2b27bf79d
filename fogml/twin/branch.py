"""Plant and chain of one twin on the world's clock, with what they remember from block to block."""

from __future__ import annotations

from copy import deepcopy

from fogml.runs.run import FloatArray
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.plant.network import AIR, PlantState
from fogml.twin.plant.power import PowerWindows
from fogml.twin.timeline import TimelineBlock
from fogml.twin.twin import Twin


class Branch:
    """Plant and chain of one twin, with what they remember."""

    def __init__(self, twin: Twin) -> None:
        self.twin = twin
        self.network = twin.network
        self.state = PlantState()
        self.chamber_memory, self.memory = Memory(), Memory()

    def go_on_from(self, before: Branch) -> None:
        """Take over the states that another run of the same unit left."""
        left = before.state, before.chamber_memory, before.memory
        self.state, self.chamber_memory, self.memory = deepcopy(left)

    def nodes(
        self, block: TimelineBlock, drives: dict[str, FloatArray], clock_s: float, windows: PowerWindows
    ) -> dict[str, FloatArray]:
        """Temperature of every node at all samples of the block, on or off."""
        chamber, time = block.set_point, clock_s + block.time
        for declared, setting in self.twin.thermal:
            inputs = Inputs(time, {AIR: chamber}, block.table_rate, drives=drives, memory=self.chamber_memory)
            chamber = declared.change_chamber(chamber, inputs, setting.amplitude, **setting.shape)
        return self.network.temperatures(
            time,
            chamber,
            powered=windows,
            fan=block.fan,
            table_rate=block.table_rate,
            state=self.state,
        )
