"""Checks of an effect at its registration, before anything is simulated with it."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from .effect import Effect
from .rig import Rig

if TYPE_CHECKING:
    from numpyro.distributions import Distribution

DRAWS, TRIED = 512, 4  # of the prior; with which hooks are tried
MAX_OUTSIDE = 0.01  # share of the prior beyond `lowest` and `highest`
END = 1e-6  # of the way from the neutral coefficient to the prior's median
LEAST_LOG_DENSITY = -100.0  # of the neutral coefficient, below the prior's largest
TOLERANCE = 1e-6  # of the largest value, where nothing may change
VISCOSITY_TOLERANCE = 1e-5  # likewise, in float32

_untried: dict[str, np.ndarray] = {}  # coefficients by the name of an effect with a rheology


def check_effect(effect: Effect) -> None:
    """Refuse an effect whose prior or hooks break the rules of `Effect`.

    Each hook is called with `TRIED` draws of the prior and with the neutral coefficient, on arrays
    of a made-up stir, and must treat each simulation alike, whichever others are there. A rheology
    is made, but tried with the first scene that compiles it: Taichi is not started for it.

    Raises:
        ValueError: the message says what is wrong, what was found, and what to do.
    """
    try:
        prior = _made("make_prior", effect.make_prior)
        for fault in _prior_faults(effect, prior):
            raise ValueError(fault)
        coefficients = _draws(prior)
        inside = (coefficients >= effect.lowest) & (coefficients <= effect.highest)
        tried = np.resize(coefficients[inside], TRIED)
        for name, call, given in _host_hooks(effect):
            _check_hook(name, call, given, effect.neutral, tried)
            _check_lanes(name, call, given, tried)
        if effect.make_rheology is not None:
            _check_rheology_is_made(effect.make_rheology)
            _untried[effect.name] = tried
    except ValueError as fault:
        raise ValueError(f"effect {effect.name!r}: {fault}") from fault


def check_rheology(effect: Effect) -> None:
    """Try the rheology of a registered effect, once, on viscosities of its own; Taichi runs.

    Raises:
        ValueError: it does not compile, or a viscosity is not finite or negative, or changes at
            the neutral coefficient.
    """
    tried = _untried.get(effect.name)
    if tried is None or effect.make_rheology is None:
        return
    import taichi as ti

    rheology = effect.make_rheology()

    @ti.kernel
    def evaluate(rows: ti.types.ndarray(ti.f32, 2)):  # type: ignore  (Taichi's own types)
        for i in range(rows.shape[0]):
            rows[i, 4] = rheology(rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3])

    states = (1e-3, 1.0, 20.0), (0.0, 0.1, 10.0), (0.0, 5.0), (effect.neutral, *tried)
    states = np.stack([*map(np.ravel, np.meshgrid(*states))], axis=1)
    rows = np.column_stack([states, states[:, 0]]).astype(np.float32)
    try:
        evaluate(rows)
    except Exception as err:
        raise ValueError(f"effect {effect.name!r}: its rheology fails: {_told(err)}") from err
    before, rate, time, coefficient, after = rows.T
    changed = np.abs(after - before) > VISCOSITY_TOLERANCE * before
    wrong = (
        ~np.isfinite(after) | (after < 0.0) | changed & (coefficient == np.float32(effect.neutral))
    )
    if wrong.any():
        at = int(np.argmax(wrong))
        raise ValueError(
            f"effect {effect.name!r}: its rheology makes {after[at]:g} Pa s of {before[at]:g} at "
            f"{rate[at]:g} 1/s and {time[at]:g} s with the coefficient {coefficient[at]:g}; return "
            "a finite viscosity, not negative, and the same one at the neutral coefficient"
        )
    del _untried[effect.name]


def _prior_faults(effect: Effect, prior: "Distribution") -> Iterator[str]:
    from numpyro.distributions import Distribution

    if not isinstance(prior, Distribution):
        yield f"make_prior must return a numpyro distribution, got {prior!r}"
    if prior.batch_shape or prior.event_shape or prior.is_discrete:
        yield (
            "make_prior must return a distribution of one continuous number, got batch shape "
            f"{prior.batch_shape}, event shape {prior.event_shape}"
        )
    draws = _draws(prior)
    if not np.isfinite(draws).all():
        yield f"the prior's draws must be finite, got {draws[~np.isfinite(draws)][0]}"
    if not _is_possible(effect.neutral, prior, draws):
        yield (
            f"the prior gives the neutral coefficient {effect.neutral} no density (its support is "
            f"{prior.support}); let it hold the value at which there is no effect"
        )
    outside = float(np.mean((draws < effect.lowest) | (draws > effect.highest)))
    if outside > MAX_OUTSIDE:
        yield (
            f"{100 * outside:.0f} % of the prior lies outside of lowest={effect.lowest:g} and "
            f"highest={effect.highest:g}, where no coefficient may be; truncate the prior or move "
            "these limits"
        )


def _is_possible(value: float, prior: "Distribution", draws: np.ndarray) -> bool:
    """Whether a value is in a prior's support or at its end, and not out of all proportion."""
    support: Any = prior.support
    low, high = (getattr(support, f"{end}_bound", np.nan) for end in ("lower", "upper"))
    if value < low or value > high:
        return False
    # numpyro counts the end of an interval as outside, the zero of a half-normal for one
    inside = value + END * (float(np.median(draws)) - value)
    densities = np.asarray(prior.log_prob(np.append(draws, inside)))
    return bool(densities[-1] > densities[:-1].max() + LEAST_LOG_DENSITY)


def _draws(prior: "Distribution") -> np.ndarray:
    """The same draws of a prior at each call, float64 [DRAWS]."""
    from jax import random

    try:
        return np.asarray(prior.sample(random.key(0), (DRAWS,)), np.float64)
    except Exception as err:
        raise ValueError(f"the prior cannot be sampled: {_told(err)}; give another") from err


def _host_hooks(effect: Effect) -> Iterator[tuple[str, Callable, tuple[np.ndarray, ...]]]:
    """Each hook on NumPy arrays: a function of arrays of a made-up stir and of coefficients, whose
    results are to have the shapes of the first of these arrays, and the arrays."""
    time = np.linspace(0.0, 3.0, 61)
    turn = np.arange(1, TRIED + 1)[:, None] * time
    if (rig := effect.rig) is not None:
        path = np.stack([0.02 * np.sin(turn), 0.02 * np.cos(turn), 0.235 + 0.0 * turn], axis=-1)
        fields = (*(np.full(TRIED, value) for value in (0.0168, 1e-5, 0.05)), path)
        yield "rig", lambda *arrays: rig(Rig(*arrays[:-1]), arrays[-1]), fields
    if (signal := effect.signal) is not None:
        angles = 0.05 * np.stack([np.sin(turn), np.cos(turn)], axis=-1)
        yield "signal", lambda angles, time, c: (signal(time, angles, c),), (angles, time)
    if (wetting := effect.wetting) is not None:
        yield "wetting", lambda cosine, c: (wetting(cosine, c),), (np.linspace(-0.4, 0.9, TRIED),)


def _check_hook(
    name: str, call: Callable, given: tuple[np.ndarray, ...], neutral: float, tried: np.ndarray
) -> None:
    """Call a hook with the neutral coefficient and with others, and look at what it returns."""
    for coefficient in (np.full(TRIED, float(neutral)), tried):
        arrays = [array.copy() for array in (*given, coefficient)]
        try:
            returned = call(*arrays)
        except Exception as err:
            raise ValueError(f"the hook {name} fails with {coefficient}: {_told(err)}") from err
        if name == "rig" and not isinstance(returned, Rig):
            raise ValueError(f"the hook rig must return a Rig, got {type(returned).__name__}")
        if any((a != b).any() for a, b in zip(arrays, (*given, coefficient), strict=True)):
            raise ValueError(f"the hook {name} writes into its arguments; return new arrays")
        for before, after in zip(given, map(np.asarray, returned), strict=False):
            if after.shape != before.shape:
                raise ValueError(
                    f"the hook {name} returned shape {after.shape} for {TRIED} simulations, "
                    f"expected {before.shape}; return the shape that it was given"
                )
            if after.dtype.kind not in "fiu":
                raise ValueError(
                    f"the hook {name} returned {after.dtype} values; return real numbers"
                )
            if not np.isfinite(after).all():
                raise ValueError(
                    f"the hook {name} returned values that are not finite with coefficients "
                    f"{coefficient}; narrow the prior, or mend the hook there"
                )
            off = float(np.abs(after - before).max())
            if (coefficient == neutral).all() and off > TOLERANCE * np.abs(before).max():
                raise ValueError(
                    f"the hook {name} changes a value by {off:.3g} at the neutral coefficient "
                    f"{neutral:g}; let it change nothing there, or give another `neutral`"
                )


def _check_lanes(
    name: str, call: Callable, given: tuple[np.ndarray, ...], tried: np.ndarray
) -> None:
    """Call a hook again, and with fewer simulations in another order: each keeps its values."""
    arrays = (*given, tried)
    every, fewer = np.arange(TRIED), np.arange(TRIED)[:0:-1]
    first = _called(name, call, arrays, every)
    for order, what in (
        (every, "differ from call to call"),
        (fewer, "depend on other simulations"),
    ):
        for all_of, some in zip(first, _called(name, call, arrays, order), strict=True):
            wanted = all_of[order]
            off = np.inf if some.shape != wanted.shape else np.abs(some - wanted).max()
            if not off <= TOLERANCE * np.abs(all_of).max():  # nor NaN
                raise ValueError(
                    f"the hook {name} returns values that {what}; let each simulation's "
                    "depend on its own arguments alone, without random numbers"
                )


def _called(
    name: str, call: Callable, arrays: tuple[np.ndarray, ...], order: np.ndarray
) -> list[np.ndarray]:
    """Arrays that a hook returns for some of the simulations; times [T] are of all of them."""
    try:
        some = [array[order] if len(array) == TRIED else array.copy() for array in arrays]
        return [np.asarray(array) for array in call(*some)]
    except Exception as err:
        raise ValueError(
            f"the hook {name} fails with {len(order)} simulations: {_told(err)}"
        ) from err


def _check_rheology_is_made(make: Callable[[], Any]) -> None:
    """Make a rheology, without starting Taichi."""
    from . import runtime  # noqa: F401  it keeps Taichi from printing when it is imported

    if not callable(made := _made("make_rheology", make)):
        raise ValueError(f"make_rheology must return a ti.func, got {made!r}")


def _made(name: str, make: Callable[[], Any]) -> Any:
    try:
        return make()
    except Exception as err:
        raise ValueError(f"{name} fails: {_told(err)}") from err


def _told(err: Exception) -> str:
    return f"{type(err).__name__}: {err}"
