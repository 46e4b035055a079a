"""One replicate: data simulated from a draw of the prior, and what the pipeline makes of them."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np

from .._lazy import array_stats
from ..arguments import Unusable, checked_array, float64, is_table
from ..simulations.failures import Failure, not_finite, raised, unusable
from ..simulations.job import Job, run_batch, stacked
from ..types import Simulator

FAILURES = (Exception, SystemExit)  # many programs end by the latter
DRAW_SPACING = 2  # autocorrelation times between kept draws: an AR(1) chain keeps exp(-4) = 0.02
MIN_DRAWS = 4  # draws per chain that an effective sample size can be estimated from
SIMULATOR, PIPELINE, NOISE = range(3)  # streams of random numbers within a replicate

LogDensity = Callable[[dict[str, np.ndarray]], np.ndarray]
"""theta: name -> [n]  ->  [n]: log density of a posterior, up to a constant."""

Observe = Callable[[np.ndarray, np.random.Generator], np.ndarray]
"""(signal, rng) -> observed: what measuring adds to what is simulated."""


class Pipeline(Protocol):
    """Anything that draws from a posterior. It must be picklable to run in other processes."""

    def __call__(self, observed: np.ndarray, seed: int, /) -> Any:
        """Posterior draws: name -> [chain, draw] or [draw], or a tree with a posterior group.

        May return (draws, log_density) instead, see `LogDensity`: the rank of the truth's
        density is then checked too, the only check that sees a posterior that ignores the data.
        """
        ...


class ReplicatePlan(NamedTuple):
    """Settings that all replicates share."""

    pipeline: Pipeline
    simulate: Simulator
    observe: Observe | None
    names: tuple[str, ...]
    seed: int
    draws: int
    independent: bool
    timeout: float | None = None  # s, that simulating the data of one replicate may take


class Replicate(NamedTuple):
    """One replicate, finished or failed; `error` says why, and `stage` where."""

    number: int
    truth: np.ndarray  # [d]
    observed: np.ndarray  # empty where there was none
    draws: np.ndarray  # [m, d], independent; m = 0 where failed
    log_density: np.ndarray | None  # [1 + m], the truth's first
    effective: float  # sample size of all draws that the pipeline made
    seconds: float
    stage: str | None = None
    error: Failure | None = None


def stream(seed: int, number: int, part: int) -> np.random.SeedSequence:
    """Random numbers of one part of one replicate, unlike those of any other."""
    return np.random.SeedSequence(seed, spawn_key=(number, part))


def _seed(seed: int, number: int, part: int) -> int:
    return int(stream(seed, number, part).generate_state(1)[0] >> 1)


def run_replicate(plan: ReplicatePlan, number: int, truth: np.ndarray) -> Replicate:
    """Simulate at `truth` [d], run the pipeline, thin its draws.

    An exception of the simulator, of `observe` or of the pipeline is kept, and so are draws
    that are not finite, and that the simulator returned something else than a signal.

    Raises:
        ValueError: the pipeline returned something of the wrong form, which is a mistake that
            every replicate would repeat.
    """
    started = time.perf_counter()
    empty = Replicate(number, truth, np.zeros(0), truth[None][:0], None, np.nan, np.nan)

    def failed(stage: str, error: Failure, observed: np.ndarray = empty.observed) -> Replicate:
        seconds = time.perf_counter() - started
        return empty._replace(observed=observed, seconds=seconds, stage=stage, error=error)

    theta = dict(zip(plan.names, truth.tolist(), strict=True))
    job = Job(theta, _seed(plan.seed, number, SIMULATOR))
    (made,) = run_batch(plan.simulate, [job], None, plan.timeout)
    if made.error is not None:
        return failed("simulator", made.error)
    try:
        observed = _observed(plan, number, stacked([made])[0])
    except Unusable as error:
        return failed("observe", unusable(f"an array of numbers is expected, got {error.got}"))
    except FAILURES as error:  # whatever the user's code raises costs this replicate only
        return failed("observe", raised(error))
    if not np.isfinite(observed).any():
        return failed("simulator", not_finite("no value of the signal"), observed)
    try:
        drawn = plan.pipeline(observed.copy(), _seed(plan.seed, number, PIPELINE))
    except FAILURES as error:
        return failed("pipeline", raised(error), observed)
    drawn, log_density = drawn if isinstance(drawn, tuple) else (drawn, None)
    array = posterior_array(drawn, plan.names)
    if not np.isfinite(array).all():
        return failed("pipeline", not_finite("a draw"), observed)
    effective = float(array[..., 0].size) if plan.independent else effective_size(array)
    kept = thin(array, plan.draws, np.inf if plan.independent else effective)
    try:
        densities = _densities(plan, log_density, truth, kept)
    except FAILURES as error:
        return failed("log density", raised(error), observed)
    seconds = time.perf_counter() - started
    return Replicate(number, truth, observed, kept, densities, effective, seconds)


def _observed(plan: ReplicatePlan, number: int, signal: np.ndarray) -> np.ndarray:
    if plan.observe is None:
        return signal
    rng = np.random.default_rng(stream(plan.seed, number, NOISE))
    return float64(plan.observe(signal, rng))


def _densities(
    plan: ReplicatePlan, log_density: LogDensity | None, truth: np.ndarray, draws: np.ndarray
) -> np.ndarray | None:
    if log_density is None:
        return None
    # always as many rows, so that a compiled density is compiled once
    filler = np.repeat(truth[None], plan.draws - len(draws), axis=0)
    rows = np.concatenate([truth[None], draws, filler])
    values = float64(log_density(as_theta(rows, plan.names)))
    if values.shape != (len(rows),) or np.isnan(values).any():
        raise ValueError(
            f"log_density must return shape {(len(rows),)} without NaN, got {values.shape} with "
            f"{int(np.isnan(values).sum())}"
        )
    return values[: 1 + len(draws)]


def as_theta(rows: np.ndarray, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """[n, d] -> name -> [n]."""
    return {name: rows[:, j] for j, name in enumerate(names)}


def posterior_array(drawn: Any, names: Sequence[str]) -> np.ndarray:
    """Stack posterior draws.

    Args:
        drawn: Mapping or data frame of name -> [chain, draw] or [draw], or an object with such a
            mapping as `.posterior` (DataTree, InferenceData). Other names are ignored.
        names: The parameters wanted.

    Returns:
        float64 [chain, draw, d], in the order of `names`.

    Raises:
        ValueError: a parameter is missing, or shapes are not as above and equal.
    """
    posterior = getattr(drawn, "posterior", drawn)
    if not is_table(posterior):
        raise ValueError(
            "a pipeline must return name -> draws or a tree with a posterior group, "
            f"got {type(drawn).__name__}"
        )
    missing = [name for name in names if name not in posterior]
    if missing:
        raise ValueError(
            f"the pipeline's draws must hold the parameters {tuple(names)}, "
            f"got {tuple(map(str, posterior))}"
        )
    columns = [checked_array(f"draws of {name!r}", posterior[name]) for name in names]
    shapes = {name: column.shape for name, column in zip(names, columns, strict=True)}
    if len(set(shapes.values())) > 1 or columns[0].ndim not in (1, 2) or columns[0].size == 0:
        raise ValueError(
            f"draws must all have one shape, [chain, draw] or [draw], not empty, got {shapes}"
        )
    stacked = np.stack(columns, -1)
    return stacked if stacked.ndim == 3 else stacked[None]


def effective_size(draws: np.ndarray) -> float:
    """The least effective sample size of draws [chain, draw, d], over bulk, tails and parameters.

    Rank-normalised, split chains (Vehtari et al. 2021). A parameter that never moves counts as
    one draw; chains shorter than `MIN_DRAWS` show no autocorrelation and count in full.
    """
    total = draws.shape[0] * draws.shape[1]
    if draws.shape[1] < MIN_DRAWS:
        return float(total)
    if (np.ptp(draws, axis=(0, 1)) == 0.0).any():
        return 1.0
    ess = partial(array_stats().ess, draws, chain_axis=0, draw_axis=1)
    sizes = [total, *ess(method="bulk"), *ess(method="tail", prob=(0.1, 0.9))]
    return max(1.0, float(np.nanmin(sizes)))


def thin(draws: np.ndarray, most: int, effective: float) -> np.ndarray:
    """At most `most` draws, evenly spaced and `DRAW_SPACING` autocorrelation times apart.

    Args:
        draws: [chain, draw, d].
        most: Upper limit of what is kept.
        effective: Independent draws that these are worth; infinite keeps any spacing.

    Returns:
        [m, d], m >= 1.
    """
    joined = draws.reshape(-1, draws.shape[-1])
    n = int(max(1.0, min(most, len(joined), effective / DRAW_SPACING)))
    return joined[((np.arange(n) + 0.5) * len(joined) / n).astype(int)]
