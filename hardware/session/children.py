"""The processes of a session: started, watched, and ended in time."""

import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple

from ..board import SPAWN, host_time

LET_END = 0.8  # s, for which a child may end by itself
TERMINATE_SECONDS = 0.1  # s, from the request to end to the end by force


class Child(NamedTuple):
    """A process of a session.

    Attributes:
        name: As an operator reads it.
        process: Of the system.
        link: Main's end of the pipe whose end tells the child that main is gone.
    """

    name: str
    process: BaseProcess
    link: Connection


def start(
    name: str, target: Callable[..., None], args: Callable[[Connection], tuple[Any, ...]]
) -> Child:
    """Spawn a child; `args` makes its arguments from its end of the pipe to main."""
    mine, its = SPAWN.Pipe()
    process = SPAWN.Process(target=target, args=args(its), name=name, daemon=True)
    process.start()
    # the child sees the pipe's end only if nobody else holds this side of it
    its.close()
    return Child(name, process, mine)


def ended_how(child: Child) -> str:
    """How a process that is no more has ended."""
    code = child.process.exitcode
    if code is not None and code < 0:
        return f"{child.name} process killed by {signal.Signals(-code).name}"
    return f"{child.name} process ended by itself with exit code {code}"


def tell_to_leave(child: Child) -> None:
    """Ask a child to finish; it may be gone already."""
    try:
        child.link.send("leave")
    except OSError:
        pass


def end(children: list[Child], patience: float = LET_END) -> list[Child]:
    """Wait for children, then end those that remain by force.

    Returns:
        Those that had to be ended.
    """
    deadline = host_time() + patience
    for child in children:
        child.process.join(max(deadline - host_time(), 0.0))
    stubborn = [child for child in children if child.process.is_alive()]
    for child in stubborn:
        child.process.terminate()
    deadline = host_time() + TERMINATE_SECONDS
    for child in stubborn:
        child.process.join(max(deadline - host_time(), 0.0))
        if child.process.is_alive():
            child.process.kill()
            child.process.join()
    return stubborn
