"""Data sets in which effects are hidden: a file of each subject, for any method.

    python tests/benchmarks/misfit/data_sets.py --out misfit_sets

The README lists what a file holds. The first sets of a file are the same however many are made.
"""

import argparse
import json
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import xarray as xr

sys.path.insert(0, str(Path(__file__).parent))

from subject import Subject, signal_to_noise, size, two_sided, whitener
from subjects import SUBJECTS

NULLS, KNOWN, OUTSIDE, PAIRS = 300, 40, 15, 40  # of each subject; of each of its effects
RATIOS = 3.0, 30.0  # SNR that is asked for, uniform in its log
MIDDLE = 0.1  # quantiles of the base parameters' priors that are left out at both ends
JOIN = " with "


@dataclass(frozen=True, eq=False)
class DataSet:
    """Two data sets of one truth.

    Attributes:
        subject: Its name.
        number: In the file.
        effects: What is hidden.
        theta: Base parameters, and coefficients of what is hidden.
        visible, snr: SNR beyond the base parameters, and beyond all rivals as well.
        seed: For methods that draw.
        observed, held_out: Of both experiments.
    """

    subject: str
    number: int
    effects: tuple[str, ...]
    theta: dict[str, float]
    visible: float
    snr: float
    seed: int
    observed: np.ndarray
    held_out: np.ndarray

    @property
    def truth(self) -> str:
        """The explanation that is right."""
        known = all(name in SUBJECTS[self.subject].extensions for name in self.effects)
        return JOIN.join(self.effects) or "none" if known else "none of these"


def kinds(subject: Subject) -> list[tuple[str, int]]:
    """What is hidden in each data set ("pair" for two effects), and which of its kind it is; the
    kinds interleaved, so that the first sets show all of them."""
    counts = {"": NULLS} | dict.fromkeys(subject.extensions, KNOWN)
    counts |= dict.fromkeys(subject.outside, OUTSIDE) | {"pair": PAIRS}
    sets = [(kind, i) for kind, count in counts.items() for i in range(count)]
    return sorted(sets, key=lambda one: (one[1] + 0.5) / counts[one[0]])


def make(name: str, number: int) -> DataSet:
    """The data set of this number."""
    subject = SUBJECTS[name]
    kind, index = kinds(subject)[number]
    rng = np.random.default_rng([index, *name.encode(), *kind.encode()])
    u = rng.uniform(MIDDLE, 1.0 - MIDDLE, (1, len(subject.prior)))
    theta = {key: float(values[0]) for key, values in subject.prior.from_unit(u).items()}
    chosen = rng.choice(tuple(subject.extensions), 2, replace=False) if kind == "pair" else [kind]
    hidden = tuple(name for name in subject.effects if name in chosen)
    visible = snr = 0.0
    if hidden:
        white = whitener(subject.fitted, theta)
        coefficients = {}
        for effect in hidden:
            side = rng.choice([-1, 1]) if two_sided(subject.effects[effect]) else 1
            ratio = float(np.exp(rng.uniform(*np.log(RATIOS))))
            coefficients[effect] = size(subject, theta, effect, side * ratio, white)
        theta |= coefficients
        white = whitener(subject.fitted, theta)
        visible, snr = signal_to_noise(subject, hidden, theta, white)
    first, second, seed = (int(one) for one in rng.integers(2**31, size=3))
    observed = subject.fitted.observe(theta, first)
    held_out = subject.held_out.observe(theta, second)
    return DataSet(name, number, hidden, theta, visible, snr, seed, observed, held_out)


def saved(sets: list[DataSet]) -> xr.Dataset:
    """One subject's sets as a file holds them."""
    subject = SUBJECTS[sets[0].subject]
    names = (*subject.prior.names, *subject.effects)
    priors = subject.prior.describe() | {
        name: {"prior": repr(one.prior), "units": one.unit} for name, one in subject.effects.items()
    }
    signal = ("sample", "channel")[: sets[0].observed.ndim]
    theta = [[one.theta.get(name, 0.0) for name in names] for one in sets]
    return xr.Dataset(
        {
            "effects": ("set", [JOIN.join(one.effects) for one in sets]),
            "truth": ("set", [one.truth for one in sets]),
            "theta": (("set", "parameter"), np.array(theta)),
            "visible": ("set", [one.visible for one in sets]),
            "snr": ("set", [one.snr for one in sets]),
            "seed": ("set", [one.seed for one in sets]),
            "observed": (("set", *signal), np.stack([one.observed for one in sets])),
            "held_out": (("set", *signal), np.stack([one.held_out for one in sets])),
        },
        coords={"parameter": list(names)},
        attrs={
            "subject": subject.name,
            "settings": subject.settings,
            "registry": list(subject.extensions),
            "outside": list(subject.outside),
            "priors": json.dumps(priors),
        },
    )


def opened(path: Path) -> list[DataSet]:
    """The sets of a file."""
    with xr.open_dataset(path, engine="h5netcdf") as file:
        data = file.load()
    found = []
    for number in range(data.sizes["set"]):
        one = data.isel(set=number)
        effects = tuple(str(one.effects.item()).split(JOIN)) if one.effects.item() else ()
        values = dict(zip(data.parameter.values.tolist(), one.theta.values.tolist(), strict=True))
        base = SUBJECTS[data.subject].prior.names
        theta = {name: v for name, v in values.items() if name in (*base, *effects)}
        ratios, seed = (float(one.visible), float(one.snr)), int(one.seed)
        signals = one.observed.values, one.held_out.values
        found.append(DataSet(data.subject, number, effects, theta, *ratios, seed, *signals))
    return found


def files(folder: Path) -> Iterator[list[DataSet]]:
    """The sets of each file in a folder."""
    for path in sorted(folder.glob("*.nc")):
        yield opened(path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("misfit_sets"))
    parser.add_argument("--subjects", nargs="+", choices=tuple(SUBJECTS), default=list(SUBJECTS))
    parser.add_argument("--first", type=int, help="how many sets of each subject; all by default")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    asked.out.mkdir(exist_ok=True)
    with ProcessPoolExecutor(asked.workers, mp_context=get_context("spawn")) as pool:
        for name in asked.subjects:
            numbers = range(len(kinds(SUBJECTS[name])))[: asked.first]
            made = list(pool.map(partial(make, name), numbers, chunksize=8))
            saved(made).to_netcdf(asked.out / f"{name}.nc", engine="h5netcdf")
            print(f"{name}: {len(made)} data sets")
