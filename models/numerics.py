"""Discretisation of a liquid: cells, steps and particles."""

import warnings
from dataclasses import asdict, dataclass

from .apic.filling import POINTS
from .number_checks import check_numbers

MODEL_VERSION = "11"
"""It rises with every change that alters a simulation's bits."""

TESTED_RATIO = (0.7, 1.4)  # radii of a stick in cells, for which references were compared
STEP_CELL = 0.005  # m, the cell that `longest_step` is for
LARGEST_STEP = 4 / 3  # times `longest_step`, for larger cells
LEAST_VISCOSITY = 5e-6
"""Kinematic viscosity below which stirs look alike [m²/s]: those of 1e-3 and 5e-3 Pa s at 10 cm/s
differ by 0.36 degrees RMS, and each misses the reference by about 0.4."""


class UntestedResolution(UserWarning):
    """The stick is narrower or wider, in cells, than what was compared with references."""


@dataclass(frozen=True)
class Numerics:
    """Cells, steps and particles of a stir; fixed before inference and kept with every result.

    Attributes:
        cell: Edge of a cell [m], unless the stick asks for another.
        narrowest, widest: Radius of the stick in cells; cells shrink for a narrower one and grow
            for a wider one.
        longest_step: Step of slow stirs, for cells of 5 mm [s]; in proportion for others.
        courant: Cells that the gripper goes in a step, at most.
        per_cell: Particles in a full cell: 2 or 4.
    """

    cell: float = 0.005
    narrowest: float = 0.9
    widest: float = 1.4
    longest_step: float = 0.012
    courant: float = 0.4
    per_cell: int = 2

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            ValueError: a number is not finite and positive, the narrowest stick is wider than the
                widest, or there is no lattice of so many particles a cell.
        """
        check_numbers("numerics", **asdict(self))
        if self.narrowest > self.widest:
            raise ValueError(
                f"numerics: narrowest must be at most widest, {self.widest}, got {self.narrowest}"
            )
        if self.per_cell not in POINTS:
            wanted = " or ".join(map(str, POINTS))
            raise ValueError(f"numerics: per_cell must be {wanted}, got {self.per_cell}; take 2")

    def cell_for(self, stick_radius: float) -> float:
        """Edge of a cell [m] for a stick [m]."""
        smallest, largest = stick_radius / self.widest, stick_radius / self.narrowest
        return min(max(self.cell, smallest), largest)

    def step(self, cell: float, speed: float) -> float:
        """Step [s] for cells [m] and the gripper's largest speed [m/s]."""
        slow = self.longest_step * min(cell / STEP_CELL, LARGEST_STEP)
        return min(slow, self.courant * cell / max(speed, 1e-9))


def cells_in_radius(stick_radius: float, cell: float) -> float:
    """Radius of a stick in cells; whole particles make cells that miss it by a little."""
    return round(stick_radius / cell, 2)


def is_tested(ratio: float) -> bool:
    """Whether references were compared for a stick of this radius in cells."""
    return TESTED_RATIO[0] <= ratio <= TESTED_RATIO[1]


def check_resolution(stick_radius: float, cell: float) -> None:
    """Warn where the stick is not as wide as tested.

    Warns:
        UntestedResolution: names the ratio.
    """
    ratio = cells_in_radius(stick_radius, cell)
    if not is_tested(ratio):
        warnings.warn(
            f"the stick's radius is {ratio:.2f} cells; {TESTED_RATIO[0]} to {TESTED_RATIO[1]} were "
            "compared with references: leave `particles` out, and cells follow the stick",
            UntestedResolution,
            stacklevel=3,
        )
