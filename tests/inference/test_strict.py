"""Stricter interpreters and libraries: warnings as errors, no docstrings, JAX's checks."""

import os
import subprocess
import sys

import pytest

STRICT = {
    "JAX_NUMPY_RANK_PROMOTION": "raise",
    "JAX_NUMPY_DTYPE_PROMOTION": "strict",
    "JAX_DEBUG_NANS": "1",
}
FITTED = """
import numpy as np
import numpyro.distributions as dist
from bolfi_liquids import inference

def simulate(theta, seeds):
    return theta["slope"][:, None] * np.linspace(0.0, 1.0, 20) + theta["offset"][:, None]

ends = {"low": 0.0, "high": 1.0}
prior = inference.Prior({
    "slope": dist.Normal(0.0, 1.0), "offset": dist.TruncatedNormal(0.5, 0.5, **ends),
})
observed = np.linspace(0.5, 0.8, 20)
quiet = {"budget": 12, "warn": False, "progress": False}
for family in ({"noise": 0.05}, {"surrogate": "discrepancy"}):
    fit = inference.fit(simulate, prior, observed, **family, **quiet)
    for sampler in SAMPLERS:
        draws = fit.sample(sampler, chains=2, draws=50, warmup=50, warn=False)["posterior"]
        print(sampler, float(draws["offset"].mean()))
"""


def printed(samplers, flags, variables):
    done = subprocess.run(
        [sys.executable, "-P", *flags, "-c", f"SAMPLERS = {samplers}\n{FITTED}"],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


@pytest.mark.slow
def test_a_fit_and_its_draws_are_the_same_under_every_strictness():
    samplers = "quadrature", "nuts", "emcee"
    plain = printed(samplers, [], {})
    assert len(plain.splitlines()) == 2 * len(samplers)
    assert printed(samplers, ["-W", "error", "-OO"], STRICT) == plain
