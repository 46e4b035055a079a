"""pour.nc: everything that a report shows of a pour.

Its groups are `actions` and `actions_plug_in`, over a grid of actions, the spillage expected for
each draw of the posterior, or at theta*, and the risk that was minimised; `chosen` and `plug_in`,
over outcomes, fractions with draws that did not choose; `liquids`, the posterior draws that the
choice was made with; `pours`, those that the map was learned from, and how far it missed each;
`given`, pours that were given and correct the map, and what it expects of them alone.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .result import Judged
from .spillage import ACTION, FRACTIONS, RISK, Surface

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

    from .given import GivenPours
    from .landing_map import LandingMap

ACTION_UNITS = {"angular_velocity": "rad s-1", "distance": "m"}


def pour_tree(
    chosen: Judged,
    plug_in: Judged,
    tried: Mapping[str, Surface],
    liquids: Mapping[str, NDArray],
    learned: "LandingMap",
    risk: str,
) -> "DataTree":
    """Everything that a report shows of a pour.

    Args:
        chosen, plug_in: The two actions that were judged.
        tried: What actions may be expected to spill, by the name of the group.
        liquids: The posterior draws of the choice, name -> (draws,).
        learned: The map that it was made with.
        risk: Which measure of `spillage.RISK` was minimised.
    """
    from xarray import Dataset, DataTree

    groups = {
        **{name: _actions(surface, risk) for name, surface in tried.items()},
        "chosen": _outcomes(chosen),
        "plug_in": _outcomes(plug_in),
        "liquids": Dataset({name: ("draw", values) for name, values in liquids.items()}),
        "pours": _pours(learned),
    }
    if learned.given is not None:
        groups["given"] = _given(learned.given)
    return DataTree.from_dict({f"/{name}": dataset for name, dataset in groups.items()})


def _pours(learned: "LandingMap") -> "Dataset":
    from xarray import Dataset

    missed = np.sqrt(np.mean(learned.error**2, axis=1))
    theta = {name: ("pour", values) for name, values in learned.poured.theta.items()}
    return Dataset({**theta, "missed": ("pour", missed)})


def _given(given: "GivenPours") -> "Dataset":
    from xarray import Dataset

    table = given.table
    names = (*ACTION, *FRACTIONS, "expected_spilled", "expected_retained")
    values = (table.angular_velocity, table.distance, *table.fractions.T, *given.expected.T)
    columns = {
        name: ("line", of, {"units": ACTION_UNITS.get(name, "1")})
        for name, of in zip(names, values, strict=True)
    }
    attributes = {"file": table.path.name, "liquid": table.liquid, "sha256": table.hash}
    return Dataset(columns, {"line": table.lines}, attributes)


def _actions(surface: Surface, risk: str) -> "Dataset":
    from xarray import Dataset

    return Dataset(
        {
            "spilled": (("draw", *ACTION), surface.spilled.astype(np.float32)),
            "risk": (ACTION, RISK[risk](surface.spilled)),
        },
        coords={
            name: (name, getattr(surface, name), {"units": ACTION_UNITS[name]}) for name in ACTION
        },
    )


def _outcomes(judged: Judged) -> "Dataset":
    from xarray import Dataset

    columns = zip(FRACTIONS, judged.fractions.T, strict=True)
    return Dataset(
        {name: ("outcome", values) for name, values in columns},
        attrs={"angular_velocity": judged.angular_velocity, "distance": judged.distance},
    )
