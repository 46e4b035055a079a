"""run.toml: what a run was made with."""

import platform
from collections.abc import Iterable
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from ..calibration.stir_simulator import Stirring
from ..inputs.prior import describe_prior
from ..inputs.settings import CalibrationSettings

if TYPE_CHECKING:
    from ..inference import Prior

LIBRARIES = ("bolfi-liquids", "numpy", "scipy", "jax", "numpyro", "emcee", "taichi", "xarray")


def run_record(settings: CalibrationSettings, prior: "Prior", stirring: Stirring) -> dict[str, Any]:
    """Settings, inputs and versions; see `run_directory.MUST_AGREE` for what must not change."""
    from ..inference.engine_version import ENGINE_VERSION

    return {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "settings": asdict(settings) | {"prior": describe_prior(prior)},
        "engine": {"version": ENGINE_VERSION},
        "simulator": stirring.settings,
        "inputs": {"sha256": [recording.hash for recording in stirring.recordings]},
        "files": {"recordings": [recording.path.name for recording in stirring.recordings]},
        "versions": versions(LIBRARIES),
    }


def generations() -> dict[str, str]:
    """Of engine and model: what another one made is not to be taken for this one's."""
    from ..inference.engine_version import ENGINE_VERSION
    from ..models import MODEL_VERSION

    return {"engine": ENGINE_VERSION, "model": MODEL_VERSION}


def versions(libraries: Iterable[str]) -> dict[str, str]:
    """Of Python and the named libraries."""
    return {"python": platform.python_version()} | {name: version(name) for name in libraries}
