"""Results as xarray, in ArviZ's schema."""

from collections.abc import Mapping
from importlib.metadata import version

import arviz_base
import numpy as np
import xarray as xr
from arviz_stats.base.array import array_stats

from .prior import Prior
from .state import History


def simulations_dataset(prior: Prior, history: History) -> xr.Dataset:
    """Every simulation along dimension `simulation`, in the order told."""
    axes = [f"signal_dim_{i}" for i in range(history.signals.ndim - 1)]
    columns = {name: ("simulation", c) for name, c in prior.to_dict(history.theta).items()}
    return xr.Dataset(
        {
            **columns,
            "seed": ("simulation", history.seeds),
            "round": ("simulation", history.rounds),
            "discrepancy": ("simulation", history.discrepancy),
            "failed": ("simulation", ~history.succeeded),
            "error": ("simulation", history.errors),
            "signal": (["simulation", *axes], history.signals),
        }
    )


def posterior_tree(
    groups: Mapping[str, Mapping[str, np.ndarray]],
    simulations: xr.Dataset,
    attributes: Mapping[str, object],
) -> xr.DataTree:
    """Assemble and diagnose.

    Args:
        groups: ArviZ group -> variable -> array; draws are [chain, draw].
        simulations: Becomes a group of its own.
        attributes: How the result was made; kept at the root.

    Returns:
        Tree that `to_netcdf` can write. Each posterior variable carries `rhat`, `ess_bulk`
        and `ess_tail`; the posterior group their worst values and `divergences`.
    """
    tree = arviz_base.from_dict(groups)
    tree["simulations"] = xr.DataTree(simulations)
    tree.attrs.update(attributes, version=version("bolfi-liquids"))
    posterior = tree["posterior"]
    diagnosed = {name: diagnose(draws) for name, draws in groups["posterior"].items()}
    for name, measures in diagnosed.items():
        posterior[name].attrs.update(measures)
    posterior.attrs.update(
        rhat_max=max(measures["rhat"] for measures in diagnosed.values()),
        ess_bulk_min=min(measures["ess_bulk"] for measures in diagnosed.values()),
        ess_tail_min=min(measures["ess_tail"] for measures in diagnosed.values()),
        divergences=int(np.sum(groups["sample_stats"]["diverging"])),
    )
    return tree


def diagnose(draws: np.ndarray) -> dict[str, float]:
    """Rank-normalised split R-hat, bulk and tail ESS (Vehtari et al. 2021) of [chain, draw]."""
    measures = {
        "rhat": array_stats.rhat(draws),
        "ess_bulk": array_stats.ess(draws, method="bulk"),
        "ess_tail": array_stats.ess(draws, method="tail", prob=(0.05, 0.95)),
    }
    return {name: np.asarray(value).item() for name, value in measures.items()}
