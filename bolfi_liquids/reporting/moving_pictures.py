"""The frames of a run as a page's script draws them.

A picture takes 4 kB for 1000 particles. As an animated image it would take 0.12 s to draw and at
least 5 kB, with nothing to pause, to turn back, or to follow in the figures beside it.
"""

import base64
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..hover_labels import short
from ..inputs.cups import kept_cups
from ..wording import sentence, with_unit

if TYPE_CHECKING:
    from xarray import Dataset

    from .frames import Shown

BYTE_LEVELS = 254
"""Values of a byte that a coordinate is rounded to; 255 marks a particle that is gone."""


def moving_context(shown: "Shown", frames: "Dataset") -> dict[str, Any] | None:
    """What the template and the script need of `frames.frames_of`; None if all of them failed.

    Args:
        shown: What they are of.
        frames: Its frames.
    """
    frames = frames.isel(draw=np.flatnonzero(_sound(frames)))
    if frames.sizes["draw"] == 0:
        return None
    scenes = {"stir": _stir_scene(shown, frames)}
    if "poured" in frames and shown.action is not None:
        scenes["pour"] = _pour_scene(shown.action, frames)
    draws = [_draw(frames.isel(draw=at)) for at in range(frames.sizes["draw"])]
    return {"draws": draws, "scenes": scenes, "extended": bool(shown.calibration.added)}


def _sound(frames: "Dataset") -> NDArray[np.bool_]:
    """Draws of which neither the stir nor the pour has diverged."""
    shown = [frames["tip"].to_numpy().sum(axis=(1, 2))]
    if "spilled" in frames:
        shown.append(frames["spilled"].to_numpy())
    return np.all(np.isfinite(shown), axis=0)


def _draw(one: "Dataset") -> dict[str, Any]:
    theta = {str(name): float(value) for name, value in one.coords.items()}
    told = ", ".join(f"{name} {with_unit(name, value)}" for name, value in theta.items())
    return {
        "theta": theta,
        "liquid": told,
        "outcome": _outcome(one),
        "time": short(one["time"]),
        "inclination": {
            plane: short(np.degrees(one["inclination"].isel(plane=at)))
            for at, plane in enumerate(("xz", "yz"))
        },
    }


def _outcome(one: "Dataset") -> str:
    if "spilled" not in one:
        return ""
    spilled, retained = float(one["spilled"]), float(one["retained"])
    return str(sentence("pour.outcome", spilled=spilled, retained=retained))


def _stir_scene(shown: "Shown", frames: "Dataset") -> dict[str, Any]:
    from ..models import StirSetup

    recording, particles = shown.recording, int(shown.calibration.record["settings"]["particles"])
    setup = StirSetup.from_recording(recording, particles=particles)
    radius, top = setup.cup.radius, float(frames["pivot"][..., 2].max())
    return {
        **_packed(frames["stirred"].to_numpy()),
        "time": short(frames["stir_time"]),
        "pivot": short(frames["pivot"]),
        "tip": short(frames["tip"]),
        "cup": {"radius": radius, "height": float(recording.attrs["cup_height"])},
        "stick": setup.stick.radius,
        "radius": setup.spacing / 2.0,
        "seen": [[-1.1 * radius, -radius, 0.0], [1.1 * radius, radius, top]],
    }


def _pour_scene(pour: Mapping[str, Any], frames: "Dataset") -> dict[str, Any]:
    cups = kept_cups(pour["cups"])
    source, receiver, lip = cups.source, cups.receiver, cups.pour.lip_height
    distance = float(pour["distance"])
    reach = float(np.hypot(2.0 * source.radius, source.height))
    wide = max(source.radius, receiver.radius)
    low = [-max(2.0 * source.radius, receiver.radius - distance) - 0.005, -wide, -lip]
    high = [max(reach, distance + receiver.radius) + 0.005, wide, reach]
    return {
        **_packed(frames["poured"].to_numpy()),
        "time": short(frames["pour_time"]),
        "angle": short(frames["angle"]),
        "caught": short(frames["caught"]),
        "source": {"radius": source.radius, "height": source.height},
        "receiver": {"radius": receiver.radius, "height": receiver.height},
        "distance": distance,
        "lip_height": lip,
        "depth": cups.liquid_volume / (np.pi * receiver.radius**2),
        "radius": cups.spacing(frames.sizes["pour_particle"]) / 2.0,
        "seen": [low, high],
    }


def _packed(position: NDArray) -> dict[str, Any]:
    """Positions (draws, frames, n, 3) as bytes between the ends of each axis, in base64."""
    there = position[np.isfinite(position).all(axis=-1)]
    low, high = (there.min(axis=0), there.max(axis=0)) if len(there) else (np.zeros(3), np.ones(3))
    scaled = np.round(BYTE_LEVELS * (position - low) / np.maximum(high - low, 1e-9))
    bytes_ = np.where(np.isnan(scaled), 255, scaled).astype(np.uint8)
    return {
        "low": low.tolist(),
        "high": high.tolist(),
        "particles": position.shape[2],
        "positions": [base64.b64encode(one.tobytes()).decode() for one in bytes_],
    }
