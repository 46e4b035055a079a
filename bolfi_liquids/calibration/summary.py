"""The section "calibrate" of summary.json."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from pydantic import computed_field

from ..errors import InputError
from ..inputs.frame import named_faults
from ..models import stirring_error
from ..run.results import Number, Section
from ..simulators import StirSimulator
from ..wording import degrees, with_unit
from .engine_fit import THETA_STAR_REPLICATES
from .stirs import irreducible_rms, rms

if TYPE_CHECKING:
    from xarray import DataArray, Dataset, DataTree

    from ..inference import Fit
    from ..inference.criticism import ModelError

QUANTILES = {"q05": 0.05, "q50": 0.5, "q95": 0.95}
RHAT_MAX, ESS_MIN = 1.01, 400.0  # Vehtari et al. 2021
DIVERGENT_SHARE_MAX = 0.01  # of the draws

BAD_FIT_RATIO = 3.0
"""Times the noise from which a fit is bad, the simulator's usual error taken off. In liquids above
0.3 Pa s wrong signs and turned axes leave 5 to 9 times, a stir that starts in motion 3 times. In
water the simulator errs by five times the noise, and no misfit below 0.58 degrees is seen."""

MIN_NOISE_DEG = 0.1
"""Noise [deg] below which no camera measures: simulated recordings without noise count as if they
had as much, or an unfinished search would pass for a wrong sign."""

HOW_TO_POUR = "correct it and calibrate again, or choose a pour nevertheless: --force (force=True)"
"""What to do about a bad fit."""

TURNING_EFFECT = "camera_rotation"
"""Effect that accounts for a turned frame, once a criticism has accepted it."""


class SamplerStatus(StrEnum):
    """Whether draws can be relied upon."""

    CONVERGED = "converged"
    NOT_CONVERGED = "not converged"

    @property
    def advice(self) -> str:
        """Cure."""
        return {
            SamplerStatus.CONVERGED: "the intervals of the posterior may be used",
            SamplerStatus.NOT_CONVERGED: "calibrate again with more draws",
        }[self]


class FitStatus(StrEnum):
    """Whether simulations at posterior draws come near enough to the recording."""

    ACCEPTABLE = "acceptable"
    BAD = "bad"


@dataclass(frozen=True)
class ParameterSummary:
    """Mean, standard deviation and quantiles of the draws of a parameter, in its unit."""

    mean: Number
    sd: Number
    q05: Number
    q50: Number
    q95: Number

    def interval(self, name: str) -> str:
        """Median and 90 % interval of the parameter of this name."""
        return f"{with_unit(name, self.q50)} (90 %: {self.q05:.3g} to {self.q95:.3g})"

    @classmethod
    def of(cls, draws: "DataArray") -> Self:
        """From all draws of the parameter."""
        values = draws.to_numpy()
        quantiles = {name: float(np.quantile(values, q)) for name, q in QUANTILES.items()}
        return cls(mean=float(values.mean()), sd=float(values.std(ddof=1)), **quantiles)


@dataclass(frozen=True)
class Seconds:
    """Time spent [s]."""

    simulator: Number
    engine: Number
    sampling: Number


@dataclass(frozen=True)
class CalibrationSummary(Section):
    """Numbers of a calibration.

    Attributes:
        parameters: By name.
        least_viscosity: Below it the simulator cannot distinguish liquids [Pa s].
        below_least_viscosity: Share of the posterior there.
        best: theta*, where the surrogate expects the best fit.
        closest: Parameters of the simulation at a posterior draw with the least discrepancy.
        n_simulations: Number of the search.
        n_check_simulations: Number that judged the result: those at posterior draws, which the
            engine learned from, too, and those at theta*.
        fit_rms_deg: RMS between the recording and that simulation [deg].
        noise_deg: RMS that the right model would leave [deg], see `noise.irreducible_rms`.
        rhat_max, ess_min: Worst R-hat and effective sample size of the parameters.
        n_draws: Number in all chains.
        divergences: Number of divergent transitions of NUTS.
        emulator_warnings: Warnings of the surrogate's checks.
        seconds: Time spent.
        seed: Of all random draws.
        version: Of this package.
        model_error_deg: RMS error of the simulator that the intervals allow for [deg]: learned, or
            the usual one at the viscosity that fitted best before the check; 0 with the paper's
            surrogate.
        clean: Names of the recordings from which it was learned.
        confirmed: Whether simulations at posterior draws left the posterior where it was.
        frame_faults: Recordings whose inclination and positions are not told in one frame, and how
            it is mended; see `inputs.frame`.
        until_error: What the setting `until` limits, of the search's last posterior, before it was
            checked; None without that setting.
    """

    parameters: Mapping[str, ParameterSummary]
    least_viscosity: Number
    below_least_viscosity: Number
    best: Mapping[str, Number]
    closest: Mapping[str, Number]
    n_simulations: int
    n_check_simulations: int
    fit_rms_deg: Number
    noise_deg: Number
    rhat_max: Number
    ess_min: Number
    n_draws: int
    divergences: int
    emulator_warnings: tuple[str, ...]
    seconds: Seconds
    seed: int
    version: str
    frame_faults: tuple[str, ...]
    model_error_deg: Number
    clean: tuple[str, ...]
    confirmed: bool
    until_error: float | None = None

    @classmethod
    def from_fit(
        cls,
        tree: "DataTree",
        fit: "Fit",
        stirring: StirSimulator,
        searched: int,
        error: "ModelError | None",
        clean: tuple[str, ...],
    ) -> Self:
        """From posterior.nc and the engine's fit.

        Args:
            tree: posterior.nc.
            fit: Of the engine.
            stirring: What was simulated.
            searched: Number of the search's simulations.
            error: Of the simulator, for which the fit allows; None where it allows for none.
            clean: Names of the recordings from which that was learned.
        """
        posterior, closest = tree["posterior"].to_dataset(), tree["closest"].to_dataset()
        replicates = tree["replicates"]["inclination"].to_numpy()
        seen = [one.inclination for one in stirring.recordings]
        misfit = stirring.observed - closest["inclination"].to_numpy()
        spent = {name: tree.attrs[f"seconds_{name}"] for name in Seconds.__dataclass_fields__}
        return cls(
            **_of_draws(posterior, stirring.least_viscosity),
            least_viscosity=float(stirring.least_viscosity),
            best=fit.best,
            closest={name: float(closest[name]) for name in fit.prior.names},
            n_simulations=searched,
            n_check_simulations=len(fit.history.theta) - searched + THETA_STAR_REPLICATES,
            fit_rms_deg=float(np.degrees(rms(misfit))),
            noise_deg=float(np.degrees(irreducible_rms(seen, replicates))),
            emulator_warnings=tuple(fit.warnings),
            seconds=Seconds(**{name: float(value) for name, value in spent.items()}),
            seed=int(tree.attrs["seed"]),
            version=version("bolfi-liquids"),
            frame_faults=named_faults(stirring.recordings),
            model_error_deg=float(
                np.degrees(0.0 if error is None else np.sqrt(error.autocovariance[0]))
            ),
            clean=clean,
            confirmed=bool(fit.confirmed),
        )

    def extended(self, posterior: "Dataset", **changed: Any) -> Self:
        """These numbers with those of another posterior, in which effects were added.

        Args:
            posterior: Variables of shape (chain, draw).
            changed: Fields that these draws do not decide.
        """
        fields = _of_draws(posterior, self.least_viscosity) | changed
        faults = () if TURNING_EFFECT in fields["parameters"] else self.frame_faults
        return replace(self, frame_faults=faults, **fields)

    @computed_field
    @property
    def simulator_error_deg(self) -> Number:
        """RMS error of the simulator: learned from clean recordings, or the usual one at the
        viscosity of the closest simulation."""
        if self.clean:
            return self.model_error_deg
        return float(np.degrees(stirring_error(self.closest["viscosity"])))

    @property
    def unexplained_deg(self) -> float:
        """`fit_rms_deg` less the simulator's own error, in quadrature."""
        return unexplained(self.fit_rms_deg, self.simulator_error_deg)

    @computed_field
    @property
    def fit_to_noise(self) -> Number:
        """`unexplained_deg` in units of the noise."""
        return self.unexplained_deg / max(self.noise_deg, MIN_NOISE_DEG)

    @computed_field
    @property
    def fit_status(self) -> FitStatus:
        """Bad from `BAD_FIT_RATIO` on, where the ratio is not known, and in a wrong frame.

        The parameters of a thin liquid take up a turned frame: the fit alone does not show it.
        """
        good = self.fit_to_noise < BAD_FIT_RATIO and not self.frame_faults
        return FitStatus.ACCEPTABLE if good else FitStatus.BAD

    @property
    def divergent_share(self) -> float:
        """Share of the draws that are divergent."""
        return self.divergences / self.n_draws

    @property
    def sampler_status(self) -> SamplerStatus:
        """Whether R-hat, effective sample size and divergences are within their limits."""
        mixed = self.rhat_max <= RHAT_MAX and self.ess_min >= ESS_MIN  # neither holds for NaN
        good = mixed and self.divergent_share <= DIVERGENT_SHARE_MAX
        return SamplerStatus.CONVERGED if good else SamplerStatus.NOT_CONVERGED


def bad_fit(summary: CalibrationSummary) -> str | None:
    """Likely fault of a fit; None where it is as close as can be asked for.

    Args:
        summary: Of the calibration that counts, with what a criticism accepted.
    """
    if summary.fit_status is FitStatus.ACCEPTABLE:
        return None
    if summary.frame_faults:
        return f"{'; '.join(summary.frame_faults)}. Do not rely on the posterior."
    misfit, error, noise = map(
        degrees, (summary.fit_rms_deg, summary.simulator_error_deg, summary.noise_deg)
    )
    return (
        f"The fit is bad: {misfit} RMS, of which the simulator's own error is about {error}; the "
        f"rest is {summary.fit_to_noise:.1f} times the noise of {noise}. A sign, the direction of "
        "the axes, the clock, a size or a density is likely wrong, too little was simulated, or "
        "the simulator lacks an effect. Do not rely on the posterior."
    )


def refuse_bad_fit(summary: CalibrationSummary, run: Path) -> None:
    """Raise `InputError` where the fit of a run is too bad to go on with."""
    if (found := bad_fit(summary)) is not None:
        raise InputError(found.rstrip("."), where=str(run), fix=HOW_TO_POUR)


def unexplained(misfit: float, error: float) -> float:
    """RMS difference less an independent error, in quadrature; 0 where the error is larger."""
    return float(np.sqrt(np.maximum(misfit**2 - error**2, 0.0)))


def _of_draws(posterior: "Dataset", least_viscosity: float) -> dict[str, Any]:
    """The fields of `CalibrationSummary` that draws of shape (chain, draw) decide."""
    attrs, draws = posterior.attrs, posterior.items()
    return {
        "parameters": {str(name): ParameterSummary.of(values) for name, values in draws},
        "below_least_viscosity": float((posterior["viscosity"] < least_viscosity).mean()),
        "rhat_max": float(attrs["rhat_max"]),
        "ess_min": float(min(attrs["ess_bulk_min"], attrs["ess_tail_min"])),
        "n_draws": int(posterior.sizes["chain"] * posterior.sizes["draw"]),
        "divergences": int(attrs["divergences"]),
    }
