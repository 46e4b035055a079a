"""What the pour chosen on a map of landings spills, beside the one found by direct search.

    .venv/bin/python tests/benchmarks/pour_map.py --bank pours.sqlite --liquids glycerin oil

The posterior of each liquid is made up: log-normal viscosity, cohesion uniform. The map learns from
its first N pours, of which each is predicted from the others: "left out" is the RMS error of the
spilled fraction over all distances. The direct search pours every one of 15 angular velocities
with 16 draws, and the best three with 16 more: 288 pours (choose_pour made 412, for the plug-in
and to judge). Both actions are judged on fresh draws; regret is what more they spill than the best
action that these pours know of. Finished pours are kept in the bank.
"""

import argparse
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from bolfi_liquids.inference import SimulationBank
from bolfi_liquids.inference.simulations import Compute
from machine import machine
from numpy.typing import NDArray
from paper.outcomes import Outcomes, pour_all
from scipy.ndimage import gaussian_filter1d

from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring.landing_map import learn_map
from bolfi_liquids.pouring.parcels import Parcels
from bolfi_liquids.pouring.pours import Poured, box_around, joint_prior, pours_in
from bolfi_liquids.pouring.spillage import Surface, surface
from bolfi_liquids.progress import silent
from bolfi_liquids.simulators import RATE, PourSimulator

DENSITY = 1000.0  # kg/m3
RATES, TRIED, FINALISTS = 15, 16, 3  # of the direct search
MAP_DRAWS = 128
JUDGED = 64  # fresh draws that judge
POURS = (40, 64, 80, 100)
LEAST_COHESION = 0.2
HEAD = "liquid    pours, by     deg/s    cm  left out   stated  spilled  regret"


class Liquid(NamedTuple):
    """Median viscosity [Pa s] of a posterior, and sd of its log."""

    viscosity: float
    sd: float


LIQUIDS = {
    "water": Liquid(1e-3, 0.5),
    "cream": Liquid(0.015, 0.3),
    "oil": Liquid(0.1, 0.2),
    "syrup": Liquid(0.35, 0.2),
    "glycerin": Liquid(1.0, 0.2),
    "gel": Liquid(12.0, 0.2),
}


def draws(liquid: Liquid, count: int, seed: int) -> dict[str, NDArray]:
    """Of the made-up posterior, name -> (count,)."""
    rng = np.random.default_rng(seed)
    viscosity = liquid.viscosity * np.exp(liquid.sd * rng.standard_normal(count))
    return {"viscosity": viscosity, "cohesion": rng.uniform(LEAST_COHESION, 1.0, count)}


class Bench:
    """Pours of one posterior, kept in a bank."""

    def __init__(self, liquid: Liquid, bank: SimulationBank):
        self.liquid, self.compute, self.cups = liquid, Compute(bank=bank), bundled_cups()
        best = {"viscosity": liquid.viscosity, "cohesion": 0.5 * (LEAST_COHESION + 1.0)}
        prior = joint_prior(default_prior(), (), self.cups)
        self.box = box_around(prior, draws(liquid, 4000, 1), best)
        self.judged: dict[float, Surface] = {}

    def by_map(self, pours: int) -> tuple[dict[str, float], float, float]:
        """The action that a map of the first pours chooses, what it states that this spills, and
        the map's error."""
        made = pours_in(
            self.box, PourSimulator(self.cups, DENSITY, Parcels()), max(POURS), self.compute
        )
        first = [job.theta[RATE] for job in self.box.jobs(pours)]
        own = np.isin(made.theta[RATE], first)
        theta = {name: values[own] for name, values in made.theta.items()}
        learned = learn_map(self.box, self.cups, Poured(theta, made.rows[own]))
        tried = learned.surface(draws(self.liquid, MAP_DRAWS, 2))
        return tried.least("mean"), float(tried.risk("mean").min()), learned.rms_error

    def by_search(self) -> tuple[dict[str, float], float]:
        """The action that a direct search finds, and what it states that this spills."""
        rates = np.geomspace(*self.cups.angular_velocity_range, RATES)
        first = self._poured(rates, TRIED, 3)
        # neighbouring angular velocities spill alike: averages over them take chance out
        smooth = gaussian_filter1d(first.risk("mean"), 1.0, axis=0, mode="nearest")
        best = np.sort(np.argsort(smooth.min(axis=1), kind="stable")[:FINALISTS])
        again = self._poured(rates[best], TRIED, 4)
        both = np.concatenate([first.spilled[:, best], again.spilled])
        finalists = again._replace(spilled=both)
        return finalists.least("mean"), float(finalists.risk("mean").min())

    def judge(self, action: Mapping[str, float]) -> float:
        """Spilled fraction of an action on fresh draws."""
        tried = self._judged(action[RATE])
        at = int(np.argmin(np.abs(tried.distance - action["distance"])))
        return float(tried.risk("mean")[0, at])

    def least(self) -> float:
        """Of all actions at an angular velocity that was judged."""
        return min(float(tried.risk("mean").min()) for tried in self.judged.values())

    def _judged(self, rate: float) -> Surface:
        if rate not in self.judged:
            self.judged[rate] = self._poured(np.array([rate]), JUDGED, 5)
        return self.judged[rate]

    def _poured(self, rates: NDArray, count: int, seed: int) -> Surface:
        seeds = np.arange(count) + 1000 * seed
        liquids = Outcomes(draws(self.liquid, count, seed), DENSITY, self.cups, seeds)
        return surface(pour_all(liquids, rates, self.compute, silent), self.cups)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--bank", default=":memory:", metavar="FILE")
    parser.add_argument("--liquids", nargs="+", choices=LIQUIDS, default=list(LIQUIDS))
    given = parser.parse_args(arguments)
    print(f"{machine()}\n{HEAD}", flush=True)
    with SimulationBank(given.bank) as bank:
        for name in given.liquids:
            bench = Bench(LIQUIDS[name], bank)
            chosen = {f"map, {pours}": bench.by_map(pours) for pours in POURS}
            chosen["search, 288"] = (*bench.by_search(), np.nan)
            spilled = {label: bench.judge(action) for label, (action, *_) in chosen.items()}
            for label, (action, stated, error) in chosen.items():
                print(
                    f"{name:10}{label:12}{np.degrees(action[RATE]):8.1f}"
                    f"{100.0 * action['distance']:6.1f}{error:10.4f}{stated:9.4f}"
                    f"{spilled[label]:9.4f}{spilled[label] - bench.least():8.4f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
