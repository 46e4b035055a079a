"""Pages for the person at the keyboard, in Markdown; `bolfi-liquids guide` prints them."""

from importlib.resources import files

from ..errors import InputError

PAGES = {
    "files": "every file that is written: variables, units, attributes, fields",
    "priors": "choosing a prior and the number of simulations, going on, seeds and noise",
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
