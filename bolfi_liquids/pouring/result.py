"""A chosen pour: the action, what it spills, and where it lies among the actions."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from ..calibration.summary import FitStatus
from ..inputs.settings import PourSettings
from ..run.results import Number, Section
from ..run.run import Run, RunOrPath
from ..wording import html_table, spilled
from .draining import Hold
from .spillage import ACTION, FRACTIONS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import DataTree

SPILLAGE_QUANTILE = 0.95
"""Of the spilled fraction: one outcome in twenty exceeds it."""

INTERVAL = 0.05, 0.95
"""Quantiles of the fractions that arrive and stay."""

CONTRADICTION = 0.05
"""Difference between the fractions that a given pour has spilled and that the map expects of it,
from which on a person is warned."""


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


@dataclass(frozen=True, eq=False, repr=False)
class Pour:
    """The chosen pour, and beside it the plug-in: the best one if theta* were the truth.

    Attributes:
        run: Whose pour it is.
        chosen: Found over the posterior draws.
        plug_in: Found at theta* alone, judged over the same draws as `chosen`.
        tree: pour.nc; its groups are listed in `pouring.pour_file`.
        summary: The section "pour" of summary.json.
    """

    run: Run
    chosen: Judged
    plug_in: Judged
    tree: "DataTree"
    summary: "PourSummary"

    def __repr__(self) -> str:
        return f"Pour({str(self.path)!r}: {self.chosen})"

    def _repr_html_(self) -> str:
        rows = {"run": self.path, "chosen": self.chosen, "best at θ* alone": self.plug_in}
        return html_table("Pour", rows)

    @classmethod
    def open(cls, run: RunOrPath) -> "Pour":
        """Read the pour that a run has chosen.

        Raises:
            InputError: There is none, or it was chosen over another posterior.
        """
        opened = Run.open(run)
        return cls.made(opened, opened.required("pour"))

    @classmethod
    def of(cls, run: Run) -> "Pour | None":
        """The pour of a run; None without a current one."""
        tree = run.result("pour")
        return None if tree is None else cls.made(run, tree)

    @classmethod
    def made(cls, run: Run, tree: "DataTree") -> "Pour":
        """The pour of a run from its pour.nc."""
        summary = PourSummary.from_json(json.loads(tree.attrs["summary"]))
        return cls(run, judged(tree, "chosen"), judged(tree, "plug_in"), tree, summary)

    @property
    def path(self) -> Path:
        """The RUN directory."""
        return self.run.path

    def plot_map(self, ax: "Axes | None" = None) -> "Axes":
        """Expected spillage over angular velocity and distance, with both actions.

        Args:
            ax: Where to draw; None makes a figure.

        Returns:
            The axes.
        """
        from ..drawing import shown
        from .figures import map_plot

        return shown(partial(map_plot, self.tree), ax)[0, 0]

    def check_current(self, run: Run) -> None:
        """Raise `ValueError` if another pour was chosen in its run since."""
        there = run.required("pour")
        pairs = ((self.chosen, "chosen"), (self.plug_in, "plug_in"))
        if not all(one.equals(judged(there, name)) for one, name in pairs):
            raise ValueError(
                f"another pour was chosen in {self.path} since; open it by Pour.open, or choose "
                "this one again"
            )


@dataclass(frozen=True)
class ActionSummary:
    """An action and what becomes of the liquid.

    Attributes:
        angular_velocity_deg_s: Of the source about its lip [deg/s].
        distance_cm: Horizontally from the lip to the receiver's axis [cm].
        expected_spillage: Mean spilled fraction.
        spillage_q95: Fraction that one outcome in twenty exceeds.
        expected_received, received_q05, received_q95: Mean and quantiles of the fraction that
            arrives in the receiver.
        expected_retained, retained_q05, retained_q95: Likewise, of what stays in the source.
    """

    angular_velocity_deg_s: Number
    distance_cm: Number
    expected_spillage: Number
    spillage_q95: Number
    expected_received: Number
    received_q05: Number
    received_q95: Number
    expected_retained: Number
    retained_q05: Number
    retained_q95: Number

    @classmethod
    def of(cls, judged: Judged, **more) -> Self:
        """From what was judged; `more` are the fields of a subclass."""
        return cls(
            angular_velocity_deg_s=float(np.degrees(judged.angular_velocity)),
            distance_cm=100.0 * judged.distance,
            expected_spillage=judged.expected_spillage,
            spillage_q95=judged.spillage_q95,
            **_spread("received", judged.fractions[:, 1]),
            **_spread("retained", judged.fractions[:, 2]),
            **more,
        )

    @property
    def action(self) -> tuple[float, float]:
        """Angular velocity [deg/s] and distance [cm]."""
        return self.angular_velocity_deg_s, self.distance_cm


def _spread(name: str, fractions: NDArray) -> dict[str, float]:
    """Mean and `INTERVAL` of fractions, by the names of `ActionSummary`."""
    low, high = np.quantile(fractions, INTERVAL)
    mean = float(fractions.mean())
    return {f"expected_{name}": mean, f"{name}_q05": float(low), f"{name}_q95": float(high)}


@dataclass(frozen=True)
class GivenPour:
    """A pour that was made, and what the map alone expects of it.

    Attributes:
        line: Of the table's file.
        angular_velocity_deg_s: Of the source about its lip [deg/s].
        distance_cm: Horizontally from the lip to the receiver's axis [cm].
        spilled, retained: Fractions.
        expected_spillage, expected_retained: Their means on the map.
    """

    line: int
    angular_velocity_deg_s: Number
    distance_cm: Number
    spilled: Number
    retained: Number
    expected_spillage: Number
    expected_retained: Number

    @property
    def contradiction(self) -> float:
        """How much more or less was spilled than the map expects."""
        return abs(self.spilled - self.expected_spillage)


@dataclass(frozen=True)
class GivenSummary:
    """The pours that were given, and what they have changed.

    Attributes:
        file, sha256: Name and digest of the table's file.
        liquid: Whose pours count, by its name in the table; "" where it names none.
        lines: Of the file, whose pours count.
        nearest: Those most like the chosen action, the likest first.
        contradicting: The pour that the map misses by most, if it is by `CONTRADICTION` at least.
        without: The action that would be chosen without the given pours, judged with them.
    """

    file: str
    sha256: str
    liquid: str
    lines: tuple[int, ...]
    nearest: tuple[GivenPour, ...]
    contradicting: GivenPour | None
    without: ActionSummary


@dataclass(frozen=True, kw_only=True)
class PourSummary(ActionSummary, Section):
    """The section "pour" of summary.json: the chosen action, beside the plug-in.

    Attributes:
        least_viscosity: Below it the simulator cannot distinguish liquids in this pour [Pa s].
        n_simulations: Pours that the map of landings was learned from.
        map_error: RMS by which that map misses the spilled fraction of pours left out of it.
        risk: "mean" or "cvar".
        seed: Of all random draws.
        plug_in: The action that would be best if theta* were the truth.
        fit_status: Of the calibration whose posterior it was chosen over; a bad fit's was chosen by
            force.
        given: Pours that were given, which correct the map; None without any.
        hold: How the source empties when it is held for longer; None unless more than a tenth of
            the liquid stays.
    """

    least_viscosity: Number
    n_simulations: int
    risk: str
    seed: int
    plug_in: ActionSummary
    fit_status: FitStatus
    map_error: Number
    given: GivenSummary | None = None
    hold: Hold | None = None

    @classmethod
    def from_judged(
        cls, chosen: Judged, plug_in: Judged, settings: PourSettings, **more: Any
    ) -> Self:
        """From two actions, the settings of the choice, and the fields that neither has."""
        return cls.of(
            chosen,
            risk=settings.risk,
            seed=settings.seed,
            plug_in=ActionSummary.of(plug_in),
            **more,
        )


def judged(tree: "DataTree", name: str) -> Judged:
    """The action in one of the groups `chosen` and `plug_in`."""
    outcomes = tree[name].to_dataset()
    columns = [outcomes[fraction].to_numpy() for fraction in FRACTIONS]
    action: Mapping = {at: float(outcomes.attrs[at]) for at in ACTION}
    return Judged(**action, fractions=np.column_stack(columns))
