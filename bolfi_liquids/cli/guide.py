"""The command `guide`: the pages that come with the package."""

from typing import Annotated

import typer

from ..guide import PAGES, read_page
from .examples import examples

EPILOG = examples("guide", "guide files", "guide troubleshooting | less -R")


def guide(
    page: Annotated[
        str | None, typer.Argument(metavar="|".join(PAGES), help="Which; without it, a list.")
    ] = None,
) -> None:
    """Show a page of the guide: files, priors, messages and more."""
    if page is None:
        width = max(map(len, PAGES))
        for name, about in PAGES.items():
            typer.echo(f"{name:{width}}  {about}")
        typer.echo("read one: bolfi-liquids guide PAGE")
        return
    from rich.console import Console
    from rich.markdown import Markdown

    Console().print(Markdown(read_page(page), hyperlinks=False))
