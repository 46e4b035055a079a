"""pour.nc and the section "pour" of summary.json.

Groups of pour.nc: `tried` and `tried_plug_in`, over actions, what each spilled over the draws;
`chosen` and `plug_in`, over outcomes, fractions with fresh seeds; `liquids`, the posterior draws
that were poured; `surface`, the expected spillage that the surrogate sees over a grid.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .settings import PourSettings
from .spillage import ACTION, FRACTIONS

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

    from .inference import Fit
    from .pouring import Judged, Pour

GRID = 41
UNITS = {"angular_velocity": "rad s-1", "distance": "m"}


def pour_section(
    pour: "Pour", settings: PourSettings, searches: Sequence["Fit"], least_viscosity: float
) -> dict[str, Any]:
    """Numbers of a pour, in the design's form: degrees and centimetres, fractions of liquid.

    `n_simulations` counts pours of one liquid, in both searches and in judging. Below
    `least_viscosity` [Pa s] liquids look alike to the simulator in the chosen pour.
    """
    searched = sum(fit.simulations["signal"][:, :, 0].size for fit in searches)
    judged = len(pour.chosen.fractions) + len(pour.plug_in.fractions)
    return {
        **_action(pour.chosen),
        "spillage_q95": pour.chosen.spillage_q95,
        "least_viscosity": least_viscosity,
        "n_simulations": int(searched + judged),
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


def pour_tree(
    pour: "Pour", over_posterior: "Fit", at_best: "Fit", liquids: Mapping[str, NDArray]
) -> "DataTree":
    """Everything that a report shows of a pour."""
    from xarray import Dataset, DataTree

    groups = {
        "tried": _tried(over_posterior),
        "tried_plug_in": _tried(at_best),
        "chosen": _outcomes(pour.chosen),
        "plug_in": _outcomes(pour.plug_in),
        "liquids": Dataset({name: ("draw", values) for name, values in liquids.items()}),
        "surface": _surface(over_posterior),
    }
    return DataTree.from_dict({f"/{name}": dataset for name, dataset in groups.items()})


def _tried(fit: "Fit") -> "Dataset":
    from xarray import Dataset

    simulations = fit.simulations
    action = {
        name: ("action", simulations[name].to_numpy(), {"units": UNITS[name]}) for name in ACTION
    }
    return Dataset(
        {
            **action,
            "risk": ("action", simulations["discrepancy"].to_numpy()),
            "spilled": (("action", "draw"), simulations["signal"].to_numpy()[:, :, 0]),
        }
    )


def _outcomes(judged: "Judged") -> "Dataset":
    from xarray import Dataset

    columns = zip(FRACTIONS, judged.fractions.T, strict=True)
    return Dataset(
        {name: ("outcome", values) for name, values in columns},
        attrs={"angular_velocity": judged.angular_velocity, "distance": judged.distance},
    )


def _surface(fit: "Fit") -> "Dataset":
    from xarray import Dataset

    quantiles = np.repeat(np.linspace(0.0, 1.0, GRID)[:, None], len(ACTION), axis=1)
    axes = fit.prior.from_unit(quantiles)
    mesh = np.meshgrid(*(axes[name] for name in ACTION), indexing="ij")
    mean, _ = fit.surrogate.predict(dict(zip(ACTION, (m.ravel() for m in mesh), strict=True)))
    # the surrogate sees the square root of the spillage, and no bounds to it
    spillage = np.clip(mean, 0.0, 1.0).reshape(mesh[0].shape) ** 2
    return Dataset(
        {"spillage": (ACTION, spillage)},
        coords={name: (name, axes[name], {"units": UNITS[name]}) for name in ACTION},
    )
