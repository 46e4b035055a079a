"""pour.nc and the section "pour" of summary.json.

Groups of pour.nc: `actions` and `actions_plug_in`, over a grid of actions, the spillage that each
posterior draw, or theta*, lets expect, and the risk that was minimised; `finalists`, the same of
the most promising ones over more draws; `chosen` and `plug_in`, over outcomes, fractions with
fresh seeds; `liquids` and `liquids_again`, the posterior draws that chose.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..calibration.tree import read_tree
from ..inputs.settings import PourSettings
from ..run.directory import POUR
from .spillage import (
    ACTION,
    FRACTIONS,
    RISK,
    Surface,
)

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

    from .choose import Judged, Pour

UNITS = {"angular_velocity": "rad s-1", "distance": "m"}


def pour_section(
    pour: "Pour", settings: PourSettings, *, n_simulations: int, least_viscosity: float
) -> dict[str, Any]:
    """Numbers of a pour, in the design's form: degrees and centimetres, fractions of liquid.

    `n_simulations` counts pours of one liquid, in the searches and in judging. Below
    `least_viscosity` [Pa s] liquids look alike to the simulator in the chosen pour.
    """
    return {
        **_action(pour.chosen),
        "spillage_q95": pour.chosen.spillage_q95,
        "least_viscosity": least_viscosity,
        "n_simulations": n_simulations,
        "risk": settings.risk,
        "seed": settings.seed,
        "plug_in": {**_action(pour.plug_in), "spillage_q95": pour.plug_in.spillage_q95},
    }


def _action(judged: "Judged") -> dict[str, float]:
    return {
        "angular_velocity_deg_s": float(np.degrees(judged.angular_velocity)),
        "distance_cm": 100.0 * judged.distance,
        "expected_spillage": judged.expected_spillage,
    }


def read_pour(run: Path) -> "DataTree":
    """pour.nc of a run.

    Raises:
        InputError: The file is damaged.
    """
    return read_tree(run / POUR, fix=f"write it again: bolfi-liquids pour {run}")


def pour_tree(
    pour: "Pour",
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
        coords={name: (name, getattr(surface, name), {"units": UNITS[name]}) for name in ACTION},
    )


def _outcomes(judged: "Judged") -> "Dataset":
    from xarray import Dataset

    columns = zip(FRACTIONS, judged.fractions.T, strict=True)
    return Dataset(
        {name: ("outcome", values) for name, values in columns},
        attrs={"angular_velocity": judged.angular_velocity, "distance": judged.distance},
    )
