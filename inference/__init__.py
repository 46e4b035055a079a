"""Likelihood-free Bayesian inference for expensive, noisy simulators.

The names of `__init__.pyi` are those that a user types; each room (`checks`, `criticism`,
`simulations`, `surrogates`) has more of its own. Nothing here knows what is simulated.
"""

import lazy_loader

# loaded on use: a worker that imports `.simulations.job` must not pay for JAX
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
