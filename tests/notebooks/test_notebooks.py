"""Every notebook runs from its first cell to its last."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parents[2] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def test_there_are_notebooks() -> None:
    assert NOTEBOOKS


@pytest.fixture(scope="module")
def kernel() -> Iterator[Any]:
    """One kernel for all: libraries load once."""
    with warnings.catch_warnings():
        # The notebook client's own dependencies warn about each other's versions.
        warnings.simplefilter("ignore")
        from jupyter_client.manager import KernelManager

        manager = KernelManager(kernel_name="python3")
        manager.start_kernel()
        yield manager
        manager.shutdown_kernel(now=True)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(path: Path, kernel: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import nbformat
        from nbclient import NotebookClient

        stored = nbformat.read(path, as_version=4)
        notebook = nbformat.read(path, as_version=4)
        # Nothing of the notebook before is there.
        notebook.cells.insert(0, nbformat.v4.new_code_cell("%reset -f"))
        client = NotebookClient(notebook, km=kernel, timeout=1800)
        try:
            client.execute()
        finally:
            client.kc.stop_channels()
    printed = [out for cell in notebook.cells if cell.cell_type == "code" for out in cell.outputs]
    assert printed
    assert not any(out.output_type == "error" for out in printed)
    shown = [out.data for out in printed if out.output_type in ("display_data", "execute_result")]
    assert any("application/vnd.plotly.v1+json" in data for data in shown), "show a figure"
    assert not any(cell.get("outputs") for cell in stored.cells), "store notebooks without outputs"
