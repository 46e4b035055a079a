"""Inference tasks with exact posteriors, on which engines are compared.

Nothing here imports more than NumPy and SciPy, or needs a Python younger than 3.9: the same files
run in every peer's own environment.
"""

from .base import Task
from .gauss import GAUSS2
from .ma import MA2
from .pendulum import PEND2
from .pendulum_observed import PENDOBS, PENDOBS3
from .reference import Reference, Score, make_reference, score

TASKS = {task.name: task for task in (GAUSS2, MA2, PEND2, PENDOBS, PENDOBS3)}

__all__ = [
    "TASKS",
    "Reference",
    "Score",
    "Task",
    "make_reference",
    "score",
]
