"""Finished replicates as one value, from which every check is computed."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .._lazy import xr
from ..arguments import check_function, checked_array, checked_mapping
from ..prior import Prior
from .one_replicate import Replicate, as_theta
from .ranks import quantiles

LOG_DENSITY = "log_density"

Quantity = Callable[[Mapping[str, np.ndarray], np.ndarray], np.ndarray]
"""(theta: name -> [n], observed) -> [n]: a number that is checked like a parameter."""

Values = dict[str, tuple[np.ndarray, np.ndarray]]
"""Quantity -> (its value at the truths [R], at the draws [R, L] with NaN after the last)."""


@dataclass(frozen=True, repr=False, eq=False)
class Replicates:
    """Posterior draws of a pipeline for R data sets of known truth.

    Attributes:
        prior: Of the truths.
        seed: Of the truths, the data and the pipeline.
        most: L, draws wanted of each replicate.
        finished: Replicates with draws, R of them.
        failed: Those without, each with its `error`.
    """

    prior: Prior
    seed: int
    most: int
    finished: Sequence[Replicate]
    failed: Sequence[Replicate]

    def __len__(self) -> int:
        return len(self.finished)

    def __repr__(self) -> str:
        text = f"{len(self)} replicates, up to {self.most} independent draws each"
        return f"{text}; {len(self.failed)} more failed" if self.failed else text

    @property
    def index(self) -> np.ndarray:
        """Numbers of the finished replicates, [R]."""
        return np.array([r.number for r in self.finished], np.int64)

    @property
    def truth(self) -> np.ndarray:
        """[R, d], natural units.

        Raises:
            ValueError: nothing finished.
        """
        if not self.finished:
            first = next(iter(self.errors.values()), "none was run")
            raise ValueError(f"no replicate finished, so nothing can be checked: {first}")
        return np.stack([r.truth for r in self.finished])

    @property
    def draws(self) -> np.ndarray:
        """Independent draws [R, L, d], NaN where a replicate has fewer."""
        return np.stack([_padded(r.draws, self.most) for r in self.finished])

    @property
    def count(self) -> np.ndarray:
        """Independent draws of each finished replicate, [R]."""
        return np.array([len(r.draws) for r in self.finished])

    @property
    def errors(self) -> dict[int, str]:
        """Number -> error of the failed replicates."""
        return {r.number: f"{r.stage}: {r.error}" for r in self.failed}

    def values(self, quantities: Mapping[str, Quantity] | None = None) -> Values:
        """Parameters and further quantities at truths and draws.

        Raises:
            ValueError: nothing finished; a name that is taken; a value that is no number or
                of the wrong shape.
        """
        given = checked_mapping("quantities", quantities, "functions")
        truth, draws = self.truth, self.draws
        names = self.prior.names
        found = {name: (truth[:, j], draws[..., j]) for j, name in enumerate(names)}
        for name, quantity in given.items():
            check_function(f"quantities[{name!r}]", quantity)
            if name in (*names, LOG_DENSITY):
                raise ValueError(f"quantity {name!r} has the name of another; choose a new one")
            found[name] = _split(
                [_evaluated(name, quantity, r, names) for r in self.finished], self
            )
        return found

    def log_density(self) -> Values:
        """The pipeline's own log density at truths and draws; empty if it gives none."""
        rows = [r.log_density for r in self.finished if r.log_density is not None]
        if not rows or len(rows) < len(self.finished):
            return {}
        return {LOG_DENSITY: _split(rows, self)}

    def quantiles(self, values: Values) -> np.ndarray:
        """Randomised quantiles of truths among draws, [R, q] in [0, 1); see `ranks.quantiles`."""
        columns = [
            quantiles(truth, draws, self.random(name)) for name, (truth, draws) in values.items()
        ]
        return np.stack(columns, -1)

    def random(self, purpose: str, columns: int | None = None) -> np.ndarray:
        """Uniform numbers that belong to each replicate, [R] or [R, columns]."""
        rng = np.random.default_rng([self.seed, zlib.crc32(purpose.encode())])
        last = int(self.index.max())
        shape = (last + 1,) if columns is None else (last + 1, columns)
        return rng.random(shape)[self.index]

    @property
    def warnings(self) -> list[str]:
        """Too many failed replicates, or too few independent draws, in sentences."""
        tolerated = np.sqrt(max(len(self), 1)) / 2  # that many hide in a rank's standard error
        said = []
        if len(self.failed) > tolerated:
            said.append(
                f"{len(self.failed)} of {len(self) + len(self.failed)} replicates failed, enough "
                f"to hide a fault; the first: {next(iter(self.errors.values()))}"
            )
        short = int(np.sum(self.count < self.most)) if self.finished else 0
        if short > tolerated:
            said.append(
                f"{short} of {len(self)} replicates gave fewer than {self.most} independent draws "
                f"(the least {self.count.min()}): sample longer, or ask for fewer draws"
            )
        return said

    def to_dataset(self) -> "xr.Dataset":
        """Truths and independent draws by parameter, effective sample sizes and seconds."""
        variables: dict[str, tuple[list[str], np.ndarray]] = {
            "effective_size": (["replicate"], np.array([r.effective for r in self.finished])),
            "seconds": (["replicate"], np.array([r.seconds for r in self.finished])),
        }
        for name, (truth, draws) in (self.values() | self.log_density()).items():
            variables[f"{name}_truth"] = (["replicate"], truth)
            variables[name] = (["replicate", "draw"], draws)
        attributes = {"seed": self.seed, "failed": len(self.failed)}
        return xr.Dataset(variables, {"replicate": self.index}, attributes)


def _padded(rows: np.ndarray, length: int) -> np.ndarray:
    full = np.full((length, *rows.shape[1:]), np.nan)
    full[: len(rows)] = rows
    return full


def _split(rows: Sequence[np.ndarray], made: Replicates) -> tuple[np.ndarray, np.ndarray]:
    padded = np.stack([_padded(row, 1 + made.most) for row in rows])
    return padded[:, 0], padded[:, 1:]


def _evaluated(
    name: str, quantity: Quantity, replicate: Replicate, names: tuple[str, ...]
) -> np.ndarray:
    """A quantity at the truth and then the draws of one replicate."""
    rows = np.concatenate([replicate.truth[None], replicate.draws])
    returned = quantity(as_theta(rows, names), replicate.observed.copy())
    values = checked_array(f"what quantity {name!r} returns", returned)
    if values.shape != (len(rows),) or np.isnan(values).any():
        raise ValueError(
            f"quantity {name!r} must return one number for each of {len(rows)} theta, "
            f"got shape {values.shape} with {int(np.isnan(values).sum())} NaN"
        )
    return values
