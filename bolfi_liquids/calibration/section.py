"""The section "calibrate" of summary.json."""

from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from .check import Check
from .noise import irreducible_rms, rms
from .stir_simulator import Stirring

if TYPE_CHECKING:
    from xarray import DataArray, DataTree

    from ..inference import Fit

QUANTILES = {"q05": 0.05, "q50": 0.5, "q95": 0.95}


def calibration_section(
    tree: "DataTree", fit: "Fit", stirring: Stirring, check: Check
) -> dict[str, Any]:
    """Numbers of a calibration, in the design's form.

    `fit_rms_deg` is the RMS between the recording and the closest simulated hypothesis;
    `noise_deg` what the right model would leave (see `noise.irreducible_rms`).
    `n_simulations` counts those that the engine learned from, `n_check_simulations` those that
    judged the result. Below `least_viscosity` [Pa s] liquids look alike to the simulator;
    `below_least_viscosity` is the share of the posterior there.
    """
    posterior = tree["posterior"]
    closest = fit.closest
    attrs = posterior.attrs
    return {
        "parameters": {
            name: parameter_summary(draws) for name, draws in posterior.data_vars.items()
        },
        "least_viscosity": stirring.least_viscosity,
        "below_least_viscosity": float(
            (posterior["viscosity"].to_numpy() < stirring.least_viscosity).mean()
        ),
        "best": fit.best,
        "closest": closest.theta,
        "n_simulations": int(fit.simulations.sizes["simulation"]),
        "n_check_simulations": len(check.predictive) + len(check.replicates),
        "fit_rms_deg": float(np.degrees(rms(stirring.observed - closest.signal))),
        "noise_deg": float(
            np.degrees(
                irreducible_rms([r.inclination for r in stirring.recordings], check.replicates)
            )
        ),
        "rhat_max": float(attrs["rhat_max"]),
        "ess_min": float(min(attrs["ess_bulk_min"], attrs["ess_tail_min"])),
        "n_draws": int(posterior.sizes["chain"] * posterior.sizes["draw"]),
        "divergences": int(attrs["divergences"]),
        "emulator_warnings": fit.warnings,
        "seconds": {
            "simulator": float(tree.attrs["seconds_simulator"]),
            "engine": float(tree.attrs["seconds_engine"]),
            "sampling": float(tree.attrs["seconds_sampling"]),
        },
        "seed": int(tree.attrs["seed"]),
        "version": version("bolfi-liquids"),
    }


def parameter_summary(draws: "DataArray") -> dict[str, float]:
    """Mean, standard deviation and quantiles of all draws of a parameter."""
    values = draws.to_numpy()
    quantiles = {name: float(np.quantile(values, q)) for name, q in QUANTILES.items()}
    return {"mean": float(values.mean()), "sd": float(values.std(ddof=1)), **quantiles}
