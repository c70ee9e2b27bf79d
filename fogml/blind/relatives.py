"""How like the library's effects are to the true ones of a case: relatives to leave out, distances of form.

Realities know no library, so these are steps of their own; no form is taken or left for what is measured. An
effect is a relative where its signature, best-fitted over its shape parameters, has ``|cosine| > 0.95`` with
the withheld effect's true contribution, both whitened by the true noise and with what the nominal constants
can make up for taken out.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property, partial
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from fogml.arrays import FloatArray
from fogml.blind.folders import BlindFolder, case_files, read_json, write_sums
from fogml.blind.signatures import Atom, Stack, atoms, free_shape
from fogml.blind.truth import Truth, read_contributions, read_truth, write_truth
from fogml.outputs import settled, whole_file
from fogml.processes import in_processes
from fogml.signals.noise_model import NoiseModel

ALIKE = 0.95
"""Absolute cosine from which two signatures are relatives."""
_STARTS = 2
_STEPS = 60
_NOTHING_LEFT = 1e-6


class Likeness:
    """How alike signatures are to given contributions, on runs of one case.

    Parameters
    ----------
    runs
        Paths of the fit runs.
    contributions
        What withheld effects truly add to the output [deg/h], a list of one array per run each.
    noise
        The noise to whiten by.
    constants
        The unit's nominal constants, about which effects that falsify an input are taken.
    """

    def __init__(
        self,
        runs: Sequence[Path],
        contributions: Sequence[Sequence[FloatArray]],
        noise: NoiseModel,
        constants: Mapping[str, float] | None = None,
    ) -> None:
        self._runs, self._contributions, self._noise = runs, contributions, noise
        self._constants = constants

    def cosine(self, id: str, of: int | None = None) -> float:
        """The largest absolute cosine that an effect reaches with a contribution, or with number `of`."""
        targets = self._targets if of is None else self._targets[:, of : of + 1]
        candidate = self._stack.model.candidates().get(id)
        if candidate is None:
            return 0.0
        grid = atoms({id: candidate}, ())
        columns = self._seen(np.column_stack([self._stack.column(atom) for atom in grid]))
        reached = np.abs(targets.T @ columns).max(axis=0)
        best = float(reached.max(initial=0.0))
        free = free_shape(candidate)
        names = [quantity.name for quantity in free]
        if not names or best > ALIKE:
            return best
        bounds = [quantity.tactical for quantity in free]
        for start in np.argsort(reached)[::-1][:_STARTS]:
            fitted = minimize(
                lambda x: -self._reached(targets, Atom(id, dict(zip(names, map(float, x))))),
                [grid[start].shape[name] for name in names],
                method="Nelder-Mead",
                bounds=bounds,
                options={"maxfev": _STEPS * len(names), "xatol": 1e-3, "fatol": 1e-4},
            )
            best = max(best, -float(fitted.fun))
        return best

    def left(self, shapes: Mapping[str, Mapping[str, float]]) -> float:
        """Squared whitened length that effects of given shapes leave of the first contribution.

        Amplitudes and nominal constants are at their best.
        """
        target = self._stack.averaged(self._contributions[0])[:, None]
        columns = [self._stack.column(Atom(id, shape))[:, None] for id, shape in shapes.items()]
        white = self._stack.whitened(self._noise, np.concatenate([target, *columns], axis=1))
        white = white - self._nominal @ (self._nominal.T @ white)
        length = np.linalg.norm(white, axis=0)
        used = white[:, 1:][:, length[1:] > 0.0] / length[1:][length[1:] > 0.0]
        residual = white[:, 0] - used @ np.linalg.lstsq(used, white[:, 0], rcond=None)[0]
        return float(residual @ residual)

    def _reached(self, targets: FloatArray, atom: Atom) -> float:
        return float(np.abs(targets.T @ self._seen(self._stack.column(atom)[:, None])).max())

    @cached_property
    def _stack(self) -> Stack:
        return Stack(self._runs, self._constants)

    @cached_property
    def _nominal(self) -> FloatArray:
        columns = self._stack.whitened(self._noise, self._stack.nominal)
        left, sizes, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0).clip(1e-300), False)
        return left[:, sizes > 1e-10 * sizes[0]]

    @cached_property
    def _targets(self) -> FloatArray:
        return self._seen(np.column_stack([self._stack.averaged(parts) for parts in self._contributions]))

    def _seen(self, columns: FloatArray) -> FloatArray:
        """Whitened columns of unit length less what the nominal constants make up for."""
        white = self._stack.whitened(self._noise, columns)
        left = white - self._nominal @ (self._nominal.T @ white)
        lengths = np.linalg.norm(left, axis=0)
        # What the nominal constants make up for entirely has no direction left.
        gone = lengths <= _NOTHING_LEFT * np.linalg.norm(white, axis=0)
        return np.where(gone, 0.0, left / np.where(gone, 1.0, lengths))


def relatives_of(folder: BlindFolder, truth: Truth) -> Callable[[str], bool] | None:
    """Whether an effect is a relative of one that was left out of a case; None where none was.

    Effects that no library holds have no relatives: any name for them is wrong. Work is done when
    it is first asked.
    """
    places = [i for i, e in enumerate(truth.effects) if e.id is not None and e in truth.unknown]
    if not places:
        return None

    @cache
    def likeness() -> Likeness:
        given = read_contributions(folder.truth / f"{truth.case}.npz")
        runs = case_files(folder.cases / truth.case).fit
        contributions = [[given[run.name, i] for run in runs] for i in places]
        return Likeness(runs, contributions, truth.noise_model, truth.nominal)

    @cache
    def relative(id: str) -> bool:
        return likeness().cosine(id) > ALIKE

    return relative


OPTIONS = "options.json"
RELATIVES = "relatives"


def leave_out_relatives(
    folder: BlindFolder, workers: int = 1, progress: Callable[[int, int], None] | None = None
) -> int:
    """Add relatives of left-out effects to every case's ``without``; returns how many cases were changed.

    Cases that were seen before are left as they are.
    """
    names = [name for name in folder.names() if _is_open(folder, name)]
    changed = 0
    with settled(*(folder.cases / name for name in names)):
        for done, more in enumerate(in_processes(partial(_leave_out, folder), names, workers), 1):
            changed += bool(more)
            if progress:
                progress(done, len(names))
    return changed


def _is_open(folder: BlindFolder, name: str) -> bool:
    """Whether something is left out of a case, and its relatives not yet."""
    options = read_json(folder.cases / name / OPTIONS)
    return bool(options.get("without")) and RELATIVES not in options


def _leave_out(folder: BlindFolder, name: str) -> list[str]:
    from fogml.twin.registry import effects

    truth = read_truth(folder.truth / f"{name}.json")
    relative = relatives_of(folder, truth)
    known = {e.id for e in truth.known}
    found = [
        id
        for id, declared in effects().items()
        if declared.candidate
        and relative is not None
        and id not in truth.left_out
        and id not in known
        and relative(id)
    ]
    path = folder.cases / name / OPTIONS
    options = read_json(path)
    options |= {"without": [*options["without"], *found], RELATIVES: found}
    with whole_file(path) as beside:
        beside.write_text(json.dumps(options) + "\n", encoding="utf-8")
    return found


def measure_forms(
    folder: BlindFolder, workers: int = 1, progress: Callable[[int, int], None] | None = None
) -> int:
    """Write the cosine of every effect of the library into its truth; returns how many cases were measured.

    Cases that were measured before are left as they are. The truths are hashed anew.
    """
    paths = [folder.truth / f"{name}.json" for name in folder.names()]
    open_ = [
        path
        for path in paths
        if any(effect.id is not None and effect.cosine is None for effect in read_truth(path).effects)
    ]
    with settled(folder.truth):
        for done, _ in enumerate(in_processes(partial(_measure, folder), open_, workers), 1):
            if progress:
                progress(done, len(open_))
    if open_:
        write_sums(folder.truth)
    return len(open_)


def _measure(folder: BlindFolder, path: Path) -> None:
    truth = read_truth(path)
    given = read_contributions(path.with_suffix(".npz"))
    runs = case_files(folder.cases / truth.case).fit
    contributions = [[given[run.name, place] for run in runs] for place in range(len(truth.effects))]
    likeness = Likeness(runs, contributions, truth.noise_model, truth.nominal)
    effects = tuple(
        effect if effect.id is None else effect.model_copy(update={"cosine": likeness.cosine(effect.id, of)})
        for of, effect in enumerate(truth.effects)
    )
    write_truth(folder.truth, truth.model_copy(update={"effects": effects}), given)
