"""A chosen pour: pour.nc, and its section of summary.json.

The groups of pour.nc are `actions` and `actions_plug_in`, over a grid of actions, the spillage
expected for each draw of the posterior, or at theta*, and the risk that was minimised; `chosen` and
`plug_in`, over outcomes, fractions with draws that did not choose; `liquids`, the posterior draws
that the choice was made with; `pours`, those that the map was learned from, and how far it missed
each; `given`, pours that were given and correct the map, and what it expects of them alone.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from ..calibration.summary import FitStatus
from ..inference.notebook_display import html_table
from ..run.given_pours import UNITS
from ..run.results import Number, Section
from ..run.run import Run, RunOrPath
from .given import GivenPours
from .pours import Hold
from .spillage import ACTION, FRACTIONS, Judged, Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset, DataTree

    from .landing_map import LandingMap

INTERVAL = 0.05, 0.95
"""Quantiles of the fractions that arrive and stay."""

CONTRADICTION = 0.05
"""Difference between the fractions that a given pour has spilled and that the map expects of it,
from which on a person is warned."""

SHOWN_GIVEN = 3
"""Given pours that are shown beside the choice: those most like it."""


@dataclass(frozen=True, eq=False, repr=False)
class Pour:
    """The chosen pour, and beside it the plug-in: the best one if theta* were the truth.

    Attributes:
        run: Whose pour it is.
        chosen: Found over the posterior draws.
        plug_in: Found at theta* alone, judged over the same draws as `chosen`.
        tree: pour.nc.
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
        return html_table("Pour", rows.items())

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
        chosen, plug_in = (_judged(tree[name].to_dataset()) for name in ("chosen", "plug_in"))
        return cls(run, chosen, plug_in, tree, summary)

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

    def check_current(self, now: "Pour") -> None:
        """Raise `ValueError` if its run holds another pour now."""
        if not (self.chosen.equals(now.chosen) and self.plug_in.equals(now.plug_in)):
            raise ValueError(
                f"another pour was chosen in {self.path} since; open it by Pour.open, or choose "
                "this one again"
            )


def _judged(outcomes: "Dataset") -> Judged:
    """The action in one of the groups `chosen` and `plug_in`."""
    columns = [outcomes[fraction].to_numpy() for fraction in FRACTIONS]
    action = {name: float(outcomes.attrs[name]) for name in ACTION}
    return Judged(**action, fractions=np.column_stack(columns))


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
        for name, fraction in zip(FRACTIONS[1:], judged.fractions.T[1:], strict=True):
            low, high = map(float, np.quantile(fraction, INTERVAL))
            mean = float(fraction.mean())
            more |= {f"expected_{name}": mean, f"{name}_q05": low, f"{name}_q95": high}
        return cls(
            angular_velocity_deg_s=float(np.degrees(judged.angular_velocity)),
            distance_cm=100.0 * judged.distance,
            expected_spillage=judged.expected_spillage,
            spillage_q95=judged.spillage_q95,
            **more,
        )

    @property
    def action(self) -> tuple[float, float]:
        """Angular velocity [deg/s] and distance [cm]."""
        return self.angular_velocity_deg_s, self.distance_cm


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
        """Absolute difference of the spilled fraction from the map's expectation."""
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

    @classmethod
    def of(cls, given: GivenPours, chosen: Judged, without: Judged) -> Self:
        """From the given pours and the two actions."""
        table = given.table
        rows = zip(
            table.lines.tolist(),
            np.degrees(table.angular_velocity).tolist(),
            (100.0 * table.distance).tolist(),
            *table.observed.tolist(),
            *given.expected.T.tolist(),
            strict=True,
        )
        pours = [GivenPour(*row) for row in rows]
        worst = max(pours, key=lambda pour: pour.contradiction)
        return cls(
            file=table.path.name,
            sha256=table.hash,
            liquid=table.liquid,
            lines=tuple(pour.line for pour in pours),
            nearest=tuple(pours[k] for k in given.nearest(chosen)[:SHOWN_GIVEN]),
            contradicting=worst if worst.contradiction >= CONTRADICTION else None,
            without=ActionSummary.of(without),
        )


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


def pour_tree(
    judged: Mapping[str, Judged],
    tried: Mapping[str, Surface],
    liquids: Mapping[str, NDArray],
    learned: "LandingMap",
    risk: str,
) -> "DataTree":
    """Everything that a report shows of a pour.

    Args:
        judged: The two actions, by the name of the group.
        tried: What actions may be expected to spill, likewise.
        liquids: The posterior draws of the choice, name -> (draws,).
        learned: The map that it was made with.
        risk: Which measure of `spillage.RISK` was minimised.
    """
    from xarray import Dataset, DataTree

    missed = np.sqrt(np.mean(learned.error**2, axis=1))
    pours = {**learned.poured.theta, "missed": missed}
    groups = {
        **{name: _actions(surface, risk) for name, surface in tried.items()},
        **{name: _outcomes(one) for name, one in judged.items()},
        "liquids": Dataset({name: ("draw", values) for name, values in liquids.items()}),
        "pours": Dataset({name: ("pour", values) for name, values in pours.items()}),
    }
    if learned.given is not None:
        groups["given"] = _given(learned.given)
    return DataTree.from_dict({f"/{name}": dataset for name, dataset in groups.items()})


def _given(given: GivenPours) -> "Dataset":
    from xarray import Dataset

    table = given.table
    names = (*ACTION, *FRACTIONS, "expected_spilled", "expected_retained")
    values = (table.angular_velocity, table.distance, *table.fractions.T, *given.expected.T)
    columns = {
        name: ("line", of, {"units": UNITS.get(name, "1")})
        for name, of in zip(names, values, strict=True)
    }
    attributes = {"file": table.path.name, "liquid": table.liquid, "sha256": table.hash}
    return Dataset(columns, {"line": table.lines}, attributes)


def _actions(surface: Surface, risk: str) -> "Dataset":
    from xarray import Dataset

    columns = {
        "spilled": (("draw", *ACTION), surface.spilled.astype(np.float32)),
        "risk": (ACTION, surface.risk(risk)),
    }
    axes = {name: (name, getattr(surface, name), {"units": UNITS[name]}) for name in ACTION}
    return Dataset(columns, axes)


def _outcomes(judged: Judged) -> "Dataset":
    from xarray import Dataset

    columns = zip(FRACTIONS, judged.fractions.T, strict=True)
    return Dataset({name: ("outcome", values) for name, values in columns}, attrs=judged.action)
