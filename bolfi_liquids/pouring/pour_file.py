"""pour.nc: everything that a report shows of a pour.

Its groups are `actions` and `actions_plug_in`, over a grid of actions, the spillage expected for
each draw of the posterior, or at theta*, and the risk that was minimised; `finalists`, the same of
the most promising ones over more draws; `chosen` and `plug_in`, over outcomes, fractions with
fresh seeds; `liquids` and `liquids_again`, the posterior draws that the choice was made with.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from numpy.typing import NDArray

from .result import Judged, Pour
from .spillage import ACTION, FRACTIONS, RISK, Surface

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

ACTION_UNITS = {"angular_velocity": "rad s-1", "distance": "m"}


def pour_tree(
    pour: Pour,
    tried: Mapping[str, Surface],
    liquids: Mapping[str, Mapping[str, NDArray]],
    risk: str,
) -> "DataTree":
    """Everything that a report shows of a pour; `tried` and `liquids` are groups by name."""
    from xarray import Dataset, DataTree

    groups = {
        **{name: _actions(surface, risk) for name, surface in tried.items()},
        "chosen": _outcomes(pour.chosen),
        "plug_in": _outcomes(pour.plug_in),
        **{
            group: Dataset({name: ("draw", values) for name, values in drawn.items()})
            for group, drawn in liquids.items()
        },
    }
    return DataTree.from_dict({f"/{name}": dataset for name, dataset in groups.items()})


def _actions(surface: Surface, risk: str) -> "Dataset":
    from xarray import Dataset

    return Dataset(
        {
            "spilled": (("draw", *ACTION), surface.spilled),
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
