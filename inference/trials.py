"""A posterior from losses, or from the trials that an optimiser leaves."""

from os import PathLike
from typing import Any

import numpy as np
import numpyro.distributions as dist
from numpy.typing import ArrayLike

from .arguments import check_flag, checked_array, checked_integer, checked_number, is_table, require
from .bolfi import MIN_LEARN, Bolfi
from .prior import Prior, checked_prior
from .result import Fit
from .types import Theta

ONE_CHOICE = "of several choices take the trials of one, as a data frame with a column `loss`"
OTHERWISE = (
    f"give a prior, in which a whole number from 1 to 20 is Uniform(0.5, 20.5); {ONE_CHOICE}, "
    "without parameters of one value"
)
"""The cure where the search space of a study is no prior."""


def fit_losses(
    theta: Theta,
    loss: ArrayLike,
    prior: Prior,
    *,
    noise: float | None = None,
    n: int | None = None,
    warn: bool = True,
) -> Fit:
    """Infer parameters from losses that are sums of squares, as an optimiser leaves them.

    With a known noise the log likelihood is -loss / (2 noise^2); with an unknown one, of prior
    1 / noise, it is -(n / 2) log(loss). Any other loss is a log likelihood by your own formula:
    `fit(None, prior, surrogate="log_likelihood", budget=0, earlier=(theta, values))`.

    Args:
        theta: Name -> [m], in the prior's support; it may be a data frame.
        loss: Sum over n data of (datum - model)^2 [m]; NaN is a failed trial, and inf is
            impossible.
        prior: The parameters and their priors, such as the ranges of the search.
        noise: Sd of the data's noise, in their units; 1 if the squares are divided by variances.
        n: Number of independent data in the sum, where their noise is unknown.
        warn: As in `fit`.

    Raises:
        ValueError: bad argument; not one of noise and n; negative losses, or, with n, a zero; fewer
            than three finite ones.

    Warns:
        EmulatorWarning: for each of the surrogate's complaints, unless warn=False.

    Example:
        >>> import numpy as np
        >>> import numpyro.distributions as dist
        >>> from bolfi_liquids import inference
        >>> prior = inference.Prior({"a": dist.Uniform(0, 2)})
        >>> a = np.linspace(0, 2, 20)  # what an optimiser tried
        >>> fit = inference.fit_losses({"a": a}, 1 + 20 * (a - 1.2) ** 2, prior, noise=0.2)
        >>> draws = fit.sample("quadrature")["posterior"]["a"]
        >>> print(f"{draws.mean():.2f} {draws.std():.2f}")  # exactly: 1.2 and 0.2 / sqrt(20)
        1.20 0.04
    """
    return _fit(prior, theta, _log_likelihoods(loss, noise, n), warn)


def from_trials(
    prior: Prior | None,
    trials: Any,
    *,
    noise: float | None = None,
    n: int | None = None,
    log_likelihood: bool = False,
    warn: bool = True,
) -> Fit:
    """Infer parameters from an optimiser's trials: how certain is the best one?

    Args:
        prior: The parameters and their priors. None is the study's search ranges: Uniform, or
            LogUniform where it searches logarithms.
        trials: An Optuna study, or what has its `trials` and `directions`; or a table with a column
            for each parameter of the prior and one named `loss`, what was minimised: a data frame,
            a mapping, or the path of a CSV file. Other columns are not read. A study's failed
            trials are failed runs. Its pruned and unfinished ones, whose loss is not known, are
            left out. Where it maximises, losses are its values with their signs changed.
        noise, n: Of losses that are sums of squares, see `fit_losses`.
        log_likelihood: Whether losses are minus a log likelihood, in place of `noise` and `n`.
        warn: As in `fit`.

    Raises:
        ValueError: bad argument or losses, see `fit_losses`; several objectives; parameters that
            some complete trials lack; without a prior, a table, or a study that searched whole
            numbers, choices, or ranges that changed.
        OSError: there is no such file.

    Warns:
        EmulatorWarning: for each of the surrogate's complaints, unless warn=False.
    """
    is_study = hasattr(trials, "trials") and hasattr(trials, "directions")
    theta, loss = _of_study(trials) if is_study else _of_table(trials, prior)
    prior = _search_ranges(trials) if prior is None else checked_prior(prior)
    due = f"have the parameters of the trials, {tuple(theta)}"
    require(set(prior.names) == set(theta), "prior", due, prior.names)
    return _fit(prior, theta, _log_likelihoods(loss, noise, n, log_likelihood), warn)


def _log_likelihoods(
    loss: ArrayLike, noise: float | None, n: int | None, log_likelihood: bool = False
) -> np.ndarray:
    check_flag("log_likelihood", log_likelihood)
    if (noise is not None) + (n is not None) + log_likelihood != 1:
        raise ValueError(
            "give exactly one of noise=, the sd of the data's noise, n=, the number of data in a "
            "loss, and, to from_trials, log_likelihood=True, got "
            f"log_likelihood={log_likelihood}, noise={noise!r:.100} and n={n!r:.100}"
        )
    losses = checked_array("loss", loss)
    if log_likelihood:
        return -losses
    finite = int(np.isfinite(losses).sum())
    due = f"hold {MIN_LEARN} finite numbers"
    require(finite >= MIN_LEARN, "loss", due, finite, cure="simulate more")
    least = np.nanmin(losses)
    due = f"hold sums of squares, {'positive' if noise is None else 'from 0'}"
    cure = (
        "give noise= for a perfect fit"
        if least == 0.0
        else "leave such trials out; a study of sums of squares must minimise; and minus a log "
        "likelihood goes in by from_trials(log_likelihood=True)"
    )
    fits = least > 0.0 or (least == 0.0 and noise is not None)
    require(fits, "loss", due, float(least), cure=cure)
    if noise is None:
        return -0.5 * checked_integer("n", n) * np.log(losses)
    sd = checked_number("noise", noise, lambda sd: 0.0 < sd < np.inf, "positive and finite")
    return -0.5 * losses / sd**2


def _fit(prior: Prior, theta: Theta, values: np.ndarray, warn: bool) -> Fit:
    """Of log likelihoods [m], one for each loss."""
    engine = Bolfi(prior, surrogate="log_likelihood", initial=MIN_LEARN)
    m = len(np.atleast_2d(prior.to_array(theta)))
    require(values.shape == (m,), "loss", f"have shape ({m},), one per theta", values.shape)
    engine.tell(theta, values)
    return engine.fit(warn=warn, stacklevel=4)


def _of_table(table: Any, prior: Prior | None) -> tuple[Theta, Any]:
    if isinstance(table, str | PathLike):
        import pandas as pd

        table = pd.read_csv(table)
    due = "be an Optuna study, a table, or the path of a CSV file"
    require(is_table(table), "trials", due, table)
    require(prior is not None, "prior", "be given with a table, which has no search ranges", prior)
    names, held = getattr(prior, "names", ()), list(table.keys())
    cure = "rename that parameter: the column holds losses"
    require("loss" not in names, "prior", "have no parameter `loss`", names, cure=cure)
    columns = [*names, "loss"]
    due = f"have the columns {columns}"
    cure = "rename what has another name, or give an Optuna study itself"
    require(set(columns) <= set(held), "trials", due, held, cure=cure)
    return {name: table[name] for name in columns[:-1]}, table["loss"]


def _of_study(study: Any) -> tuple[Theta, np.ndarray]:
    one = len(study.directions) == 1
    due = "have one objective"
    require(one, "trials", due, study.directions, cure="give its sum as a table's `loss`")
    sign = -1.0 if study.directions[0].name == "MAXIMIZE" else 1.0
    done = _finished(study)
    loss = [sign * trial.value if trial.state.name == "COMPLETE" else np.nan for trial in done]
    theta = {name: np.array([t.params[name] for t in done]) for name in done[0].params}
    return theta, np.array(loss)


def _finished(study: Any) -> list[Any]:
    """Trials that are complete, and those that failed with all parameters chosen."""
    complete = [trial for trial in study.trials if trial.state.name == "COMPLETE"]
    due = f"hold complete ones among {len(study.trials)}"
    require(complete, "trials", due, 0, cure="optimise first")
    names = complete[0].params.keys()
    for trial in complete:
        alike = trial.params.keys() == names
        due = f"all have the parameters {tuple(names)}"
        require(alike, "trials", due, tuple(trial.params), cure=ONE_CHOICE)
    failed = [t for t in study.trials if t.state.name == "FAIL" and t.params.keys() == names]
    return complete + failed


def _search_ranges(study: Any) -> Prior:
    """The prior that a study searched."""
    done = _finished(study)
    found = {}
    for name, of in done[0].distributions.items():
        real = type(of).__name__ == "FloatDistribution" and of.low < of.high
        due = f"choose {name!r} from a range of real numbers"
        require(real, "without a prior trials", due, of, cure=OTHERWISE)
        others = [t.distributions[name] for t in done if t.distributions[name] != of]
        due = f"all choose {name!r} from {of}"
        require(not others, "without a prior trials", due, others[:1], cure="give a prior")
        found[name] = (dist.LogUniform if of.log else dist.Uniform)(of.low, of.high)
    return Prior(found)
