"""How well the pour of a posterior so far is known, or the posterior itself."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..calibration.engine_fit import quick_draws
from ..calibration.until import Goal, parts_of
from ..errors import Argument, InputError
from ..inputs.cups import cups_of
from ..inputs.settings import PRIOR_POURS
from ..simulators import PourSimulator, StirSimulator
from .landing_map import learn_map
from .parcels import Parcels
from .pours import pours_of_all
from .spillage import SPILLAGE_QUANTILE

if TYPE_CHECKING:
    from ..inference import Fit, Prior
    from ..inference.simulations import Compute
    from ..models import Cups

BELOW = {"spillage": 1.0, "intervals": np.inf}
"""What a tolerance must be less than, by its quantity."""


def known(until: str, cups: "Cups | str | Path | None" = None) -> Goal:
    """What shall be known for `calibrate` to end early.

    Args:
        until: "spillage=X": the pour that is best over the posterior so far. Its error is what it
            spills more than the best pour of the liquid at hand, as a share of the poured liquid,
            averaged over where the liquid may land: the 95 % quantile over draws of the posterior,
            each beside one error of the map of landings. Or "intervals=S": the ends of the 90 %
            intervals, in sds of the posterior, see `inference.Fit.interval_error`.
        cups: For which a pour is chosen, or a TOML file of them; None takes the bundled ones.

    Raises:
        InputError: There is no such quantity, or its tolerance is not above 0, or the spilled share
            not below 1; or the cups cannot be used, or are given for intervals.
    """
    quantity, tolerance = parts_of(str(until))
    if not 0.0 < tolerance < BELOW.get(quantity, 0.0):
        fix = "give spillage=SHARE, above 0 and below 1, or intervals=SDS, above 0"
        raise InputError(f"{until!r:.80}", where=Argument("until"), fix=fix)
    text = f"{quantity}={tolerance}"
    if quantity == "intervals":
        if cups is not None:
            fix = "give `cups` with spillage=SHARE, or leave them out"
            raise InputError("intervals need none", where=Argument("cups"), fix=fix)
        return Goal(text, tolerance, lambda *_: lambda fit: fit.interval_error())
    cups = cups_of(cups)
    scene = {"pour": {**cups.settings(), "pours": PRIOR_POURS}}
    return Goal(text, tolerance, partial(regret_of, cups, PRIOR_POURS), scene)


def regret_of(
    cups: "Cups",
    pours: int,
    stirring: StirSimulator,
    prior: "Prior",
    compute: "Compute",
    progress: bool,
) -> "Callable[[Fit], float]":
    """The error of "spillage", see `known`, on a map of so many pours of all liquids."""
    simulator = PourSimulator(cups, stirring.recordings[0].number("liquid_density"), Parcels())
    box, poured = pours_of_all(prior, simulator, pours, compute, progress=progress)
    landing_map = learn_map(box, cups, poured)

    def regret(fit: "Fit") -> float:
        drawn = quick_draws(fit, 0)
        draws = {name: drawn[name].to_numpy().ravel() for name in prior.names}
        return float(np.quantile(landing_map.regret(draws), SPILLAGE_QUANTILE))

    return regret
