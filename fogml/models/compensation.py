"""Compensation of recordings of any length, block by block in bounded memory."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from fogml.features.blocks import FeatureBlocks
from fogml.models.base import Compensation, DriftModel, Evaluation, compensation_of
from fogml.runs.run import Run


def compensate_blocks(
    model: DriftModel, blocks: Iterable[Run], *, any_unit: bool = False
) -> Iterator[tuple[Run, Compensation]]:
    """Compensate consecutive blocks of one recording as if it were whole.

    The end of each block, as long as the features look back, is put before the next one, so
    windows go on across blocks. Gaps are told by the first block's sample interval.

    Parameters
    ----------
    model
        A fitted model.
    blocks
        Blocks of one recording in order of time.
    any_unit
        Allow a recording of another unit or axis than the model's.

    Yields
    ------
    (block, compensation)
        In order; arrays of the block's length.

    Raises
    ------
    InputError
        If the model does not apply to the recording, or a block begins before the last ended.
    """
    for block, evaluation in evaluate_blocks(model, blocks, any_unit=any_unit):
        yield block, compensation_of(block, evaluation)


def evaluate_blocks(
    model: DriftModel, blocks: Iterable[Run], *, any_unit: bool = False
) -> Iterator[tuple[Run, Evaluation]]:
    """Evaluate a model on consecutive blocks of one recording as if it were whole; as `compensate_blocks`."""
    atoms: FeatureBlocks | None = None
    first = True
    for block in blocks:
        if len(block) == 0:
            continue
        if first:
            model.check_applies(block, any_unit)
            if model.features_ is not None:
                atoms = model.features_.blocks(block.sample_s)
            first = False
        if atoms is None:
            evaluation = model.evaluate(block)
        else:
            evaluation = model.evaluate_from(block, atoms.push(block))
        yield block, evaluation
