"""Parameters of a liquid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .number_checks import checked_batch

TENSION_AT_ONE = 0.08  # N/m, surface tension of a liquid whose cohesion is 1
FIELDS = ("viscosity", "cohesion", "density")  # names that no effect may have


@dataclass(frozen=True)
class Liquid:
    """A batch of liquids; scalars broadcast against arrays of shape (B,).

    Attributes:
        viscosity: Dynamic viscosity [Pa s].
        cohesion: Surface tension over 0.08 N/m: 0.9 of water, 0.4 of oils.
        density: Rest density [kg/m³].
        adhesion: Wetting of the cup beyond its contact angle: the coefficient of the effect of that
            name.
    """

    viscosity: ArrayLike
    cohesion: ArrayLike
    density: ArrayLike
    adhesion: ArrayLike = 0.0

    def batch(self, size: int) -> "Liquid":
        """Liquids with every field of shape (size,) and dtype float32.

        Raises:
            ValueError: a field is not finite, is negative (density: not positive; adhesion may be)
                or does not broadcast to `size`.
        """
        fields = {}
        for name in (*FIELDS, "adhesion"):
            given = getattr(self, name)
            value = checked_batch(name, given, size).astype(np.float32)
            least = -np.inf if name == "adhesion" else 0.0
            if not np.isfinite(value).all() or (value < least).any():
                raise ValueError(f"{name} must be finite and not negative, got {given}")
            fields[name] = value
        if (fields["density"] == 0).any():
            raise ValueError("density must be positive [kg/m³], got 0")
        return Liquid(**fields)

    def __getitem__(self, part: slice | np.ndarray) -> "Liquid":
        """Part of a batch made by `batch`."""
        names = (*FIELDS, "adhesion")
        return Liquid(*(np.asarray(getattr(self, name))[part] for name in names))
