"""Pours that land on a line, evenly between two places: all that is judged of them is known."""

import csv
import json
from typing import NamedTuple

import numpy as np
from bolfi_liquids.models import Landings

RADIUS = 0.035  # m, of the receiver
HALF = 0.020  # m, half the length of a strip
PARTICLES = 4000
DISTANCES = np.round(np.arange(0.0, 0.0625, 0.005), 4)  # m
SPEEDS = (45.0, 90.0)  # deg/s
SPEED_STEP = 0.003  # m, that the faster pour lands further out
COLUMNS = (
    "file,liquid,viscosity_Pa_s,density_kg_m3,surface_tension_N_m,contact_angle_deg,hold_s,"
    "retained_resolved"
)
CUPS = """
[source]
radius = 0.028
height = 0.06
fill = 0.034
[receiver]
radius = 0.035
height = 0.07
[pour]
lip_height = 0.20
final_angle_deg = 135.0
hold = 0.9
angular_velocity_deg_s = [30.0, 180.0]
distance = [0.0, 0.07]
"""


class Strip(NamedTuple):
    """Where the slower pour of a liquid lands: the middle of its strip [m]; and what stays."""

    table: str
    liquid: str
    viscosity: str
    angle: str
    middle: float
    retained: float
    resolved: str = "yes"

    @property
    def name(self):
        return f"{self.liquid}_contact_{self.angle}"


STRIPS = (
    Strip("pours.csv", "thin", "0.001", "60", 0.056, 0.0),
    Strip("wetting.csv", "thin", "0.001", "110", 0.061, 0.0),
    Strip("pours.csv", "thick", "1", "60", 0.004, 0.1),
    Strip("wetting.csv", "thick", "1", "110", 0.011, 0.05),
    Strip("pours.csv", "filmy", "0.1", "30", 0.056, 0.01, "no"),
)
NAMES = (
    "thin_contact_60",
    "thin_contact_110",
    "filmy_contact_30",
    "thick_contact_60",
    "thick_contact_110",
)


def middles(strip):
    """Of the strip at each speed [m]."""
    return [strip.middle + SPEED_STEP * k for k in range(len(SPEEDS))]


def spilled(middle, distance, retained=0.0):
    """Fraction of all liquid beside a receiver: the strip's length outside of it."""
    low, high = middle - HALF, middle + HALF
    inside = np.minimum(high, distance + RADIUS) - np.maximum(low, distance - RADIUS)
    return (1.0 - retained) * (1.0 - np.clip(inside, 0.0, None) / (2.0 * HALF))


def landed(middles, retained, resolution=PARTICLES):
    """Landings of pours whose strips have these middles."""
    along = HALF * (2.0 * (np.arange(resolution) + 0.5) / resolution - 1.0)
    position = np.zeros((len(middles), resolution, 2), np.float32)
    position[..., 0] = np.add.outer(middles, along)
    retained = np.broadcast_to(np.asarray(retained, float), len(middles))
    for pour, share in zip(position, retained, strict=True):
        # those that stay are taken evenly from the whole strip
        if share:
            pour[:: round(1.0 / share)] = np.nan
    return Landings(position, np.isnan(position[..., 0]).mean(axis=1))


def write_reference(folder):
    """All files of a reference: the second table has no landings."""
    (folder / "cups.toml").write_text(CUPS)
    rows = [
        f"{one.table},{one.liquid},{one.viscosity},1000,0.06,{one.angle},1.5,{one.resolved}"
        for one in STRIPS
    ]
    (folder / "pour_truths.csv").write_text("\n".join([COLUMNS, *rows]) + "\n")
    for table in ("pours.csv", "wetting.csv"):
        with (folder / table).open("w", newline="") as file:
            written = csv.writer(file)
            names = "liquid,angular_velocity_deg_s,distance_cm,received,retained,spilled"
            written.writerow(names.split(","))
            for strip in (one for one in STRIPS if one.table == table):
                written.writerows(_rows(strip))
    cases = {
        f"{strip.liquid}_{speed:g}": _landing(strip, speed, middle)
        for strip in STRIPS
        if strip.table == "pours.csv"
        for speed, middle in zip(SPEEDS, middles(strip), strict=True)
    }
    (folder / "pours_landings.json").write_text(json.dumps({"cases": cases}))


def _rows(strip):
    for speed, middle in zip(SPEEDS, middles(strip), strict=True):
        for distance in DISTANCES:
            beside = spilled(middle, distance, strip.retained)
            received = 1.0 - strip.retained - beside
            amounts = (round(1e6 * share) for share in (received, strip.retained, beside))
            yield strip.liquid, speed, round(100.0 * distance, 3), *amounts


def _landing(strip, speed, middle):
    edges = np.arange(round(1e3 * (middle - HALF)), round(1e3 * (middle + HALF)))
    bins = [[int(edge), 0, (1.0 - strip.retained) / len(edges)] for edge in edges]
    return {"liquid": strip.liquid, "angular_velocity_deg_s": speed, "x_y_fraction": bins}
