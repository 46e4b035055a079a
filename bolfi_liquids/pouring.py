"""From a posterior to the pour that is expected to spill least."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .calibration import Calibration
from .cups import bundled_cups
from .progress import Advance, progress_bar, reported
from .run_directory import POUR, open_bank
from .settings import PourSettings
from .spillage import FRACTIONS, RISK, Outcomes
from .summary import write_section

if TYPE_CHECKING:
    from .inference import Fit, SimulationBank
    from .models import Cups

PLUG_IN_SEEDS = 4  # that each action of the plug-in is tried with; the paper tries one
JUDGE_DRAWS = 2  # times as many draws judge the two actions as chose them
_SEARCH, _JUDGE = 11, 12  # purposes of seeds


@dataclass(frozen=True, eq=False)
class Judged:
    """An action and what it spills, on draws and seeds that did not choose it.

    Attributes:
        angular_velocity: Of the source about its lip [rad/s].
        distance: Horizontally from the lip to the receiver's axis [m].
        fractions: Spilled, received and retained, shape (outcomes, 3); rows sum to 1.
    """

    angular_velocity: float
    distance: float
    fractions: NDArray[np.float64]

    @property
    def expected_spillage(self) -> float:
        """Mean spilled fraction."""
        return float(self.fractions[:, 0].mean())

    @property
    def spillage_q95(self) -> float:
        """Spilled fraction that one outcome in twenty exceeds."""
        return float(np.quantile(self.fractions[:, 0], 0.95))


@dataclass(frozen=True, eq=False)
class Pour:
    """The chosen pour, and beside it the plug-in: the best one if theta* were the truth.

    Attributes:
        path: The RUN directory.
        chosen: Found over the posterior draws.
        plug_in: Found at theta* alone, judged over the same draws as `chosen`.
    """

    path: Path
    chosen: Judged
    plug_in: Judged


def choose_pour(  # noqa: PLR0913  the one call that most users make
    calibration: Calibration,
    cups: "Cups | None" = None,
    *,
    iterations: int = 15,
    draws: int = 16,
    risk: str = "mean",
    seed: int = 0,
    progress: bool = True,
) -> Pour:
    """Choose angular velocity and distance so that little is spilled whatever the liquid is.

    The engine that calibrated searches the actions, with the expected spillage over a fixed
    set of posterior draws and simulator seeds in the place of the discrepancy. The action at
    which the surrogate expects least is taken and judged on draws and seeds it was not chosen
    by, so that the figure is not flattered by the choice. Finished simulations are kept in the run.

    Args:
        calibration: Whose posterior is poured.
        cups: Source, receiver and ranges of the action; None are the bundled ones.
        iterations: Actions tried, as many again for the plug-in.
        draws: Posterior draws that each action is tried on.
        risk: "mean", or "cvar": the mean over the worst tenth of the draws.
        seed: Of everything random.
        progress: Whether to show a bar on stderr.

    Raises:
        InputError: A setting cannot be used.
    """
    from .pour_results import pour_section, pour_tree
    from .results import write_tree

    settings = PourSettings(iterations=iterations, draws=draws, risk=risk, seed=seed)
    cups = bundled_cups() if cups is None else cups
    # distinct strata: none of the draws that judge has chosen
    drawn = calibration.draws((1 + JUDGE_DRAWS) * draws, seed)
    chosen_by = np.arange(len(next(iter(drawn.values())))) % (1 + JUDGE_DRAWS) == JUDGE_DRAWS // 2
    liquids = {name: values[chosen_by] for name, values in drawn.items()}
    others = {name: values[~chosen_by] for name, values in drawn.items()}
    best = {name: np.full(PLUG_IN_SEEDS, value) for name, value in calibration.best.items()}
    with (
        open_bank(calibration.path) as bank,
        progress_bar("trying actions", 2 * iterations + 2, shown=progress) as advance,
    ):
        search = _Search(cups, calibration.liquid_density, settings, bank, advance)
        over_posterior = search.minimise(liquids)
        at_best = search.minimise(best)
        chosen, plug_in = (search.judge(fit.best, others) for fit in (over_posterior, at_best))
    pour = Pour(calibration.path, chosen, plug_in)
    tree = pour_tree(pour, over_posterior, at_best, liquids)
    floor = cups.least_viscosity(calibration.liquid_density, chosen.angular_velocity)
    tree.attrs.update(asdict(settings), cups=json.dumps(cups.settings()), least_viscosity=floor)
    write_tree(tree, calibration.path / POUR)
    section = pour_section(pour, settings, (over_posterior, at_best), floor)
    write_section(calibration.path, "pour", section)
    return pour


@dataclass(frozen=True)
class _Search:
    """What the two searches, over the posterior and at theta*, share."""

    cups: "Cups"
    density: float
    settings: PourSettings
    bank: "SimulationBank"
    advance: Advance

    def outcomes(self, liquids: Mapping[str, NDArray], purpose: int) -> Outcomes:
        """The liquids with seeds of their own."""
        from .kept import fresh_seeds

        count = len(next(iter(liquids.values())))
        seeds = np.array(fresh_seeds(self.settings.seed, purpose, count), np.int64)
        return Outcomes(liquids, self.density, self.cups, seeds)

    def minimise(self, liquids: Mapping[str, NDArray]) -> "Fit":
        """Search the actions over these liquids."""
        import numpyro.distributions as dist

        from . import inference

        outcomes = self.outcomes(liquids, _SEARCH)
        measure = RISK[self.settings.risk]
        return inference.fit(
            reported(outcomes.simulate, self.advance),
            inference.Prior(
                {
                    "angular_velocity": dist.Uniform(*self.cups.angular_velocity_range),
                    "distance": dist.Uniform(*self.cups.distance_range),
                }
            ),
            np.zeros((len(outcomes.seeds), len(FRACTIONS))),
            budget=self.settings.iterations,
            batch=1,  # one action already is several simulations, which run in parallel
            seed=self.settings.seed,
            discrepancy=lambda _, fractions: measure(fractions),
            acquisition="lcb",  # a minimum is sought, not a posterior
            transform="sqrt",
            bank=self.bank,
            identity=outcomes.identity,
        )

    def judge(self, action: Mapping[str, float], liquids: Mapping[str, NDArray]) -> Judged:
        """Pour every liquid, with seeds of their own."""
        from .kept import Keep, simulate_kept

        outcomes = self.outcomes(liquids, _JUDGE)
        one = {name: np.array([value]) for name, value in action.items()}
        keep = Keep(self.bank, outcomes.identity, 1)
        poured = simulate_kept(reported(outcomes.simulate, self.advance), one, [0], keep)
        return Judged(action["angular_velocity"], action["distance"], poured.signals[0])
