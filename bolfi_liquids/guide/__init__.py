"""Pages for the person at the keyboard, in Markdown; `bolfi-liquids guide` prints them."""

from collections.abc import Iterable, Iterator
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from ..errors import InputError

if TYPE_CHECKING:
    from rich.markdown import Markdown

PAGES = {
    "recordings": "the recording format, import, resuming, what a run holds",
    "priors": "choosing a prior and the number of simulations, going on, seeds and noise",
    "criticism": "finding the effect that the simulator lacks",
    "simulator": "the inference engine with your own simulator",
    "program": "a simulator that is a program with a command line and files",
    "optimiser": "the posterior out of an optimiser's trials",
    "elfi": "coming from ELFI: notions, and three of its tutorials",
    "sbi": "coming from sbi: what 10 to 100 simulations give",
    "cluster": "simulations on Slurm, Dask or another queue; what a kill costs",
    "methods": "what the engine computes, where it fails, how it was tested",
    "liquids": "simulated stirs and pours, effects, movies",
    "robot": "arm, cameras, safety, online calibration",
    "accuracy": "measured errors of fluid, posterior, pours and criticism",
    "sbc": "whether intervals hold the truth: simulation-based calibration",
    "files": "every file that is written: variables, units, attributes, fields",
    "troubleshooting": "messages by their first line, with cause and cure",
}
"""What each page is about, by its name."""


def read_page(name: str) -> str:
    """A page's Markdown.

    Raises:
        InputError: There is no such page.
    """
    if name not in PAGES:
        raise InputError(f"no page {name!r}", where="guide", fix=f"choose {', '.join(PAGES)}")
    return (files(__name__) / f"{name}.md").read_text(encoding="utf-8")


def for_terminal(name: str) -> "Markdown":
    """A page as rich prints it, with folded cells of tables: no name of a field is cut.

    Raises:
        InputError: There is no such page.
    """
    from rich.markdown import Markdown, TableElement

    class Folded(TableElement):
        def __rich_console__(self, *where: Any) -> Iterator[Any]:
            tables: Iterable[Any] = super().__rich_console__(*where)
            for table in tables:
                for column in table.columns:
                    column.overflow = "fold"
                yield table

    class Page(Markdown):
        elements = {**Markdown.elements, "table_open": Folded}  # noqa: RUF012  as its base has it

    return Page(read_page(name), hyperlinks=False)
