"""Criticism of what `fit` returned."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..result import Fit
from ..surrogates.noise.scales import Plain
from ..surrogates.signal import SignalSurrogate
from .criticise import Criticism, criticise
from .experiment import Experiment
from .measurement_noise import DRAWS, AutoregressiveNoise, KnownNoise, Noise
from .misfit import Window
from .model_extension import Extensions


def criticise_fit(
    fit: Fit,
    extensions: Extensions,
    *,
    noise: Noise | None = None,
    windows: Sequence[Window] = (),
    **how: Any,
) -> Criticism:
    """`criticise` the simulator of a fit, whose simulations are those of the base model.

    Args:
        fit: What `fit` returned, with any surrogate.
        extensions: What the simulator may lack, by name. The simulator gets those coefficients
            that act beside the parameters.
        noise: Between the simulator and the data; None is what the fit was given or, for a series
            of one channel, estimated. An estimate holds what the simulator misses, and hides some
            of it.
        windows: Where to look for disagreement.
        how: Other arguments of `criticise`, such as `held_out`, `bank` or `seed`.

    Raises:
        ValueError: the fit has no recipe, its noise is not known, its signals have another shape
            than what was observed, or an argument is bad.
    """
    recipe, found = fit.recipe, noise_of(fit) if noise is None else noise
    if found is None:
        raise ValueError(
            "the noise between simulator and data is not known; give noise=, such as "
            "criticism.KnownNoise(0.05), or what criticism.rest_noise learns from a stretch at rest"
        )
    data = Experiment(recipe.simulate, fit.observed, found, recipe.identity, windows=tuple(windows))
    history, signals = fit.history, fit.history.signals
    if signals.shape[1:] != fit.observed.shape:
        raise ValueError(
            f"a criticism needs signals of the shape {fit.observed.shape}, as observed, got "
            f"{signals.shape[1:]}"
        )
    rows = fit.training_mask & np.isfinite(signals.reshape(len(signals), -1)).all(axis=1)
    earlier = fit.prior.to_dict(history.theta[rows]), signals[rows], history.seeds[rows]
    return criticise(data, fit.prior, extensions, earlier=earlier, **how)


def noise_of(fit: Fit) -> Noise | None:
    """The measurement noise that a fit was given, or estimated; None where draws of it cannot be
    made of that: of a summary, by the mean, of an estimate over several channels or of averages.
    """
    family = fit.recipe.options["surrogate"]
    given = getattr(family, "noise", None)
    if getattr(family, "summary", None) is not None:
        return None
    if hasattr(given, "covariance") and hasattr(given, "draw"):
        return given
    if isinstance(given, int | float):
        return KnownNoise(float(given))
    if given is not None:
        shape, there = np.shape(given), np.isfinite(fit.observed)
        return KnownNoise(np.asarray(given, float)[there]) if shape == there.shape else None
    return _estimated(fit)


def _estimated(fit: Fit) -> Noise | None:
    found = fit.learned
    if not isinstance(found, SignalSurrogate) or not isinstance(found.scale, Plain):
        return None
    output, alike = found.output, found.scale.stretch is None
    one_channel = output.series and not output.layout.channel.any()
    if not (alike and one_channel and (output.counts == 1).all()):
        return None
    weights = found.node_weights
    which = np.random.default_rng(0).choice(len(weights), DRAWS, p=weights)
    sd = found.nodes.sigma[which] * found.emulator.basis.scale[0]
    return AutoregressiveNoise(sd, found.nodes.rho[which])
