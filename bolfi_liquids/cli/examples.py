"""What stands below each command's help: how it is typed."""

PROGRAM = "bolfi-liquids"


def examples(*commands: str) -> str:
    """An epilog.

    Args:
        commands: What is typed after the program's name.
    """
    return _listed("For example:", commands)


def session(*commands: str, then: str) -> str:
    """An epilog of commands that follow each other.

    Args:
        commands: What is typed after the program's name, in order.
        then: A last paragraph.
    """
    return f"{_listed('A session:', commands)}\n\n{then}"


def _listed(title: str, commands: tuple[str, ...]) -> str:
    # after \b, the lines of a paragraph stay as they are
    return "\n".join(("\b", title, *(f"  {PROGRAM} {command}" for command in commands)))
