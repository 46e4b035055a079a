"""What stands below each command's help: how it is typed."""

PROGRAM = "bolfi-liquids"


def examples(*commands: str, title: str = "For example:", then: str = "") -> str:
    """An epilog.

    Args:
        commands: What is typed after the program's name.
        title: Above them.
        then: A last paragraph.
    """
    # after \b, the lines of a paragraph stay as they are
    listed = "\n".join(("\b", title, *(f"  {PROGRAM} {command}" for command in commands)))
    return f"{listed}\n\n{then}".rstrip()
