"""What ELFI gives on two tutorials of the guide's page `elfi`; runs in ELFI's own environment:

.venv-peers/elfi/bin/python tests/benchmarks/peers/tutorials_elfi.py
"""

import elfi
import numpy as np
from elfi.examples import ma2, ricker


def learned(distance, bounds, n, seed, jitter):
    """Points [m, d] of a grid and their posterior weights [m], with the tutorial's settings."""
    settings = {"batch_size": 1, "initial_evidence": 20, "update_interval": 10}
    variances = dict(zip(bounds, jitter))  # noqa: B905  Python 3.9
    bolfi = elfi.BOLFI(distance, bounds=bounds, acq_noise_var=variances, seed=seed, **settings)
    posterior = bolfi.fit(n_evidence=n, bar=False)
    cells = 120 if len(bounds) == 2 else 35
    axes = [np.linspace(low, high, cells + 1)[1:-1] for low, high in bounds.values()]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(bounds))
    parts = np.array_split(points, 40)
    log_density = np.concatenate([np.ravel(posterior.logpdf(part)) for part in parts])
    weights = np.exp(log_density - np.nanmax(log_density))
    weights[~np.isfinite(weights)] = 0.0
    return points, weights / weights.sum()


def show(name, seed, points, weights):
    mean = weights @ points
    print(name, seed, mean.round(3), np.sqrt(weights @ (points - mean) ** 2).round(3), flush=True)


def of_ma2(seed):
    w = np.random.default_rng(20170530).normal(size=102)
    observed = w[2:] + 0.6 * w[1:-1] + 0.2 * w[:-2]
    model = elfi.ElfiModel()
    first = elfi.Prior(ma2.CustomPrior1, 2, model=model, name="t1")
    second = elfi.Prior(ma2.CustomPrior2, first, 1, name="t2")
    series = elfi.Simulator(ma2.MA2, first, second, observed=observed[None])
    lags = [elfi.Summary(ma2.autocov, series, lag) for lag in (1, 2)]
    distance = elfi.Operation(np.log, elfi.Distance("euclidean", *lags))
    for n in (50, 200):
        bounds = {"t1": (-2, 2), "t2": (-1, 1)}
        show(f"ma2 {n}", seed, *learned(distance, bounds, n, seed, (0.1, 0.1)))


def of_ricker(seed):
    rng, stock, counts = np.random.default_rng(1), 1.0, []
    for _ in range(50):
        stock *= np.exp(3.8 - stock + 0.3 * rng.normal())
        counts.append(rng.poisson(10 * stock))

    def simulate(rate, log_sd, log_scale, batch_size=1, random_state=None):
        theta = rate, np.exp(log_sd), np.exp(log_scale)
        return ricker.stochastic_ricker(*theta, batch_size=batch_size, random_state=random_state)

    model = elfi.ElfiModel()
    bounds = {"rate": (3, 5), "log_sd": tuple(np.log([0.05, 1])), "log_scale": (0, np.log(100))}
    for name, (low, high) in bounds.items():
        elfi.Prior("uniform", low, high - low, model=model, name=name)
    parents = [model[name] for name in bounds]
    series = elfi.Simulator(simulate, *parents, observed=np.array([counts], float))
    functions = (lambda y: y.mean(axis=1), lambda y: y.var(axis=1), ricker.num_zeros)
    summaries = [elfi.Summary(function, series) for function in functions]
    distance = elfi.Operation(np.log, elfi.Discrepancy(ricker.chi_squared, *summaries))
    jitter = [(0.05 * (high - low)) ** 2 for low, high in bounds.values()]
    points, weights = learned(distance, bounds, 100, seed, jitter)
    points[:, 1:] = np.exp(points[:, 1:])
    show("ricker 100", seed, points, weights)


if __name__ == "__main__":
    for seed in range(3):
        of_ma2(seed)
        of_ricker(seed)
