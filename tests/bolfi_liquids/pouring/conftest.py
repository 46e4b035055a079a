"""Pours whose landings are known in closed form."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.special import ndtri

from bolfi_liquids import models

PARTICLES = 400
STREAM_SD = 0.008  # m, along the stream, of which nothing lands aside


class MadeUp(NamedTuple):
    """What stands in place of `models.landings`, and the liquids of each of its calls so far."""

    calls: list[int]

    def middle(self, viscosity, cohesion, rate, adhesion=0.0):
        """Of the stream [m]: fast and thin liquids land far, and sticking ones near."""
        slow = 0.004 * np.log(viscosity)
        return 0.04 - slow + 0.01 * np.log(rate) - 0.005 * cohesion - 0.02 * adhesion

    def film(self, viscosity):
        """Share that stays in the source."""
        return 0.3 * viscosity / (1.0 + viscosity)

    def draining(self, batch, held):
        viscosity = np.broadcast_to(np.asarray(batch.liquid.viscosity, float), len(batch.seeds))
        return self.film(viscosity)[:, None] * np.exp(-np.asarray(held))

    def landings(self, liquid, angular_velocity, cups, seeds, particles=0, effects=None):
        size = len(seeds)
        self.calls.append(size)
        viscosity, cohesion, rate = (
            np.broadcast_to(np.asarray(values, float), size)
            for values in (liquid.viscosity, liquid.cohesion, angular_velocity)
        )
        adhesion = np.broadcast_to((effects or {}).get("adhesion", 0.0), size)
        kept = np.round(self.film(viscosity) * PARTICLES) / PARTICLES
        position = np.full((size, PARTICLES, 2), np.nan, np.float32)
        for row, at in enumerate(self.middle(viscosity, cohesion, rate, adhesion)):
            count = round(PARTICLES * (1.0 - kept[row]))
            spread = STREAM_SD * ndtri((np.arange(count) + 0.5) / count)
            position[row, :count] = np.stack([at + spread, np.zeros(count)], axis=-1)
        return models.Landings(position, kept)


@pytest.fixture(scope="session")
def make_up():
    """Pours are made up as long as a monkeypatch lasts."""

    def patched(patch):
        made = MadeUp([])
        patch.setattr(models, "landings", made.landings)
        patch.setattr(models, "draining", made.draining)
        return made

    return patched


@pytest.fixture
def made_up(make_up, monkeypatch):
    """Pours are made up."""
    return make_up(monkeypatch)
