"""What `Fit.sample` returns: a tree in ArviZ's schema, with these groups.

posterior: draws [chain, draw] in the parameters' own units. Attributes of each: `prior`, `units`
(where the prior has them), `rhat`, `ess_bulk`, `ess_tail`, and Monte Carlo standard errors of mean
and 5 and 95 % quantiles, `mcse_mean`, `mcse_q05`, `mcse_q95`. Of the group: `status` ("converged",
or what is wrong), `rhat_max`, `ess_bulk_min`, `ess_tail_min`, `divergences`, `draws_made` (per
chain, before thinning); for one or two parameters `quadrature_total_variation` (of 16 equally
probable bins; independent draws as many as the effective ones stay below
`quadrature_total_variation_limit`); `log_evidence` and `log_evidence_error`, see `Fit.evidence`.

sample_stats: `lp`, log density over Phi^-1(u) of the prior quantiles u, and what the sampler
records. prior: as many draws. observed_data: `signal`, and where samples of it are missing or
averaged, or summarised, also the `values` that are compared. posterior_predictive,
prior_predictive: what the surrogate predicts at each draw, of the same names, or the "discrepancy"
or "log_likelihood" of a run. log_prior: log density of each parameter in its own units.

log_likelihood: log density of each observed value given all others, which leave-one-out
cross-validation needs (Buerkner, Gabry and Vehtari 2021): "signal" or "values", or "observed" where
all that was observed is one datum. These densities do not add up to the likelihood where values
hang together, by correlated noise, noise of unknown size or the emulator's error; where that shows
in the draws, "dependence" is what they lack, so that the group's sum is the log likelihood, as
`az.psense_summary` wants it. `az.loo` and `az.compare` then need `var_name="signal"`.

constant_data: the surrogate's constants. emulator_checks: the surrogate's own checks for each
simulation, NaN where it learned nothing from one, and the fit's complaints in the attribute
`warnings`. simulations: as `Fit.simulations`. The root's attributes hold how the run was made, the
seconds it took, and `fit_status`.
"""

from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

from ._lazy import xr
from .sampling.convergence import diagnose
from .sampling.draw import Sampled
from .sampling.target import Target, log_likelihood

NO_DEPENDENCE = 0.1  # nats, sd over draws, too small to matter to powers of the likelihood
SAMPLE_DIMS = ("chain", "draw")


def tree_of(fit: Any, made: Sampled, seed: int, attributes: Mapping[str, object]) -> "xr.DataTree":
    """The tree of the draws made of a `Fit`.

    Args:
        seed: Of the prior's draws, as many as each chain's, and of the predictions.
        attributes: Of the root.
    """
    import arviz_base

    prior, chains, length = fit.prior, made.chains, made.chains.u.shape[1]
    posterior = prior.from_unit(chains.u)
    rng = np.random.default_rng([seed, *b"prior"])
    u_before = rng.random((length, len(prior)))
    before = {name: values[None] for name, values in prior.from_unit(u_before).items()}
    generators = (np.random.default_rng([seed, *kind]) for kind in (b"predictive", b"before"))
    shapes = (chains.u.shape[:2], (1, length))
    drawn = chains.u.reshape(-1, len(prior)), u_before
    predicted, expected = (
        _shaped(fit.learned.predictive(generator, u), shape)
        for generator, u, shape in zip(generators, drawn, shapes, strict=True)
    )
    log_prior = prior.log_probs({name: values.ravel() for name, values in posterior.items()})
    constants = {name: np.asarray(value) for name, value in fit.learned.constants().items()}
    groups = {
        "posterior": posterior,
        "sample_stats": dict(chains.stats),
        "prior": before,
        "log_prior": _shaped(log_prior, shapes[0]),
        "log_likelihood": _shaped(_log_likelihoods(fit, drawn[0]), shapes[0]),
        "posterior_predictive": predicted,
        "prior_predictive": expected,
        "observed_data": {"signal": np.atleast_1d(fit.observed), **fit.learned.compared},
        "constant_data": constants,
    }
    tree = arviz_base.from_dict({name: held for name, held in groups.items() if held})
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
        log_evidence=fit.evidence.log,
        log_evidence_error=fit.evidence.error,
        **made.checks,
    )
    tree["emulator_checks"] = xr.DataTree(_emulator_checks(fit))
    for group in tree.children.values():
        sampled = [name for name in SAMPLE_DIMS if name in group.dims]
        group.attrs.pop("sample_dims", None)
        if sampled:
            group.attrs["sample_dims"] = sampled
    tree.attrs.update(attributes, version=version("bolfi-liquids"))
    return tree


def _shaped(groups: Mapping[str, np.ndarray], shape: tuple[int, int]) -> dict[str, np.ndarray]:
    """Rows [n, ...] as chains and draws [*shape, ...]."""
    return {name: np.reshape(of, (*shape, *np.shape(of)[1:])) for name, of in groups.items()}


def _log_likelihoods(fit: Any, u: np.ndarray) -> dict[str, np.ndarray]:
    """Log densities of the observed values at u [n, d], and what their sum lacks."""
    terms = fit.learned.pointwise(u)
    target = Target(fit.learned.log_likelihood, len(fit.prior))
    total = log_likelihood(target, u) + fit.learned.log_constant
    rest = total - sum(of.reshape(len(u), -1).sum(1) for of in terms.values())
    together = rest.std() > NO_DEPENDENCE
    return {**terms, **({"dependence": rest} if together else {})}


def _emulator_checks(fit: Any) -> "xr.Dataset":
    """The surrogate's checks with a row for each simulation."""
    columns = {}
    for name, values in fit.learned.checks().items():
        of_all = np.full((len(fit.training_mask), *values.shape[1:]), np.nan)
        of_all[fit.training_mask] = values
        axes = (f"{name}_dim_{i}" for i in range(values.ndim - 1))
        columns[name] = (["simulation", *axes], of_all)
    return xr.Dataset(columns, attrs={"warnings": "\n".join(fit.warnings)})
