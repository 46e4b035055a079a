"""Posterior sampling: NUTS, ensemble, importance sampling, quadrature; convergence."""
