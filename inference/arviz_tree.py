"""Results as xarray, in ArviZ's schema.

posterior: draws [chain, draw] in the parameters' own units. Attributes of each: `prior`, `units`
(where the prior has them), `rhat`, `ess_bulk`, `ess_tail`, and Monte Carlo standard errors of mean
and 5 and 95 % quantiles, `mcse_mean`, `mcse_q05`, `mcse_q95`. Of the group: `status` ("converged",
or what is wrong), `rhat_max`, `ess_bulk_min`, `ess_tail_min`, `divergences`, `draws_made` (per
chain, before thinning); for one or two parameters `quadrature_total_variation` (of 16 equally
probable bins; independent draws as many as the effective ones stay below
`quadrature_total_variation_limit`) and `log_evidence` of the surrogate's likelihood.

sample_stats: `lp`, log density over Phi^-1(u) of the prior quantiles u, and what the sampler
records. prior: as many draws. observed_data: `signal`. posterior_predictive: what the surrogate
predicts at some draws, whose indices are its coordinate `draw`. constant_data: the surrogate's
constants. emulator_checks: the surrogate's own checks for each simulation, NaN where it learned
nothing from one, and the fit's complaints in the attribute `warnings`. simulations: as
`Fit.simulations`. The root's attributes hold how the run was made, the seconds it took, and
`fit_status`.
"""

from collections.abc import Mapping, Sequence
from importlib.metadata import version

import arviz_base
import numpy as np
import xarray as xr

from .history import History
from .prior import Prior
from .sampling.convergence import diagnose
from .sampling.target import Chains
from .surrogates.base import Surrogate

PREDICTED_DRAWS = 50  # draws of each chain for which the surrogate predicts
SAMPLE_DIMS = ("chain", "draw")


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


def results_tree(
    prior: Prior,
    chains: Chains,
    prior_draws: Mapping[str, np.ndarray],
    observed: np.ndarray,
    simulations: xr.Dataset,
) -> xr.DataTree:
    """The groups that every result has: posterior, prior, sample_stats, observed_data, simulations.

    Args:
        prior: Gives names, units and descriptions to the parameters.
        chains: The draws.
        prior_draws: Name -> [n], in natural units.
        observed: The measured signal.
        simulations: Becomes a group of its own.

    Returns:
        Tree that `to_netcdf` can write. Each parameter carries its `prior` and, where known,
        its `units`; in the posterior also R-hat, ESS and Monte Carlo standard errors (in its
        own units) as from `convergence.diagnose`. The posterior's attributes hold the worst
        of these and the number of `divergences`.
    """
    posterior = prior.from_unit(chains.u)
    tree = arviz_base.from_dict(
        {
            "posterior": posterior,
            "sample_stats": dict(chains.stats),
            "prior": {name: values[None] for name, values in prior_draws.items()},
            "observed_data": {"signal": observed},
        }
    )
    tree["simulations"] = xr.DataTree(simulations)
    for group in ("posterior", "prior", "simulations"):
        for name, attributes in prior.describe().items():
            tree[group][name].attrs.update(attributes)
    diagnosed = {name: diagnose(draws) for name, draws in posterior.items()}
    for name, measures in diagnosed.items():
        tree["posterior"][name].attrs.update(measures)
    tree["posterior"].attrs.update(
        rhat_max=max(measures["rhat"] for measures in diagnosed.values()),
        ess_bulk_min=min(measures["ess_bulk"] for measures in diagnosed.values()),
        ess_tail_min=min(measures["ess_tail"] for measures in diagnosed.values()),
        divergences=int(np.sum(chains.stats.get("diverging", 0))),
    )
    return tree


def add_surrogate(
    tree: xr.DataTree, surrogate: Surrogate, u: np.ndarray, rng: np.random.Generator
) -> None:
    """Add what the surrogate says of itself: constant_data, and posterior_predictive at evenly
    spaced draws u [chain, draw, d], whose indices are its coordinate `draw`."""
    constants = {name: np.asarray(value) for name, value in surrogate.constants().items()}
    if constants:
        tree["constant_data"] = arviz_base.from_dict({"constant_data": constants})["constant_data"]
    chains, draws, d = u.shape
    rows = np.linspace(0, draws - 1, min(draws, PREDICTED_DRAWS)).round().astype(int)
    predicted = surrogate.predictive(rng, u[:, rows].reshape(-1, d))
    groups = {
        name: np.asarray(values).reshape(chains, len(rows), *np.shape(values)[1:])
        for name, values in predicted.items()
    }
    if groups:
        made = arviz_base.from_dict({"posterior_predictive": groups}, coords={"draw": rows})
        tree["posterior_predictive"] = made["posterior_predictive"]


def add_checks(
    tree: xr.DataTree,
    checks: Mapping[str, np.ndarray],
    training_mask: np.ndarray,
    warnings: Sequence[str],
) -> None:
    """Add emulator_checks, whose first axis is the simulation, with rows of NaN where nothing was
    learned from one (`training_mask`, bool [n]). The attribute `warnings` joins what the fit
    complains of, one per line, and is empty where there is nothing."""
    columns = {}
    for name, values in checks.items():
        of_all = np.full((len(training_mask), *values.shape[1:]), np.nan)
        of_all[training_mask] = values
        axes = (f"{name}_dim_{i}" for i in range(values.ndim - 1))
        columns[name] = (["simulation", *axes], of_all)
    attributes = {"warnings": "\n".join(warnings)}
    tree["emulator_checks"] = xr.DataTree(xr.Dataset(columns, attrs=attributes))


def finished(tree: xr.DataTree, attributes: Mapping[str, object]) -> xr.DataTree:
    """The tree with how it was made at its root, and in each group ArviZ's `sample_dims`."""
    for group in tree.children.values():
        sampled = [name for name in SAMPLE_DIMS if name in group.dims]
        group.attrs.pop("sample_dims", None)
        if sampled:
            group.attrs["sample_dims"] = sampled
    tree.attrs.update(attributes, version=version("bolfi-liquids"))
    return tree
