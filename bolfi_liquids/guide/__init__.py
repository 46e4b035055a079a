"""Pages for the person at the keyboard, in Markdown; `bolfi-liquids guide` prints them."""

from collections.abc import Iterable, Iterator
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from ..errors import InputError

if TYPE_CHECKING:
    from rich.markdown import Markdown

PAGES = (
    "simulator",
    "optimiser",
    "program",
    "elfi",
    "sbi",
    "cluster",
    "methods",
    "benchmark",
    "recordings",
    "priors",
    "criticism",
    "liquids",
    "robot",
    "accuracy",
    "sbc",
    "files",
    "troubleshooting",
)
"""Their names, in the order of README and site; a page's title is the question that it answers."""


def read_page(name: str) -> str:
    """A page's Markdown.

    Raises:
        InputError: There is no such page.
    """
    if name not in PAGES:
        raise InputError(f"no page {name!r}", where="guide", fix=f"choose {', '.join(PAGES)}")
    return (files(__name__) / f"{name}.md").read_text(encoding="utf-8")


def title(name: str) -> str:
    """The first line of a page, without its mark."""
    return read_page(name).partition("\n")[0].removeprefix("# ")


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
