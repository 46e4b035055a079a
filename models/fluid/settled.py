"""Packings that have come to rest, kept so that no process lets the same one settle twice."""

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from typing import NamedTuple

import numpy as np

KEPT = 1000  # packings; of 1000 particles they take 16 MB


class Packing(NamedTuple):
    """Particles at rest in a cup, of any number n.

    Attributes:
        position: Where they are [m], float32 of shape [n, 3].
        multiplier: The pressures that hold them, as `Pressure.multiplier`, shape [n].
    """

    position: np.ndarray
    multiplier: np.ndarray


class SettledPackings:
    """The packings last asked for, by what fixes them."""

    def __init__(self, kept: int = KEPT):
        self._kept, self._packings = kept, OrderedDict[Hashable, Packing]()

    def of(
        self, keys: Sequence[Hashable], settle: Callable[[list[int]], list[Packing]]
    ) -> list[Packing]:
        """Packings of `keys`, at most one a slot of the scene.

        Args:
            keys: What fixes each: geometry, number of particles and seed.
            settle: Lets those of the given places among `keys` come to rest.
        """
        missing = [at for at, key in enumerate(keys) if key not in self._packings]
        new = dict(zip(missing, settle(missing) if missing else [], strict=True))
        packings = [new[at] if at in new else self._packings[k] for at, k in enumerate(keys)]
        for key, packing in zip(keys, packings, strict=True):
            self._packings[key] = packing
            self._packings.move_to_end(key)
        while len(self._packings) > self._kept:
            self._packings.popitem(last=False)
        return packings
