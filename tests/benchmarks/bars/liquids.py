"""The liquids of the recordings and pours, as given to the solver that made them."""

from bolfi_liquids import models

COHESION = 0.5  # the solver's own is of another form; this is the middle of ours, for all
LISTED = {  # viscosity [Pa s], density [kg/m³]
    "water": (0.001, 1000.0),
    "oil": (0.1, 900.0),
    "glycerin": (1.0, 1260.0),
    "gel": (12.0, 1050.0),
}


def listed(name: str) -> models.Liquid:
    """A liquid with its own viscosity and density, and nothing fitted."""
    viscosity, density = LISTED[name]
    return models.Liquid(viscosity, COHESION, density)
