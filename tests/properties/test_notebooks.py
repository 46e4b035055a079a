"""The notebooks run from top to bottom, with few simulations."""

import sys
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))
RECORDS = {"dry_run"}  # on the emulator, which must keep time
LONGEST = 600  # s after which a cell hangs, on a slow computer that does something else as well


def test_there_are_notebooks_and_they_are_small():
    assert {path.stem for path in NOTEBOOKS} >= RECORDS
    assert all(path.stat().st_size < 500_000 for path in NOTEBOOKS)


def marks(path):
    return [pytest.mark.minutes, *([pytest.mark.alone] if path.stem in RECORDS else [])]


@pytest.mark.parametrize(
    "path", [pytest.param(path, id=path.stem, marks=marks(path)) for path in NOTEBOOKS]
)
# Jupyter's own, about its event loop
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_notebook_runs(path, tmp_path, monkeypatch):
    if sys.version_info < (3, 12) and "import arviz as az" in path.read_text():
        pytest.skip("ArviZ 1 needs Python 3.12")
    import nbformat
    from nbclient import NotebookClient

    monkeypatch.setenv("SMOKE", "1")
    notebook = nbformat.read(path, as_version=4)
    where = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, timeout=LONGEST, kernel_name="python3", resources=where).execute()
