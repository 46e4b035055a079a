"""What each effect does to a stir, in three liquids: the table of `guide liquids`.

    .venv/bin/python tests/benchmarks/effect_signatures.py

The stir is the bundled one of glycerin. A signature is the RMS difference in inclination, over time
and both planes, that a coefficient makes: in brackets what is left of it once a change of viscosity
has explained what it can.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from bolfi_liquids import models
from bolfi_liquids.inputs.bundled import bundled_recording

LIQUIDS = {"water": (0.001, 1000.0), "oil": (0.1, 900.0), "glycerin": (1.0, 1260.0)}
SIZES = {
    "camera_delay": 0.05,
    "camera_rotation": float(np.radians(5.0)),
    "camera_tilt": float(np.radians(1.0)),
    "camera_tilt_yz": float(np.radians(1.0)),
    "fill_level": 1e-3,
    "gripper_scale": 1.05,
    "pivot_friction": 2e-4,
    "shear_thinning": 0.3,
    "stick_mass": 1.1,
    "warming": 0.05,
    "yield_stress": 5.0,
}
VISCOSITY_FACTOR = 1.1  # times the viscosity, by which a change of it is told


class Signature(NamedTuple):
    """Of an effect in a liquid [deg]."""

    whole: float
    left: float


def signatures(viscosity: float, density: float) -> Iterator[tuple[str, Signature]]:
    """Of each effect that stirs show."""
    recording = bundled_recording("glycerin")
    setup = models.StirSetup.from_recording(recording)

    def stir(viscosity: float, effects: dict[str, float] | None = None) -> np.ndarray:
        liquid = models.Liquid(viscosity, 0.5, density)
        return np.degrees(models.stir(liquid, recording.gripper, setup, [0], effects)[0]).ravel()

    plain = stir(viscosity)
    slope = stir(VISCOSITY_FACTOR * viscosity) - plain
    for name, size in SIZES.items():
        change = stir(viscosity, {name: size}) - plain
        left = change - slope * (slope @ change) / (slope @ slope)
        yield name, Signature(rms(change), rms(left))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def main() -> None:
    found = {name: dict(signatures(*liquid)) for name, liquid in LIQUIDS.items()}
    print(f"| effect | size | {' | '.join(found)} |\n|---|---|{'---|' * len(found)}")
    for name, size in SIZES.items():
        cells = [f"{one[name].whole:.2f} ({one[name].left:.2f})" for one in found.values()]
        unit = models.EFFECTS[name].unit
        told = f"{size:.3g}" if unit == "1" else f"{size:.3g} {unit}"
        print(f"| `{name}` | {told} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
