"""Criticism of what `fit` returned."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arguments import check_kind
from ..result import Fit, Recipe
from ..surrogates.noise.by_mean import Plain, law_of
from ..surrogates.noise.given import given_sds
from ..surrogates.signal import SignalFamily, SignalSurrogate
from .criticise import Criticism, criticise
from .experiment import Experiment, Extensions, Window
from .measurement_noise import DRAWS, AutoregressiveNoise, KnownNoise, Noise


def criticise_fit(
    fit: Fit,
    extensions: Extensions,
    *,
    noise: Noise | None = None,
    identity: str = "",
    windows: Sequence[Window] = (),
    **how: Any,
) -> Criticism:
    """`criticise` the simulator of a fit, whose simulations are those of the base model.

    Args:
        fit: What `fit` returned, with any surrogate.
        extensions: What the simulator may lack, by name; without any, it is only tested. The
            simulator gets those coefficients that act beside the parameters.
        noise: Between the simulator and the data; None is what the fit was given or, for a series
            of one channel, estimated. An estimate holds what the simulator misses, and hides some
            of it.
        identity: Names the simulator in a bank; the fit's, unless given.
        windows: Where to look for disagreement.
        how: Other arguments of `criticise`, such as `held_out`, `bank` or `seed`.

    Raises:
        ValueError: the fit has no recipe or no data, its noise is not known, its signals have
            another shape than what was observed, or an argument is bad.
    """
    recipe, found = recipe_of(fit), noise_of(fit) if noise is None else noise
    if found is None:
        raise ValueError(
            "the noise between simulator and data is not known; give noise=, such as "
            "criticism.KnownNoise(0.05), or what criticism.rest_noise learns from a stretch at rest"
        )
    named = identity or recipe.identity
    data = Experiment(recipe.simulate, fit.observed, found, named, windows=tuple(windows))
    history, signals = fit.history, fit.history.signals
    if signals.shape[1:] != fit.observed.shape:
        raise ValueError(
            f"a criticism needs signals of the shape {fit.observed.shape}, as observed, got "
            f"{signals.shape[1:]}"
        )
    rows = fit.training_mask & np.isfinite(signals.reshape(len(signals), -1)).all(axis=1)
    earlier = fit.prior.to_dict(history.theta[rows]), signals[rows], history.seeds[rows]
    return criticise(data, fit.prior, extensions, earlier=earlier, **how)


def recipe_of(fit: Fit) -> Recipe:
    """How a fit was made to data that its simulator simulates.

    Raises:
        ValueError: it is no fit, has no recipe, or its simulator returns log likelihoods.
    """
    check_kind("fit", fit, Fit)
    if not np.isfinite(fit.observed).any():
        raise ValueError(
            "the fit has no data: its simulator returns log likelihoods, so data can neither be "
            "simulated nor compared with it; fit a simulator of the data to them"
        )
    return fit.recipe


def noise_of(fit: Fit) -> Noise | None:
    """The measurement noise that a fit was given, or estimated; None where draws of it cannot be
    made of that: of a summary, by the mean, a covariance alone, of an estimate over several
    channels or of averages.
    """
    family = fit.family
    if not isinstance(family, SignalFamily) or family.summary is not None:
        return None
    given: Any = family.noise
    if given is None:
        return _estimated(fit)
    if isinstance(given, Noise):
        return given
    by_mean = law_of(given) is not None
    sds = None if by_mean else given_sds(given, family.view(fit.observed).output)
    return None if sds is None else KnownNoise(sds if sds.ndim else float(sds))


def _estimated(fit: Fit) -> Noise | None:
    found = fit.learned
    if not isinstance(found, SignalSurrogate) or type(found.scale) is not Plain:
        return None
    output = found.output
    one_channel = output.series and not output.layout.channel.any()
    if not (one_channel and (output.counts == 1).all()):
        return None
    weights = found.node_weights
    which = np.random.default_rng(0).choice(len(weights), DRAWS, p=weights)
    sd = found.nodes.sigma[which] * found.emulator.basis.scale[0]
    return AutoregressiveNoise(sd, found.nodes.rho[which])
