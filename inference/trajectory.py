"""The no-U-turn sampler as a machine that evaluates one point per step, for many chains at once.

Hoffman and Gelman (2014), with multinomial choice along the trajectory and the generalised
criterion (Betancourt 2017, appendix A), trees grown iteratively (Phan et al. 2019, NumPyro).
Two things differ from NumPyro's. Every chain goes on by itself: none waits at the end of a
draw for the longest tree among them. And one place in the program asks for density and
gradient, for first points, leapfrog steps and jumps alike, which halves the time to compile.

Before each trajectory the chain may jump: an independence Metropolis step from `mixture`, by
which chains move between separated modes. Both moves keep the posterior, so their succession
does.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .mixture import UNIFORMS, Mixture, propose
from .mixture import log_density as log_mixture

MAX_DEPTH = 10
DIVERGENT = 1000.0  # loss of log density that marks a divergent trajectory
SHRINK, DELAY, DECAY = 0.05, 10.0, 0.75  # gamma, t0, kappa of dual averaging (2014, section 3.2)


class Point(NamedTuple):
    x: jax.Array  # [d]
    log_density: jax.Array  # []
    gradient: jax.Array  # [d]


class Edge(NamedTuple):
    """End of a trajectory."""

    point: Point
    momentum: jax.Array  # [d], whitened


class Tree(NamedTuple):
    """A stretch of trajectory, and the point chosen from it so far."""

    chosen: Point
    log_size: jax.Array  # [], log of the summed densities relative to the start
    momentum: jax.Array  # [d], summed


class StepSize(NamedTuple):
    """Dual averaging; `average` is what sampling uses."""

    log: jax.Array
    average: jax.Array
    error: jax.Array
    updates: jax.Array
    centre: jax.Array


class Chain(NamedTuple):
    """Between two evaluations; here of one chain, in the program with a leading axis."""

    now: Point
    jumping: jax.Array  # bool: the next point to evaluate is a proposed jump
    jumped: jax.Array  # bool: the last one was accepted
    tree: Tree
    left: Edge
    right: Edge
    depth: jax.Array
    grown: Tree  # the subtree that doubles the tree
    edge: Edge
    forward: jax.Array  # bool
    leaves: jax.Array  # of the subtree
    marks: jax.Array  # [MAX_DEPTH, 2, d], momentum and its sum at the starts of inner subtrees
    start: jax.Array  # log density of position and momentum at the start
    acceptance: jax.Array  # summed over the leapfrog steps
    steps: jax.Array
    step_size: StepSize


class Settings(NamedTuple):
    """Common to all chains."""

    factor: np.ndarray  # [d, d], L of the inverse mass matrix L L^T
    mixture: Mixture
    target_acceptance: float
    adapting: bool


STATISTICS = ("lp", "diverging", "acceptance_rate", "n_steps", "energy", "step_size", "jumped")
"""ArviZ's names of what is recorded with each draw; `jumped`: began with an accepted jump."""


def begin(x: np.ndarray, step_size: float) -> Chain:
    """Chains about to evaluate their first points x [n, d]; in NumPy, whose arrays, unlike
    JAX's, need no program of their own to be compiled."""
    n, d = x.shape
    start: Any = x
    zero: Any = np.zeros(n)
    vectors: Any = np.zeros((n, d))
    none: Any = np.zeros(n, int)
    yes: Any = np.ones(n, bool)
    marks: Any = np.zeros((n, MAX_DEPTH, 2, d))
    nowhere = Point(start, zero - np.inf, vectors)
    tree, edge = Tree(nowhere, zero, vectors), Edge(nowhere, vectors)
    return Chain(
        *(nowhere, yes, yes, tree, edge, edge, none, tree, edge, yes, none, marks),
        *(zero, zero, none, first_step_size(n, step_size)),
    )


def first_step_size(n: int, value: float) -> StepSize:
    """Dual averaging before its first update, for n chains."""
    zero: Any = np.zeros(n)
    log = zero + np.log(value)
    return StepSize(log, log, zero, zero, log + np.log(10.0))


class Noise(NamedTuple):
    """What drives one step of n chains; of more steps with a further leading axis."""

    momentum: jax.Array  # [n, d], standard normal
    choices: jax.Array  # [n, 3], uniform
    jump_normals: jax.Array  # [n, d]
    jump_uniforms: jax.Array  # [n, UNIFORMS]


def draw_noise(rng: np.random.Generator, shape: tuple[int, int], dimension: int) -> Noise:
    """For shape = (steps, chains); by NumPy, since JAX's takes a second to compile."""
    momentum: Any = rng.standard_normal((*shape, dimension))
    choices: Any = 1.0 - rng.random((*shape, 3))  # in (0, 1]: their logs are finite
    jump_normals: Any = rng.standard_normal((*shape, dimension))
    jump_uniforms: Any = 1.0 - rng.random((*shape, UNIFORMS))
    return Noise(momentum, choices, jump_normals, jump_uniforms)


def step(
    chains: Chain, waiting: jax.Array, noise: Noise, settings: Settings, evaluate: Any
) -> tuple[Chain, jax.Array, jax.Array]:
    """Evaluate one point of each chain.

    Args:
        chains: As `begin` or the last step left them.
        waiting: Chains that stay as they are, bool [n].
        noise: Of this step.
        settings: What all chains share.
        evaluate: x [d] -> log density and its gradient.

    Returns:
        The chains after it; which of them finished a draw [n]; x and STATISTICS of the draws
        [n, d + 7], of meaning only where finished.
    """
    # Conditionals where masks would do: what a branch returns is computed once, while fused
    # masks repeat their common operands in each of some hundred outputs, to be compiled each.
    jumping = chains.jumping & ~waiting
    target = jax.lax.cond(jumping.any(), _targets, _stay, chains, noise, settings)
    half, leap = jax.vmap(_half_step, in_axes=(0, None))(chains, settings)
    x = jnp.where(chains.jumping[:, None], target, leap)
    value, gradient = jax.vmap(evaluate)(x)
    finite = jnp.isfinite(value) & jnp.isfinite(gradient).all(-1)
    point = Point(x, jnp.where(finite, value, -jnp.inf), jnp.where(finite[:, None], gradient, 0.0))
    moved = jax.lax.cond(
        jumping.any(), _jumped, _not_jumped, jumping, chains, point, noise, settings
    )
    leaping = ~chains.jumping & ~waiting
    moved, gain, bad = jax.lax.cond(
        leaping.any(), _leapt, _not_leapt, leaping, moved, Edge(point, half), noise, settings
    )
    full = leaping & (bad | (moved.leaves >= 2**moved.depth))
    return jax.lax.cond(full.any(), _settled, _not_settled, full, bad, gain, moved, noise, settings)


def _stay(chains: Chain, noise: Noise, settings: Settings) -> jax.Array:
    return chains.now.x


def _targets(chains: Chain, noise: Noise, settings: Settings) -> jax.Array:
    """Where to jump; a chain that never moved evaluates its own place first."""
    targets = propose(settings.mixture, noise.jump_normals, noise.jump_uniforms)
    return jnp.where((chains.steps == 0)[:, None], chains.now.x, targets)


def _not_jumped(_: jax.Array, chains: Chain, *__: Any) -> Chain:
    return chains


def _jumped(
    jumping: jax.Array, chains: Chain, point: Point, noise: Noise, settings: Settings
) -> Chain:
    jump = jax.vmap(_jump, in_axes=(0, 0, 0, 0, None))
    after = jump(chains, point, noise.momentum, noise.choices, settings)
    return jax.vmap(_choose)(jumping, after, chains)


def _not_leapt(leaping: jax.Array, chains: Chain, *_: Any) -> tuple[Chain, jax.Array, jax.Array]:
    return chains, jnp.zeros(len(leaping)), leaping


def _leapt(
    leaping: jax.Array, chains: Chain, edges: Edge, noise: Noise, settings: Settings
) -> tuple[Chain, jax.Array, jax.Array]:
    leap = jax.vmap(_leap, in_axes=(0, 0, 0, None))
    after, gain, bad = leap(chains, edges, noise.choices, settings)
    return jax.vmap(_choose)(leaping, after, chains), gain, bad & leaping


def _not_settled(
    full: jax.Array, bad: jax.Array, gain: jax.Array, chains: Chain, *_: Any
) -> tuple[Chain, jax.Array, jax.Array]:
    return chains, full, jnp.zeros((len(full), chains.now.x.shape[1] + len(STATISTICS)))


def _settled(  # noqa: PLR0913  a branch takes what its twin takes
    full: jax.Array,
    bad: jax.Array,
    gain: jax.Array,
    chains: Chain,
    noise: Noise,
    settings: Settings,
) -> tuple[Chain, jax.Array, jax.Array]:
    settle = jax.vmap(_settle, in_axes=(0, 0, 0, 0, None))
    after, ended, records = settle(chains, bad, gain < -DIVERGENT, noise.choices, settings)
    return jax.vmap(_choose)(full, after, chains), ended & full, records


def _choose(condition: jax.Array, yes: Any, no: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def _signed_step(chain: Chain, settings: Settings) -> jax.Array:
    log_step = jnp.where(settings.adapting, chain.step_size.log, chain.step_size.average)
    return jnp.exp(log_step) * jnp.where(chain.forward, 1.0, -1.0)


def _half_step(chain: Chain, settings: Settings) -> tuple[jax.Array, jax.Array]:
    """Momentum after half a leapfrog step, and the position after all of it."""
    signed = _signed_step(chain, settings)
    point, momentum = chain.edge
    half = momentum + 0.5 * signed * (point.gradient @ settings.factor)
    return half, point.x + signed * (half @ settings.factor.T)


def _jump(
    chain: Chain, point: Point, momentum: jax.Array, choices: jax.Array, settings: Settings
) -> Chain:
    """Accept or refuse the jump, and set out on a trajectory."""
    here, there = log_mixture(settings.mixture, jnp.stack([chain.now.x, point.x]))
    gain = (point.log_density - there) - (chain.now.log_density - here)
    accepted = jnp.log(choices[0]) < gain
    now = _choose(accepted, point, chain.now)
    tree, edge = Tree(now, jnp.asarray(0.0), momentum), Edge(now, momentum)
    forward = choices[1] < 0.5
    return chain._replace(
        now=now,
        jumping=jnp.asarray(False),
        jumped=accepted,
        tree=tree,
        left=edge,
        right=edge,
        depth=jnp.asarray(0),
        edge=edge,
        forward=forward,
        start=now.log_density - 0.5 * momentum @ momentum,
        acceptance=jnp.asarray(0.0),
        steps=jnp.asarray(0),
        **_bare(now),
    )


def _bare(point: Point) -> dict[str, Any]:
    """A subtree without leaves."""
    empty = Tree(point, jnp.asarray(-jnp.inf), jnp.zeros_like(point.x))
    return {"grown": empty, "leaves": jnp.asarray(0)}


def _leap(
    chain: Chain, edge: Edge, choices: jax.Array, settings: Settings
) -> tuple[Chain, jax.Array, jax.Array]:
    """Add a leaf, whose momentum lacks its second half step, to the subtree.

    Returns:
        The chain; the leaf's log density relative to the start; whether it ends the
        trajectory, by a divergence or an inner turn.
    """
    push = 0.5 * _signed_step(chain, settings) * (edge.point.gradient @ settings.factor)
    momentum = edge.momentum + push
    gain = edge.point.log_density - 0.5 * momentum @ momentum - chain.start
    gain = jnp.where(jnp.isnan(gain), -jnp.inf, gain)
    log_size = jnp.logaddexp(chain.grown.log_size, gain)
    take = jnp.log(choices[0]) < gain - log_size
    chosen = _choose(take, edge.point, chain.grown.chosen)
    grown = Tree(chosen, log_size, chain.grown.momentum + momentum)
    marks, turning = _inner_turn(chain, momentum, grown.momentum)
    after = chain._replace(
        grown=grown,
        edge=Edge(edge.point, momentum),
        leaves=chain.leaves + 1,
        marks=marks,
        acceptance=chain.acceptance + jnp.exp(jnp.minimum(gain, 0.0)),
        steps=chain.steps + 1,
    )
    return after, gain, turning | (gain < -DIVERGENT)


def _settle(
    chain: Chain, bad: jax.Array, diverging: jax.Array, choices: jax.Array, settings: Settings
) -> tuple[Chain, jax.Array, jax.Array]:
    """Join a complete subtree to the tree and go on at one of its ends, or end the trajectory.

    Returns:
        The chain; whether the trajectory ended; x and STATISTICS of the draw.
    """
    take = ~bad & (jnp.log(choices[1]) < chain.grown.log_size - chain.tree.log_size)
    chosen = _choose(take, chain.grown.chosen, chain.tree.chosen)
    momentum = chain.tree.momentum + chain.grown.momentum
    left = _choose(chain.forward, chain.left, chain.edge)
    right = _choose(chain.forward, chain.edge, chain.right)
    turned = _is_turning(left.momentum, right.momentum, momentum)
    depth = chain.depth + 1
    ended = bad | turned | (depth >= MAX_DEPTH)
    forward = choices[2] < 0.5
    rate = chain.acceptance / chain.steps
    adapted = _adapted(chain.step_size, settings.target_acceptance - rate)
    size = jnp.abs(_signed_step(chain, settings))
    numbers = (chosen.log_density, diverging, rate, chain.steps, -chain.start, size, chain.jumped)
    record = jnp.concatenate([chosen.x, jnp.stack([jnp.asarray(n, float) for n in numbers])])
    after = chain._replace(
        now=_choose(ended, chosen, chain.now),
        jumping=ended,
        tree=Tree(chosen, jnp.logaddexp(chain.tree.log_size, chain.grown.log_size), momentum),
        left=left,
        right=right,
        depth=depth,
        edge=_choose(forward, right, left),
        forward=forward,
        step_size=_choose(ended & settings.adapting, adapted, chain.step_size),
        **_bare(chosen),
    )
    return after, ended, record


def _inner_turn(
    chain: Chain, momentum: jax.Array, summed: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Whether a balanced stretch that ends with this leaf turns; marks for later leaves.

    Leaf n (from 0) starts inner subtrees if n is even, and is marked in the slot that counts
    its set bits but the last; if odd, it ends as many as it has trailing ones.
    """
    n = chain.leaves
    top = jax.lax.population_count(n >> 1)
    ends = jax.lax.population_count(n & ~(n + 1))
    slots = jnp.arange(MAX_DEPTH)
    new = jnp.stack([momentum, summed])
    marked = ((slots == top) & (n % 2 == 0))[:, None, None]
    marks = jnp.where(marked, new, chain.marks)
    stretch = summed - marks[:, 1] + marks[:, 0]
    turns = jax.vmap(_is_turning, in_axes=(0, None, 0))(marks[:, 0], momentum, stretch)
    return marks, (turns & (slots <= top) & (slots > top - ends)).any()


def _is_turning(first: jax.Array, last: jax.Array, summed: jax.Array) -> jax.Array:
    middle = summed - 0.5 * (first + last)
    return (first @ middle <= 0.0) | (last @ middle <= 0.0)


def _adapted(size: StepSize, error: jax.Array) -> StepSize:
    """One update of dual averaging; `error` is wanted minus seen acceptance."""
    updates = size.updates + 1.0
    share = 1.0 / (updates + DELAY)
    mean_error = (1.0 - share) * size.error + share * error
    log = size.centre - jnp.sqrt(updates) / SHRINK * mean_error
    weight = updates**-DECAY
    return StepSize(
        log, weight * log + (1.0 - weight) * size.average, mean_error, updates, size.centre
    )
