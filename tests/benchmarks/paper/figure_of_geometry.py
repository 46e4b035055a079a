"""Where calibration matters: excess spillage of the best single pour for all liquids."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from bolfi_liquids.models import Cups
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from xarray import Dataset

from bolfi_liquids import models
from bolfi_liquids.drawing import INK, new_figure, styled
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.pouring.spillage import DISTANCE_STEP, landing_sd
from bolfi_liquids.progress import progress_bar
from bolfi_liquids.run.simulations import simulate_kept
from bolfi_liquids.seeds import simulation_seeds
from bolfi_liquids.simulators import FluidSimulator

from .figure import Drawn
from .phases import Phase
from .shared_simulations import SharedSimulations
from .truths import DENSITY

VISCOSITIES = np.geomspace(5e-3, 15.0, 9)  # Pa s, those of the liquids that come
TURN_RATES = 7
RECEIVER_RADII = np.array([0.020, 0.025, 0.030, 0.035, 0.045])  # m, of the receiver
COHESION = 0.5
DISTANCES = np.arange(-0.02, 0.0901, DISTANCE_STEP)  # m


@dataclass(frozen=True)
class Poured(FluidSimulator):
    """Pours of all liquids into receivers of all radii at all distances.

    Attributes:
        cups: With the lip's height.
    """

    cups: Cups

    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """Spilled fractions (rates, radii, liquids, DISTANCES)."""
        liquid = models.Liquid(VISCOSITIES, COHESION, DENSITY)
        own = np.array(simulation_seeds(0, Phase.GEOMETRY, len(VISCOSITIES)), np.int64)
        made = []
        for rate in theta["angular_velocity"]:
            landings = models.landings(liquid, rate, self.cups, own)
            caught = landings.into(DISTANCES[:, None, None], RECEIVER_RADII[:, None])
            made.append(np.moveaxis(caught.spilled, 0, -1))
        return np.stack(made)

    @property
    def identity(self) -> str:
        """A text that two equal experiments share."""
        liquids, receivers = [VISCOSITIES.tolist(), COHESION, DENSITY], [RECEIVER_RADII, DISTANCES]
        made_by = [Phase.GEOMETRY.value, liquids, *(values.tolist() for values in receivers)]
        return json.dumps([*made_by, self.cups.settings()], sort_keys=True)


def geometry(shared: SharedSimulations) -> Drawn:
    """The regret of the best single action, over heights of the lip and radii of the receiver."""
    lips = np.array(shared.scale.lips)
    regret = _regrets(shared, lips)
    with styled():
        figure = new_figure(5.6, 3.9)
        axes = figure.subplots()
        shown = axes.imshow(100.0 * regret, cmap="Blues", aspect="auto", vmin=0.0, origin="lower")
        figure.colorbar(shown, ax=axes, label="regret of the best single pour [% spilled]")
        for (row, column), value in np.ndenumerate(regret):
            dark = value > 0.6 * regret.max()
            axes.text(column, row, f"{100 * value:.1f}", ha="center", va="center",
                      color="white" if dark else INK)  # fmt: skip
        axes.set_xticks(
            range(len(RECEIVER_RADII)), [f"{100 * radius:.1f}" for radius in RECEIVER_RADII]
        )
        axes.set_yticks(range(len(lips)), [f"{100 * lip:.0f}" for lip in lips])
        axes.set(xlabel="receiver's radius [cm]", ylabel="lip above the receiver's floor [cm]")
    most = np.unravel_index(np.argmax(regret), regret.shape)
    radius = 100 * RECEIVER_RADII[most[1]]
    says = (
        f"one pour for all liquids spills up to {100 * regret.max():.1f} % more than knowing the "
        f"liquid (lip {100 * lips[most[0]]:.0f} cm, receiver {radius:.1f} cm), "
        f"at least {100 * regret.min():.1f} %"
    )
    coords = {"lip_height": lips, "radius": RECEIVER_RADII}
    return Drawn(Dataset({"regret": (("lip_height", "radius"), regret)}, coords), figure, says)


def _regrets(shared: SharedSimulations, lips: NDArray) -> NDArray[np.float64]:
    """By height of the lip and radius of the receiver."""
    rows, total = [], len(lips) * TURN_RATES
    with progress_bar("pouring from several heights", total, shown=True) as advance:
        for lip in lips:
            cups = bundled_cups()
            cups = cups.model_copy(
                update={"pour": cups.pour.model_copy(update={"lip_height": float(lip)})}
            )
            poured = Poured(cups)
            rates = np.geomspace(*cups.angular_velocity_range, TURN_RATES)
            compute = replace(shared.compute, batch=1)
            theta = {"angular_velocity": rates}
            made = simulate_kept(poured, theta, [0] * TURN_RATES, compute, advance=advance)
            rows.append(_regret(made.signals, cups))
    return np.stack(rows)


def _regret(spilled: NDArray, cups: Cups) -> NDArray[np.float64]:
    """By radius, from fractions (rates, radii, liquids, distances)."""
    blurred = gaussian_filter1d(spilled, landing_sd(cups) / DISTANCE_STEP, axis=-1, mode="nearest")
    low, high = cups.distance_range
    inside = (DISTANCES >= low - DISTANCE_STEP / 2) & (DISTANCES <= high + DISTANCE_STEP / 2)
    by_action = np.moveaxis(blurred[..., inside], 1, 0)  # radii, rates, liquids, distances
    single = by_action.mean(axis=2).min(axis=(1, 2))
    return single - by_action.min(axis=(1, 3)).mean(axis=1)
