"""Where the liquid of a reference's pours lands, a file beside their table."""

from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

ENDING = "_landings.json"  # in the place of .csv
BIN_SIZE = (1e-3, 2e-3)  # m, along the line from the lip to the receiver and across

Finite = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Bin = tuple[Finite, Finite, Share]  # its lower edges along and across [mm], and its share


class _Case(BaseModel):
    liquid: str
    angular_velocity_deg_s: Finite
    x_y_fraction: Annotated[list[Bin], Field(min_length=1)]


class _Landings(BaseModel):
    cases: dict[str, _Case]


class Landing(NamedTuple):
    """Of one pour.

    Attributes:
        liquid: Its name.
        angular_velocity_deg_s: Of the source.
        place: Centres of bins, from the lip towards the receiver and across [m], shape (n, 2).
        share: Of all liquid in each bin, shape (n,).
    """

    liquid: str
    angular_velocity_deg_s: float
    place: NDArray[np.float64]
    share: NDArray[np.float64]

    @property
    def mean(self) -> float:
        """Of all that landed, from the lip towards the receiver [m]."""
        return float(np.average(self.place[:, 0], weights=self.share))

    def spilled(self, distance: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
        """Fraction of all liquid beside receivers of a radius at distances [m], shape (D,).

        Each bin is spread along its length, so that an edge moves through it evenly.
        """
        ahead, across = self.place.T
        chord = np.sqrt(np.clip(radius**2 - across**2, 0.0, None))
        half = BIN_SIZE[0] / 2.0
        first = np.maximum(ahead - half, distance[:, None] - chord)
        last = np.minimum(ahead + half, distance[:, None] + chord)
        caught = np.clip(last - first, 0.0, None) / BIN_SIZE[0]
        return (1.0 - caught) @ self.share


def open_landings(table: Path) -> tuple[Landing, ...]:
    """Read the landings that belong to a table of pours; none where nobody wrote them down.

    Raises:
        ValueError: The file has another form; the message names the field.
    """
    path = table.with_name(table.stem + ENDING)
    if not path.is_file():
        return ()
    landings = _Landings.model_validate_json(path.read_text(encoding="utf-8"))
    return tuple(_landing(one) for one in landings.cases.values())


def _landing(case: _Case) -> Landing:
    bins = np.array(case.x_y_fraction)
    place = 1e-3 * bins[:, :2] + np.array(BIN_SIZE) / 2.0
    return Landing(case.liquid, case.angular_velocity_deg_s, place, bins[:, 2])
