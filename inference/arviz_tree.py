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

from collections.abc import Mapping
from importlib.metadata import version
from typing import TYPE_CHECKING

import arviz_base
import numpy as np
import xarray as xr

from .history import History
from .prior import Prior
from .sampling.convergence import diagnose
from .sampling.draw import Sampled

if TYPE_CHECKING:
    from .result import Fit

PREDICTED_DRAWS = 50  # draws of each chain for which the surrogate predicts
SAMPLE_DIMS = ("chain", "draw")


def simulations_dataset(prior: Prior, history: History) -> xr.Dataset:
    """Every simulation along dimension `simulation`, in the order told."""
    signals = history.signals
    axes = [f"signal_dim_{i}" for i in range(signals.ndim - 1)]
    columns = {name: ("simulation", c) for name, c in prior.to_dict(history.theta).items()}
    return xr.Dataset(
        {
            **columns,
            "seed": ("simulation", history.seeds),
            "round": ("simulation", history.rounds),
            "discrepancy": ("simulation", history.discrepancy),
            "failed": ("simulation", ~history.succeeded),
            "error": ("simulation", history.errors),
            "signal": (["simulation", *axes], signals),
        }
    )


def results_tree(
    fit: "Fit", made: Sampled, seed: int, attributes: Mapping[str, object]
) -> xr.DataTree:
    """The tree that `Fit.sample` returns.

    Args:
        fit: What was sampled.
        made: The draws.
        seed: Of the prior's draws, as many as each chain's, and of the predictions.
        attributes: Of the root.
    """
    prior, chains = fit.prior, made.chains
    posterior = prior.from_unit(chains.u)
    rng = np.random.default_rng([seed, *b"prior"])
    drawn = prior.from_unit(rng.random((chains.u.shape[1], len(prior))))
    tree = arviz_base.from_dict(
        {
            "posterior": posterior,
            "sample_stats": dict(chains.stats),
            "prior": {name: values[None] for name, values in drawn.items()},
            "observed_data": {"signal": fit.observed},
        }
    )
    tree["simulations"] = xr.DataTree(fit.simulations)
    for group in ("posterior", "prior", "simulations"):
        for name, described in prior.describe().items():
            tree[group][name].attrs.update(described)
    diagnosed = {name: diagnose(draws) for name, draws in posterior.items()}
    for name, measures in diagnosed.items():
        tree["posterior"][name].attrs.update(measures)
    tree["posterior"].attrs.update(
        rhat_max=max(measures["rhat"] for measures in diagnosed.values()),
        ess_bulk_min=min(measures["ess_bulk"] for measures in diagnosed.values()),
        ess_tail_min=min(measures["ess_tail"] for measures in diagnosed.values()),
        divergences=int(np.sum(chains.stats.get("diverging", 0))),
        status=made.status,
        draws_made=made.steps,
        **made.checks,
    )
    constants = {name: np.asarray(value) for name, value in fit.learned.constants().items()}
    if constants:
        tree["constant_data"] = arviz_base.from_dict({"constant_data": constants})["constant_data"]
    _predict(tree, fit, chains.u, np.random.default_rng([seed, *b"predictive"]))
    tree["emulator_checks"] = xr.DataTree(_emulator_checks(fit))
    for group in tree.children.values():
        sampled = [name for name in SAMPLE_DIMS if name in group.dims]
        group.attrs.pop("sample_dims", None)
        if sampled:
            group.attrs["sample_dims"] = sampled
    tree.attrs.update(attributes, version=version("bolfi-liquids"))
    return tree


def _predict(tree: xr.DataTree, fit: "Fit", u: np.ndarray, rng: np.random.Generator) -> None:
    """Add posterior_predictive at evenly spaced ones of the draws u [chain, draw, d]."""
    chains, draws, d = u.shape
    rows = np.linspace(0, draws - 1, min(draws, PREDICTED_DRAWS)).round().astype(int)
    predicted = fit.learned.predictive(rng, u[:, rows].reshape(-1, d))
    groups = {
        name: np.asarray(values).reshape(chains, len(rows), *np.shape(values)[1:])
        for name, values in predicted.items()
    }
    if groups:
        made = arviz_base.from_dict({"posterior_predictive": groups}, coords={"draw": rows})
        tree["posterior_predictive"] = made["posterior_predictive"]


def _emulator_checks(fit: "Fit") -> xr.Dataset:
    """The surrogate's checks with a row for each simulation."""
    columns = {}
    for name, values in fit.learned.checks().items():
        of_all = np.full((len(fit.training_mask), *values.shape[1:]), np.nan)
        of_all[fit.training_mask] = values
        axes = (f"{name}_dim_{i}" for i in range(values.ndim - 1))
        columns[name] = (["simulation", *axes], of_all)
    return xr.Dataset(columns, attrs={"warnings": "\n".join(fit.warnings)})
