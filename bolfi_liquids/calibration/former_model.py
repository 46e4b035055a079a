"""A run of another version of the simulator: its liquid is another, so nothing follows from it."""

from ..errors import InputError
from ..run.recordings import kept_paths
from ..wording import command
from .result import Calibration, given_options


def refuse_other_model(calibration: Calibration) -> None:
    """Refuse to conclude anything, or to pour, from simulations of another model version.

    Its results can still be opened and read.

    Raises:
        InputError: Another version simulated the stirs; the message has the command that
            calibrates on the run's own recordings again.
    """
    from ..models import MODEL_VERSION

    run, record = calibration.path, calibration.record
    simulators = record.get("simulator", {}).values()
    held = {str(one.get("model", "unknown")) for one in simulators} or {"unknown"}
    if held == {MODEL_VERSION}:
        return
    recordings = kept_paths(run, record) or ("RECORDING...",)
    anew = run.with_name(f"{run.name}_model_{MODEL_VERSION}")
    raise InputError(
        f"was simulated by model {', '.join(sorted(held))}, and the liquid of model "
        f"{MODEL_VERSION} is another",
        where=str(run),
        fix="calibrate again: "
        + command("calibrate", *recordings, "--out", anew, *given_options(record)),
    )
