"""What stands below each command's help: how it is typed."""

PROGRAM = "bolfi-liquids"


def examples(*commands: str) -> str:
    """An epilog, in Markdown.

    Args:
        commands: What is typed after the program's name.
    """
    return _listed("For example:", commands, "-")


def session(*commands: str, then: str) -> str:
    """An epilog of commands that follow each other, in Markdown.

    Args:
        commands: What is typed after the program's name, in order.
        then: A last paragraph.
    """
    return f"{_listed('A session:', commands, '1.')}\n\n{then}"


def _listed(title: str, commands: tuple[str, ...], mark: str) -> str:
    lines = [f"{mark} `{PROGRAM} {command}`" for command in commands]
    return "\n".join((title, "", *lines))
