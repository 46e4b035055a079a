"""The liquids of the recordings, as given to the solver that made them."""

LISTED = {  # viscosity [Pa s], density [kg/m³]
    "water": (0.001, 1000.0),
    "oil": (0.1, 900.0),
    "glycerin": (1.0, 1260.0),
    "gel": (12.0, 1050.0),
}
