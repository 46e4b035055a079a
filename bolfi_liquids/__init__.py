"""Learn a liquid's parameters by stirring it, then pour it without spilling."""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .calibration.calibrate import calibrate
    from .calibration.result import Calibration
    from .criticism.criticise import criticise
    from .criticism.result import Criticism
    from .inputs.recording import Recording, open_recording
    from .inputs.table_import import import_table
    from .models import Cups
    from .pouring.choose import choose_pour
    from .reporting.report import report
    from .robot.pour import execute_pour
    from .robot.record import record
    from .simulation.simulate import simulate_pour, simulate_stir

__version__ = version("bolfi-liquids")
__all__ = [
    "Calibration",
    "Criticism",
    "Cups",
    "Recording",
    "__version__",
    "calibrate",
    "choose_pour",
    "criticise",
    "execute_pour",
    "import_table",
    "open_recording",
    "record",
    "report",
    "simulate_pour",
    "simulate_stir",
]

# loaded on use: `import bolfi_liquids` must cost neither JAX nor Taichi
_HOME = {
    "Calibration": ".calibration.result",
    "Criticism": ".criticism.result",
    "Cups": ".models",
    "Recording": ".inputs.recording",
    "calibrate": ".calibration.calibrate",
    "choose_pour": ".pouring.choose",
    "criticise": ".criticism.criticise",
    "execute_pour": ".robot.pour",
    "import_table": ".inputs.table_import",
    "open_recording": ".inputs.recording",
    "record": ".robot.record",
    "report": ".reporting.report",
    "simulate_pour": ".simulation.simulate",
    "simulate_stir": ".simulation.simulate",
}


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name], __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
