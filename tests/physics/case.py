"""A physical claim about the fluid, and what a simulation of it returns."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Row(NamedTuple):
    """One number compared with its truth.

    Attributes:
        quantity: What is compared, with the unit of `truth` and `ours` in brackets.
        truth, ours: Expected and simulated value.
        error: In the case's unit of error; not finite where a simulation failed.
        tolerance: Largest absolute error that passes.
    """

    quantity: str
    truth: float
    ours: float
    error: float
    tolerance: float

    @property
    def passed(self) -> bool:
        """The error is a number within the tolerance."""
        return abs(self.error) <= self.tolerance

    @classmethod
    def relative(cls, quantity: str, truth: float, ours: float, tolerance: float) -> "Row":
        """Error as a fraction of the truth.

        Raises:
            ValueError: the truth is zero.
        """
        if truth == 0:
            raise ValueError(f"{quantity}: a truth of 0 has no relative error; use `absolute`")
        return cls(quantity, *map(float, (truth, ours, ours / truth - 1.0, tolerance)))

    @classmethod
    def absolute(cls, quantity: str, truth: float, ours: float, tolerance: float) -> "Row":
        """Error in the unit of the truth."""
        return cls(quantity, *map(float, (truth, ours, ours - truth, tolerance)))


class Curve(NamedTuple):
    """Points of a plot; curves of one `series` share a colour.

    Attributes:
        label: For the legend; an empty one is left out.
        x, y: Same shape [n].
        truth: Drawn as the line that the others are held against.
        series: Number of the colour, from 0.
    """

    label: str
    x: ArrayLike
    y: ArrayLike
    truth: bool = False
    series: int = 0


@dataclass(frozen=True)
class Panel:
    """One pair of axes. `log` names those that are logarithmic: "", "x", "y" or "xy"."""

    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    log: str = ""

    def __post_init__(self):
        for curve in self.curves:
            x, y = np.shape(curve.x), np.shape(curve.y)
            if x != y or len(x) != 1:
                raise ValueError(f"curve {curve.label!r} needs x and y of one shape, got {x}, {y}")


@dataclass(frozen=True)
class CaseResult:
    """What a case found.

    Attributes:
        rows: Comparisons; at least one.
        panels: Of its plot, side by side; at least one.
        notes: Plain numbers and text that help to read the result.
    """

    rows: tuple[Row, ...]
    panels: tuple[Panel, ...]
    notes: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        if not self.rows or not self.panels:
            raise ValueError("a result needs at least one row and one panel")


class Case(NamedTuple):
    """A simulation with a known outcome.

    Attributes:
        truth: What is expected, in a sentence or less.
        source: Where that is known from.
        unit: Of the errors: "relative", "deg"; "" where each quantity names its own.
        run: The comparison itself, from the seed of its initial packings.
    """

    truth: str
    source: str
    unit: str
    run: Callable[[int], CaseResult]
