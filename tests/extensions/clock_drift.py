"""An effect of one's own: cameras whose clock runs fast."""

import numpy as np
from bolfi_liquids.models import Effect


def make_prior():
    import numpyro.distributions as dist

    return dist.Normal(0.0, 0.01)


def signal(time, angles, coefficient):
    from scipy.interpolate import CubicSpline

    moments = time[0] + (time - time[0]) * (1.0 - coefficient[:, None])
    moments = np.minimum(moments, time[-1])  # after the last sample nothing is known
    pairs = zip(angles, moments, strict=True)
    return np.stack([CubicSpline(time, trial)(moment) for trial, moment in pairs])


EFFECT = Effect(
    name="clock_drift",
    unit="1",
    neutral=0.0,
    acts_in="sensor",
    text="The cameras' clock runs fast by this share of the time (negative: slow).",
    source="Two crystals of different rate: seen(t) = true(t (1 - drift)), by a cubic spline",
    make_prior=make_prior,
    signal=signal,
)
