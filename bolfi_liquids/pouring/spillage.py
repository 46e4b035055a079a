"""What pours spill, over liquids that might be in the cup and receivers at any distance.

Where the receiver stands changes nothing in the fluid, so each pour is simulated once for all
distances: `Profiles` hold what came out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..wording import spilled

if TYPE_CHECKING:
    from ..models import Cups

FRACTIONS = ("spilled", "received", "retained")
ACTION = ("angular_velocity", "distance")
CVAR_TAIL = 0.1  # share of the draws that CVaR averages
LANDING_SD = 0.03  # sd of where liquid lands about where it was simulated, over its fall to the rim
DISTANCE_STEP = 1e-3  # m, between the distances of a profile
MAX_LANDING_SDS = 5.0  # sd by which liquid may land elsewhere
SPILLAGE_QUANTILE = 0.95  # of the spilled fraction: one outcome in twenty exceeds it


def mean_spillage(spilled: NDArray) -> NDArray[np.float64]:
    """Mean over the draws, along the first axis."""
    return spilled.mean(axis=0)


def tail_spillage(spilled: NDArray) -> NDArray[np.float64]:
    """Mean over the worst tenth of the draws (CVaR at 0.9), along the first axis."""
    worst = int(np.ceil(CVAR_TAIL * len(spilled)))
    return np.sort(spilled, axis=0)[-worst:].mean(axis=0)


RISK: dict[str, Callable[[NDArray], NDArray]] = {"mean": mean_spillage, "cvar": tail_spillage}
"""What is minimised, by the name users give."""


def landing_sd(cups: "Cups") -> float:
    """Sd of the distance between simulated and true landing [m].

    The simulator, as every one, misses the speed and direction at which liquid leaves the lip,
    and the error grows with the fall. Against 11 pours of a volume-of-fluid solver it is 0.023 of
    the fall, RMS over liquids and angular velocities, and finer cells would move that solver's own
    landings by about 0.02.
    """
    return LANDING_SD * (cups.pour.lip_height - cups.receiver.height)


def normal_scores(count: int) -> NDArray[np.float64]:
    """Equally probable standard normal values, shape (count,)."""
    from scipy.special import ndtri

    return ndtri((np.arange(count) + 0.5) / count)


class Profiles(NamedTuple):
    """Fractions spilled, received and retained, at some angular velocities and any distance.

    Attributes:
        angular_velocity: [rad/s], shape (W,), ascending.
        distance: [m], shape (D,), `DISTANCE_STEP` apart and beyond the range of the decision.
        fractions: Shape (W, draws, D, 3); the last axis sums to 1.
    """

    angular_velocity: NDArray[np.float64]
    distance: NDArray[np.float64]
    fractions: NDArray[np.float64]


class Surface(NamedTuple):
    """Expected spillage of actions.

    Attributes:
        angular_velocity: [rad/s], shape (W,).
        distance: [m], shape (D,), within the range of the decision.
        spilled: Of each draw, averaged over where the liquid may land, shape (draws, W, D).
    """

    angular_velocity: NDArray[np.float64]
    distance: NDArray[np.float64]
    spilled: NDArray[np.float64]

    def risk(self, risk: str) -> NDArray[np.float64]:
        """A measure of `RISK` at every action, shape (W, D)."""
        return RISK[risk](self.spilled)

    def least(self, risk: str) -> dict[str, float]:
        """The action at which `risk` is least."""
        measured = self.risk(risk)
        row, column = np.unravel_index(np.argmin(measured), measured.shape)
        chosen = self.angular_velocity[row], self.distance[column]
        return dict(zip(ACTION, map(float, chosen), strict=True))


@dataclass(frozen=True, eq=False)
class Judged:
    """An action and what it spills, on draws that did not choose it.

    Attributes:
        angular_velocity: Of the source about its lip [rad/s].
        distance: Horizontally from the lip to the receiver's axis [m].
        fractions: Spilled, received and retained, shape (outcomes, 3); rows sum to 1. Each draw
            has several outcomes, as the liquid may land elsewhere than simulated.
    """

    angular_velocity: float
    distance: float
    fractions: NDArray[np.float64]

    @property
    def action(self) -> dict[str, float]:
        """`angular_velocity` and `distance`."""
        return dict(zip(ACTION, (self.angular_velocity, self.distance), strict=True))

    @property
    def expected_spillage(self) -> float:
        """Mean spilled fraction."""
        return float(self.fractions[:, 0].mean())

    @property
    def spillage_q95(self) -> float:
        """Spilled fraction that one outcome in twenty exceeds."""
        return float(np.quantile(self.fractions[:, 0], SPILLAGE_QUANTILE))

    def equals(self, other: "Judged") -> bool:
        """Whether another one has the same action and the same outcomes."""
        same = self.action == other.action
        return same and np.array_equal(self.fractions, other.fractions)

    def __str__(self) -> str:
        return (
            f"{np.degrees(self.angular_velocity):.1f} deg/s, {100 * self.distance:.2f} cm, "
            f"expected to spill {spilled(self.expected_spillage)}"
        )


def reachable_distances(cups: "Cups") -> NDArray[np.float64]:
    """Those of the decision [m], and so far beyond as liquid may land elsewhere."""
    low, high = cups.distance_range
    beyond = int(np.ceil(MAX_LANDING_SDS * landing_sd(cups) / DISTANCE_STEP))
    steps = np.arange(-beyond, round((high - low) / DISTANCE_STEP) + beyond + 1)
    return np.asarray(low + DISTANCE_STEP * steps, np.float64)


def surface(profiles: Profiles, cups: "Cups") -> Surface:
    """Spillage of the actions of the decision's range, wherever the liquid lands."""
    from scipy.ndimage import gaussian_filter1d

    blurred = gaussian_filter1d(
        np.moveaxis(profiles.fractions[..., 0], 1, 0),
        landing_sd(cups) / DISTANCE_STEP,
        axis=-1,
        mode="nearest",
        truncate=MAX_LANDING_SDS,
    )
    low, high = cups.distance_range
    allowed = np.abs(profiles.distance - (low + high) / 2) < (high - low + DISTANCE_STEP) / 2
    distance = np.clip(profiles.distance[allowed], low, high)
    return Surface(profiles.angular_velocity, distance, blurred[..., allowed])


def landed(fractions: NDArray, distances: NDArray, distance: float, off: NDArray) -> NDArray:
    """Fractions (draws * len(off), 3) where the liquid lands `off` [m] from where simulated.

    Args:
        fractions: Of one angular velocity, shape (draws, D, 3).
        distances: Theirs [m], shape (D,).
        distance: Of the receiver [m].
        off: Positive where it lands beyond, shape (n,).
    """
    from scipy.interpolate import make_interp_spline

    at = make_interp_spline(distances, fractions, k=1, axis=1)(distance - off)
    return at.reshape(-1, len(FRACTIONS))
