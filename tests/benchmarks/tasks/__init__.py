"""Inference tasks with exact posteriors, on which engines are compared.

Nothing here imports more than NumPy and SciPy, or needs a Python younger than 3.9: the same files
run in every peer's own environment.
"""

from .ball_drop import BALL_DROP
from .base import Task
from .epidemics import BOARDING_SCHOOL, SIR
from .gauss import GAUSS2
from .lotka_volterra import LOTKA_VOLTERRA
from .ma import MA2
from .pendulum import PEND2
from .pendulum_observed import PENDOBS, PENDOBS3
from .reference import Reference, Score, make_reference, score
from .shapes import GAUSSIAN_MIXTURE, SLCP, TWO_MOONS

OWN = (GAUSS2, MA2, PEND2, PENDOBS, PENDOBS3)
PUBLIC = (TWO_MOONS, GAUSSIAN_MIXTURE, SIR, LOTKA_VOLTERRA, SLCP, BALL_DROP, BOARDING_SCHOOL)
TASKS = {task.name: task for task in OWN + PUBLIC}

__all__ = [
    "TASKS",
    "Reference",
    "Score",
    "Task",
    "make_reference",
    "score",
]
