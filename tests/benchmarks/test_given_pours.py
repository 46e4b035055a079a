"""How much given pours improve the choice where the simulator errs by a known shift.

Pours are streams in closed form: where the middle lands is a smooth function of liquid and angular
velocity, and the truth lands elsewhere than its simulator by `SHIFT`. The map of landings and the
decision are the program's own.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from bolfi_liquids import models
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.pour_table import PourTable
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring.landing_map import LandingMap, learn_map
from bolfi_liquids.pouring.parcels import parcels_of
from bolfi_liquids.pouring.pours import Poured, joint_prior, whole
from bolfi_liquids.simulators import RATE

TRUTHS = 20
POURS = 64  # that the map is learned from
SHIFT = 0.012  # m, of the truth beyond or short of its simulator
STREAM_SD = 0.008  # m
RETAINED = 0.02  # share
RADIUS = 0.022  # m, of the receiver
JITTER_SD = (
    0.0004  # m, of where a given pour lands: .02 of the liquid where the rim cuts the stream
)
GRAMS = 83  # of the liquid, weighed by the gram
GIVEN = np.array([(w, d) for w in (35.0, 70.0, 140.0) for d in (0.5, 2.5, 4.5, 6.5)])  # deg/s, cm
PARTICLES = 400


def middle(viscosity, rate):
    """Where the middle of the simulator's stream lands [m]."""
    return 0.035 - 0.004 * np.log(viscosity) + 0.01 * np.log(rate)


class Truth(NamedTuple):
    """A liquid that lands `shift` [m] beyond what its simulator says."""

    viscosity: float
    shift: float

    def spilled(self, rate, distance):
        """Fraction at actions [rad/s], [m]."""
        off = distance - middle(self.viscosity, rate) - self.shift
        caught = ndtr((off + RADIUS) / STREAM_SD) - ndtr((off - RADIUS) / STREAM_SD)
        return (1.0 - RETAINED) * (1.0 - caught)

    def regret(self, action, cups):
        """What an action spills beyond the best one."""
        rates = np.geomspace(*cups.angular_velocity_range, 101)[:, None]
        best = self.spilled(rates, np.linspace(*cups.distance_range, 201)).min()
        return float(self.spilled(action["angular_velocity"], action["distance"]) - best)

    def table(self, rng):
        """The pours of `GIVEN`, as a person weighs them."""
        rate, distance = np.radians(GIVEN[:, 0]), GIVEN[:, 1] / 100.0
        spilled = self.spilled(rate, distance + JITTER_SD * rng.standard_normal(len(GIVEN)))
        retained = np.full(len(GIVEN), RETAINED)
        grams = np.round(GRAMS * np.column_stack([spilled, 1.0 - spilled - retained, retained]))
        fractions = grams / grams.sum(axis=1, keepdims=True)
        lines = np.arange(2, 2 + len(GIVEN))
        return PourTable(Path("given.csv"), "", rate, distance, fractions, lines, "0")


def simulator() -> LandingMap:
    """The map of all liquids, learned from pours without the shift."""
    bundled = bundled_cups()
    receiver = bundled.receiver.model_copy(update={"radius": RADIUS})
    cups = bundled.model_copy(update={"receiver": receiver})
    box = whole(joint_prior(default_prior(), (), cups))
    jobs = box.jobs(POURS)
    theta = {name: np.array([job.theta[name] for job in jobs]) for name in box.prior.names}
    count = round(PARTICLES * (1.0 - RETAINED))
    position = np.full((POURS, PARTICLES, 2), np.nan, np.float32)
    landed = middle(theta["viscosity"], theta[RATE])[:, None]
    position[:, :count, 0] = landed + STREAM_SD * ndtri((np.arange(count) + 0.5) / count)
    position[:, :count, 1] = 0.0
    rows = parcels_of(models.Landings(position, np.full(POURS, RETAINED)))
    return learn_map(box, cups, Poured(theta, rows))


@pytest.mark.benchmark
def test_twelve_given_pours_halve_the_regret():
    """Prints; run with `pytest -m benchmark -s tests/benchmarks/test_given_pours.py`."""
    learned, rng = simulator(), np.random.default_rng(0)
    regrets = []
    for k in range(TRUTHS):
        truth = Truth(float(np.exp(rng.uniform(*np.log([0.003, 3.0])))), SHIFT * (-1.0) ** k)
        draws = {
            "viscosity": truth.viscosity * np.exp(0.1 * rng.standard_normal(128)),
            "cohesion": rng.uniform(size=128),
        }
        corrected = learned.corrected(truth.table(rng), draws)
        actions = [one.surface(draws).least("mean") for one in (learned, corrected)]
        regrets.append([truth.regret(action, learned.cups) for action in actions])
        promised = corrected.judge(actions[1], draws)
        print(
            f"{truth.viscosity:8.3g} Pa s {1000.0 * truth.shift:+6.1f} mm   regret without "
            f"{regrets[-1][0]:.3f}, with {regrets[-1][1]:.3f}; spilled "
            f"{truth.spilled(*actions[1].values()):.3f}, promised {promised.expected_spillage:.3f}"
            f" (95 %: {promised.spillage_q95:.3f})",
            flush=True,
        )
    without, given = np.mean(regrets, axis=0)
    print(f"mean regret without {without:.4f}, with {given:.4f}: {given / without:.2f} of it")
    assert given <= 0.5 * without
