"""Apply the coefficients that a user gives to a liquid, a rig and a signal."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .effect import Effect
from .effects import EFFECTS, OWN_EFFECTS
from .liquid import Liquid
from .number_checks import checked_batch
from .rig import Rig


class Acting(NamedTuple):
    """An effect and its coefficients.

    Attributes:
        effect: The effect.
        coefficient: Of every simulation, neutral or not, float64 of shape [B].
    """

    effect: Effect
    coefficient: np.ndarray

    @property
    def changed(self) -> np.ndarray:
        """Which simulations it changes, bool [B]."""
        return self.coefficient != self.effect.neutral


def acting_in(scene: str, effects: Mapping[str, ArrayLike] | None, size: int) -> tuple[Acting, ...]:
    """The effects that change at least one of `size` simulations of a scene.

    They act in the alphabetical order of their names, so that the result depends on neither
    the mapping's order nor that of registration. Among the built-in ones only the cameras'
    do not commute, and there this is the physical order: late, turned about the vertical, and
    then rolled about the axis along which they look.

    Args:
        scene: "stir" or "pour"; what does not act in it is checked and left out.
        effects: Name -> coefficient, a scalar or of shape [size].
        size: Number of simulations, B.

    Raises:
        ValueError: an unknown name, or a coefficient that is not finite or of another shape.
    """
    if effects is None:
        return ()
    if not isinstance(effects, Mapping):
        raise ValueError(f"effects must map names to coefficients, got {effects!r}")
    unknown = [str(name) for name in effects if name not in EFFECTS]
    if unknown:
        raise ValueError(
            f"unknown effects: {', '.join(unknown)}; there are {', '.join(EFFECTS)}, "
            f"and {OWN_EFFECTS} or models.register adds others"
        )
    checked = [Acting(EFFECTS[n], _coefficient(n, effects[n], size)) for n in sorted(effects)]
    return tuple(a for a in checked if scene in a.effect.scenes and a.changed.any())


def _coefficient(name: str, value: ArrayLike, size: int) -> np.ndarray:
    array = checked_batch(f"the coefficient of {name}", value, size)
    lowest, highest = EFFECTS[name].lowest, EFFECTS[name].highest
    if (array < lowest).any() or (array > highest).any():
        raise ValueError(
            f"the coefficient of {name} must be {lowest:g} to {highest:g}, got {value!r}"
        )
    return array


def with_adhesion(
    liquid: Liquid, effects: Mapping[str, ArrayLike] | None, size: int
) -> Mapping[str, ArrayLike] | None:
    """Effects with the adhesion that the liquid itself names; 0 there names none.

    Raises:
        ValueError: both name one, and they differ.
    """
    own = np.asarray(liquid.adhesion, dtype=np.float64)
    if not own.any() or not (effects is None or isinstance(effects, Mapping)):
        return effects
    other = (effects or {}).get("adhesion", own)
    if not np.array_equal(_coefficient("adhesion", other, size), np.broadcast_to(own, (size,))):
        raise ValueError(
            f"the liquid's adhesion is {liquid.adhesion}, but effects say {other}; give one of both"
        )
    return {**(effects or {}), "adhesion": own}


def liquid_sets(
    acting: tuple[Acting, ...], size: int
) -> Iterator[tuple[tuple[Effect, ...], np.ndarray, np.ndarray]]:
    """Simulations by the effects that act in their liquid.

    A simulation runs in a scene compiled for exactly its own ones. So neither its company nor a
    neutral coefficient can change its bits, whatever the compiler makes of the hooks.

    Yields:
        The effects, which of `size` simulations [n], and coefficients [effects, size].
    """
    inside = [a for a in acting if a.effect.make_rheology]
    changed = np.array([a.changed for a in inside], dtype=bool).reshape(len(inside), size)
    coefficients = np.array([a.coefficient for a in inside]).reshape(len(inside), size)
    for which in np.unique(changed, axis=1).T:
        rows = np.flatnonzero((changed == which[:, None]).all(axis=0))
        effects = tuple(a.effect for a, acts in zip(inside, which, strict=True) if acts)
        yield effects, rows, coefficients[which]


def changed_wetting(cosine: np.ndarray, acting: tuple[Acting, ...]) -> np.ndarray:
    """Cosines of contact angles [B] after every effect that acts on them, within -1 and 1."""
    for act in acting:
        if act.effect.wetting is not None:
            found = act.effect.wetting(cosine[act.changed], act.coefficient[act.changed])
            cosine = _put(act.effect, "wetting", cosine, act.changed, found)
    return np.clip(cosine, -1.0, 1.0)


def changed_rig(rig: Rig, acting: tuple[Acting, ...]) -> Rig:
    """The rig after every effect that acts in it.

    Raises:
        ValueError: a hook returned no rig of the same shapes.
    """
    for act in acting:
        effect, rows = act.effect, act.changed
        if effect.rig is None:
            continue
        before = rig.rows(rows)
        for field in before:
            field.flags.writeable = False  # what a hook wrote in place would be overlooked below
        after = effect.rig(before, act.coefficient[rows])
        if not isinstance(after, Rig):
            raise ValueError(f"effect {effect.name!r}: its hook rig must return a Rig")
        # most effects touch one field, and the paths are large
        touched = {
            name: _put(effect, name, getattr(rig, name), rows, getattr(after, name))
            for name in Rig._fields
            if getattr(after, name) is not getattr(before, name)
        }
        rig = rig._replace(**touched)
    return rig


def changed_signal(time: np.ndarray, angles: np.ndarray, acting: tuple[Acting, ...]) -> np.ndarray:
    """Angles as the cameras see them, after every effect in the sensor.

    Args:
        time: Sample times [s], shape [T].
        angles: Inclination in the xz and yz planes [rad], shape [B, T, 2]; NaN if it diverged.
        acting: Effects, in order.

    Returns:
        Angles of the same shape.

    Raises:
        ValueError: a hook returned another shape.
    """
    finite = np.isfinite(angles).all(axis=(1, 2))
    for act in acting:
        effect, rows = act.effect, act.changed & finite
        if effect.signal is None or not rows.any():
            continue
        seen = effect.signal(np.asarray(time), angles[rows], act.coefficient[rows])
        angles = _put(effect, "signal", angles, rows, seen)
    return angles


def _put(
    effect: Effect, name: str, whole: np.ndarray, rows: np.ndarray, part: ArrayLike
) -> np.ndarray:
    """A copy of `whole` with `part` in its `rows`."""
    part = np.asarray(part)
    if part.shape != whole[rows].shape:
        raise ValueError(
            f"effect {effect.name!r}: its hook returned {name} of shape {part.shape}, "
            f"expected {whole[rows].shape}"
        )
    copied = whole.copy()
    copied[rows] = part
    return copied
