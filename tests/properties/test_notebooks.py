"""The notebooks run from top to bottom, with few simulations."""

from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
NOTEBOOKS = sorted((TESTS.parent / "notebooks").glob("*.ipynb"))
RECORDS = {"dry_run"}  # with an emulated arm, which must keep time
LONGEST = 600  # s after which a cell hangs, on a slow computer that does something else as well


def test_there_are_notebooks_and_they_are_small():
    assert {path.stem for path in NOTEBOOKS} >= RECORDS
    assert all(path.stat().st_size < 500_000 for path in NOTEBOOKS)


def marks(path):
    return [pytest.mark.minutes, *([pytest.mark.alone] if path.stem in RECORDS else [])]


def draw_least_figures(out):
    """What `make paper` writes, of as few simulations as draw every line."""
    from paper.figures import FIGURES, draw_figures
    from paper.study_size import Scale

    from bolfi_liquids.run.compute import processes

    least = Scale(
        repetitions=1,
        budgets=(7,),
        recorded=(7,),
        rates=7,
        surrogates=("discrepancy",),
        lips=(0.14,),
        particles=300,
        drawn_particles=300,
        pours=24,
    )
    names = [name for name in FIGURES if name != "strokes"]
    with processes() as executor:
        for _ in draw_figures(names, out, least, executor):
            pass


@pytest.mark.parametrize(
    "path", [pytest.param(path, id=path.stem, marks=marks(path)) for path in NOTEBOOKS]
)
# Jupyter's own, about its event loop, and the engine's, of fits to too few simulations
@pytest.mark.filterwarnings("ignore")
def test_notebook_runs(path, tmp_path, monkeypatch):
    import nbformat
    from nbclient import NotebookClient

    if path.stem == "paper_figures":
        monkeypatch.syspath_prepend(TESTS / "benchmarks")
        draw_least_figures(tmp_path / "runs" / "paper_quick")
    beside = tmp_path / "notebooks"
    beside.mkdir()
    monkeypatch.setenv("SMOKE", "1")
    notebook = nbformat.read(path, as_version=4)
    where = {"metadata": {"path": str(beside)}}
    NotebookClient(notebook, timeout=LONGEST, kernel_name="python3", resources=where).execute()
