"""The bundled rig with a stir that does not last long."""

from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.rig_file import bundled_rig


def short_rig(**stirring: float) -> Rig:
    """Five strokes of a small star, hardly any rest; `stirring` replaces more of the plan."""
    rig, short = bundled_rig(), {"rest": 0.1, "points": 5, "radius": 0.02}
    return rig.model_copy(update={"stirring": rig.stirring.model_copy(update=short | stirring)})
