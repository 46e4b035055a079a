"""Checks of replicates: ranks of truths, coverage of intervals, distances to random points."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .._lazy import stats, xr
from ..arguments import check_flag, check_kind, checked_array, checked_number, require
from .finished_replicates import LOG_DENSITY, Quantity, Replicates
from .ranks import bin_count, counts_below, p_value, quantiles, to_ranks

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAMED_SHAPE_Z = 3.0  # standard errors from which a shape of the ranks is named
CONFIDENCE = 0.99  # of the intervals shown for each rate of coverage
POWER = 0.8  # of the coverage that is said to be found
DRAWN_LEVELS = 100  # at which the curve of a figure is drawn
BOOTSTRAPS = 1000
BOOTSTRAP_CONFIDENCE = 0.95  # of the bootstrap band


class Warned(ABC):
    """A result that is `ok` unless it warns."""

    @property
    @abstractmethod
    def warnings(self) -> list[str]:
        """Warnings about the pipeline."""

    @property
    def ok(self) -> bool:
        """No warning."""
        return not self.warnings


@dataclass(frozen=True, eq=False)
class Judged(Warned):
    """The result of a check.

    Attributes:
        replicates: What was checked, R of them.
        alpha: False alarms of `ok` when all is right, all levels and quantities together.
    """

    replicates: Replicates
    alpha: float

    @property
    @abstractmethod
    def faults(self) -> list[str]:
        """Faults of the pipeline, beside those of its replicates."""

    @property
    def warnings(self) -> list[str]:
        """Warnings about the pipeline."""
        return self.replicates.warnings + self.faults

    def _table(self, heading: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
        """A heading, aligned columns (the first to the left), and what was found wrong."""
        cells = [["", *columns], *map(list, rows)]
        widths = [max(len(row[j]) for row in cells) for j in range(len(cells[0]))]
        lines = [
            "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]).rstrip()
            for row in cells
        ]
        verdict = [f"! {warning}" for warning in self.warnings] or ["ok"]
        return "\n".join([f"{heading}: {self.replicates}", *lines, *verdict])


def _check_arguments(made: object, alpha: object) -> None:
    """Raise ValueError unless these are replicates and a rate of false alarms."""
    check_kind("made", made, Replicates)
    checked_number("alpha", alpha, lambda a: 0.0 < a < 1.0, "a number between 0 and 1")


@dataclass(frozen=True, eq=False)
class SBC(Judged):
    """Ranks of R truths among their draws, and how well they agree with uniform ones.

    Attributes:
        names: q quantities: the parameters, further ones, and the pipeline's log density.
        ranks: 0..L on one common scale, [R, q].
        chi_square: p-values of binned ranks, [q].
        ecdf: Exact p-values of the ranks' ECDF leaving its simultaneous band, [q].
    """

    names: tuple[str, ...]
    ranks: np.ndarray
    chi_square: np.ndarray
    ecdf: np.ndarray

    @property
    def draws(self) -> int:
        """L; ranks are 0..L."""
        return self.replicates.most

    @property
    def faults(self) -> list[str]:
        """Quantities whose ranks are not uniform."""
        limit = self.alpha / (2 * len(self.names))
        least = np.minimum(self.chi_square, self.ecdf)
        return [
            f"{name}: ranks are not uniform (p = {p:.1g}){_shape(name, ranks, self.draws)}"
            for name, p, ranks in zip(self.names, least, self.ranks.T, strict=True)
            if p < limit
        ]

    def __str__(self) -> str:
        rows = [
            [name, f"{self.chi_square[j]:.3g}", f"{self.ecdf[j]:.3g}"]
            for j, name in enumerate(self.names)
        ]
        return self._table("Simulation-based calibration", ["p chi-square", "p ECDF"], rows)

    def to_dataset(self) -> "xr.Dataset":
        """Ranks and p-values."""
        return xr.Dataset(
            {
                "rank": (["replicate", "quantity"], self.ranks),
                "chi_square_p": ("quantity", self.chi_square),
                "ecdf_p": ("quantity", self.ecdf),
            },
            {"replicate": self.replicates.index, "quantity": list(self.names)},
            {"draws": self.draws, "alpha": self.alpha, "ok": int(self.ok)},
        )

    def plot(self, ax: "Axes | None" = None, level: float = 0.95) -> "Axes":
        """ECDF of the ranks minus that of uniform ones, with its simultaneous band.

        The band holds the whole curve of a calibrated quantity with probability `level`.
        """
        from .plots import LEGEND_BELOW, axes, band, closed, colour, finish

        ax = axes(ax)
        n = len(self.replicates)
        z = band(ax, n, self.draws, level)
        for j, name in enumerate(self.names):
            below = counts_below(self.ranks[:, j], self.draws) / n - z
            ax.plot(closed(z, 1.0), closed(below, 0.0), color=colour(j), lw=1.6, label=name)
        reach = 1.15 * np.abs(ax.dataLim.intervaly).max()
        ax.set_ylim(-reach, reach)
        ax.set_xlabel("rank of the truth among the draws, as a fraction")
        ax.set_ylabel("ECDF − uniform")
        return finish(ax, n, **LEGEND_BELOW)


def _shape(name: str, ranks: np.ndarray, draws: int) -> str:
    """Meaning of a departure from uniform ranks of a plain shape; "" for any other."""
    u = (ranks + 0.5) / (draws + 1) - 0.5
    n = len(u)
    shift = u.mean() * np.sqrt(12 * n)
    spread = (12 * u**2 - 1).mean() * np.sqrt(n / 0.8)  # var of 12 u^2 is 4/5
    if max(abs(shift), abs(spread)) < NAMED_SHAPE_Z:
        return ""
    if name == LOG_DENSITY and abs(shift) > NAMED_SHAPE_Z:
        return ": draws too wide" if shift > 0 else ": draws too narrow, or in the wrong place"
    if abs(shift) > abs(spread):
        return ": draws too low" if shift > 0 else ": draws too high"
    return ": draws too narrow" if spread > 0 else ": draws too wide"


def sbc(
    made: Replicates, *, quantities: Mapping[str, Quantity] | None = None, alpha: float = 0.01
) -> SBC:
    """Simulation-based calibration (Talts et al. 2018; Modrák et al. 2023).

    256 replicates of two parameters find draws 30 % too narrow always, 20 % eight times in ten
    and 10 % once (60 trials each, at the default alpha; `coverage` has more power against
    draws that are only too narrow or too wide). Ranks of parameters cannot see a posterior
    that ignores the data and returns the prior; the rank of a log density can, so let the
    pipeline return one, or give it as a quantity.

    Args:
        made: What `replicates` returned.
        quantities: Further functions (theta: name -> [n], observed) -> [n] to rank.
        alpha: False alarms of `ok`.

    Raises:
        ValueError: `made` is something else, none finished, or a quantity is refused.
    """
    _check_arguments(made, alpha)
    values = made.values(quantities) | made.log_density()
    ranks = to_ranks(made.quantiles(values), made.most)
    bins = bin_count(len(made), made.most)
    binned = [np.bincount(column * bins // (made.most + 1), minlength=bins) for column in ranks.T]
    return SBC(
        replicates=made,
        names=tuple(values),
        ranks=ranks,
        chi_square=np.array([stats.chisquare(counts).pvalue for counts in binned]),
        ecdf=np.array([p_value(column, made.most) for column in ranks.T]),
        alpha=alpha,
    )


@dataclass(frozen=True, eq=False)
class Coverage(Judged):
    """Numbers of R central intervals that held the truth.

    Attributes:
        names: q quantities.
        levels: k nominal levels, in (0, 1).
        covered: Intervals that held the truth, [k, q].
        quantiles: Where each truth lies among its draws, [R, q].
        p_values: Binomial, [k, q]; two-sided, or of too few if `conservative`.
        conservative: Only too little coverage counts against the pipeline.
    """

    names: tuple[str, ...]
    levels: np.ndarray
    covered: np.ndarray
    quantiles: np.ndarray
    p_values: np.ndarray
    conservative: bool

    @property
    def rate(self) -> np.ndarray:
        """Share of intervals that held the truth, [k, q]."""
        return self.covered / len(self.replicates)

    @property
    def low(self) -> np.ndarray:
        """Lower end of the exact 99 % interval of the rate (Clopper and Pearson 1934), [k, q]."""
        n, tail = len(self.replicates), (1 - CONFIDENCE) / 2
        return np.nan_to_num(stats.beta.ppf(tail, self.covered, n - self.covered + 1), nan=0.0)

    @property
    def high(self) -> np.ndarray:
        """Upper end, [k, q]."""
        n, tail = len(self.replicates), (1 - CONFIDENCE) / 2
        return np.nan_to_num(stats.beta.ppf(1 - tail, self.covered + 1, n - self.covered), nan=1.0)

    @property
    def noticed(self) -> np.ndarray:
        """Coverage of a quantity at each level that so many replicates fail in four of five cases,
        [k]; what is nearer to the level they may pass."""
        n, ends = len(self.replicates), 1 if self.conservative else 2
        most = stats.binom.ppf(self.alpha / self.p_values.size / ends, n, self.levels) - 1.0
        return np.where(
            most < 0.0, 0.0, stats.beta.isf(POWER, np.maximum(most, 0.0) + 1.0, n - most)
        )

    @property
    def faults(self) -> list[str]:
        """Intervals that hold the truth too seldom or too often."""
        limit = self.alpha / self.p_values.size
        return [
            f"{name}: {level:.0%} intervals hold the truth in {self.rate[i, j]:.1%} (p = {p:.1g})"
            for j, name in enumerate(self.names)
            for i, (level, p) in enumerate(zip(self.levels, self.p_values[:, j], strict=True))
            if p < limit
        ]

    def __str__(self) -> str:
        rows = [
            [name]
            + [
                f"{self.rate[i, j]:.3f} [{self.low[i, j]:.3f}, {self.high[i, j]:.3f}]"
                for i in range(len(self.levels))
            ]
            for j, name in enumerate(self.names)
        ]
        rows.append(["found by 4 in 5", *(f"up to {rate:.3f}" for rate in self.noticed)])
        heading = f"Coverage of central intervals [exact {CONFIDENCE:.0%}]"
        return self._table(heading, [f"{level:g}" for level in self.levels], rows)

    def to_dataset(self) -> "xr.Dataset":
        """Rates, their exact 99 % intervals and p-values by level and quantity."""
        two = ["level", "quantity"]
        return xr.Dataset(
            {
                "rate": (two, self.rate),
                "low": (two, self.low),
                "high": (two, self.high),
                "p_value": (two, self.p_values),
            },
            {"level": self.levels, "quantity": list(self.names)},
            {"replicates": len(self.replicates), "alpha": self.alpha, "ok": int(self.ok)},
        )

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Coverage minus its nominal level, with exact 99 % intervals at the levels."""
        from matplotlib.ticker import PercentFormatter

        from .plots import LEGEND_BELOW, axes, band, closed, colour, finish

        ax = axes(ax)
        n, q = self.quantiles.shape
        z = band(ax, n, DRAWN_LEVELS - 1)  # |2 u - 1| is uniform like u
        level = closed(z, 1.0)
        for j, name in enumerate(self.names):
            within = np.sort(2 * np.abs(self.quantiles[:, j] - 0.5))
            curve = np.searchsorted(within, level, side="right") / n - level
            ax.plot(level, curve, color=colour(j), lw=1.2, alpha=0.6)
            shifted = self.levels + 0.008 * (j - (q - 1) / 2)  # so that bars do not hide each other
            error = np.stack([self.rate - self.low, self.high - self.rate])[:, :, j]
            excess = self.rate[:, j] - self.levels
            style = {"fmt": "o", "ms": 4.5, "capsize": 2.5, "lw": 1.2}
            ax.errorbar(shifted, excess, error, color=colour(j), label=name, **style)
        ax.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))
        ax.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
        ax.set_xlabel("nominal level of the central interval")
        ax.set_ylabel("truths held − nominal")
        return finish(ax, n, **LEGEND_BELOW)


def coverage(
    made: Replicates,
    *,
    levels: Sequence[float] = (0.5, 0.8, 0.9, 0.95),
    quantities: Mapping[str, Quantity] | None = None,
    alpha: float = 0.01,
    conservative: bool = False,
) -> Coverage:
    """Empirical coverage of central posterior intervals.

    Counts are exactly binomial where the posterior is right, whatever the number of draws: an
    end that falls between two draws is drawn at random. With 256 replicates the standard error
    of a rate near 0.9 is 0.019, and draws 20 % too narrow are always found, 10 % in one of
    three trials.

    Args:
        made: What `replicates` returned.
        levels: Nominal levels.
        quantities: Further functions (theta: name -> [n], observed) -> [n].
        alpha: False alarms of `ok`.
        conservative: Whether only too little coverage is a fault, as for a posterior that is wide
            by construction.

    Raises:
        ValueError: `made` is something else, none finished, a quantity is refused, or a level is
            outside (0, 1).
    """
    nominal = checked_array("levels", levels)
    fits = nominal.ndim == 1 and nominal.size and ((nominal > 0) & (nominal < 1)).all()
    require(fits, "levels", "lie between 0 and 1", levels)
    _check_arguments(made, alpha)
    check_flag("conservative", conservative)
    values = made.values(quantities)
    quantiles = made.quantiles(values)
    covered = np.sum(2 * np.abs(quantiles - 0.5) <= nominal[:, None, None], axis=1)
    few = stats.binom.cdf(covered, len(made), nominal[:, None])
    many = stats.binom.sf(covered - 1, len(made), nominal[:, None])
    p_values = few if conservative else np.minimum(1.0, 2 * np.minimum(few, many))
    return Coverage(made, alpha, tuple(values), nominal, covered, quantiles, p_values, conservative)


@dataclass(frozen=True, eq=False)
class Tarp(Judged):
    """Expected coverage probability against credibility.

    Attributes:
        credibility: 0 to 1, [L + 2].
        expected_coverage: Share of truths within the region of each credibility, [L + 2].
        low, high: Pointwise 95 % bootstrap band of it, over replicates.
        ranks: Of the truths by distance to the random points, 0..L, [R].
        ecdf: Exact p-value of the ranks' ECDF leaving its simultaneous band.
        kolmogorov_smirnov: p-value of the same ranks, randomised to be continuous.
    """

    credibility: np.ndarray
    expected_coverage: np.ndarray
    low: np.ndarray
    high: np.ndarray
    ranks: np.ndarray
    ecdf: float
    kolmogorov_smirnov: float

    @property
    def atc(self) -> float:
        """Area between curve and diagonal above credibility 1/2; < 0: draws too narrow."""
        upper = self.credibility >= 0.5
        excess = (self.expected_coverage - self.credibility)[upper]
        return float(np.trapezoid(excess, self.credibility[upper]))

    @property
    def faults(self) -> list[str]:
        """The sentence that the joint posterior does not cover, where it does not."""
        p = min(self.ecdf, self.kolmogorov_smirnov)
        if p >= self.alpha / 2:
            return []
        return [
            f"the joint posterior does not cover as it says (p = {p:.1g}, area to the "
            f"diagonal {self.atc:+.3f}; negative: draws too narrow, positive: too wide)"
        ]

    def __str__(self) -> str:
        row = [f"{self.ecdf:.3g}", f"{self.kolmogorov_smirnov:.3g}", f"{self.atc:+.3f}"]
        columns = ["p ECDF", "p Kolmogorov-Smirnov", "area to diagonal"]
        heading = "Tests of accuracy with random points"
        return self._table(heading, columns, [["joint posterior", *row]])

    def to_dataset(self) -> "xr.Dataset":
        """The curve, its band and the ranks."""
        return xr.Dataset(
            {
                "expected_coverage": ("credibility", self.expected_coverage),
                "low": ("credibility", self.low),
                "high": ("credibility", self.high),
                "rank": ("replicate", self.ranks),
            },
            {"credibility": self.credibility, "replicate": self.replicates.index},
            {
                "ecdf_p": self.ecdf,
                "kolmogorov_smirnov_p": self.kolmogorov_smirnov,
                "atc": self.atc,
                "alpha": self.alpha,
                "ok": int(self.ok),
            },
        )

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Expected coverage against credibility, with its bootstrap band and the diagonal."""
        from ..figures import COLOURS
        from .plots import axes, band, finish

        ax = axes(ax, (4.4, 4.2))
        n = len(self.replicates)
        band(ax, n, self.replicates.most, diagonal=True)
        ax.fill_between(self.credibility, self.low, self.high, color=COLOURS[0], alpha=0.25, lw=0)
        label = "joint posterior, 95 % by bootstrap"
        ax.plot(self.credibility, self.expected_coverage, color=COLOURS[0], lw=1.6, label=label)
        ax.set_ylim(0.0, 1.0)
        ax.set_aspect("equal")
        ax.set_xlabel("credibility")
        ax.set_ylabel("expected coverage")
        return finish(ax, n, loc="upper left")


def tarp(made: Replicates, *, alpha: float = 0.01) -> Tarp:
    """Tests of accuracy with random points (Lemos et al. 2023).

    Each replicate gets a random point; the region of credibility c is the ball around it that
    holds a share c of the draws. One test of the joint posterior in any dimension: it finds
    draws that are too narrow, too wide or moved, but hardly a lost dependence between
    parameters, since balls around points in all directions average it out; for that let the
    pipeline give its log density to `sbc`. Points are uniform over the prior's quantiles, in
    which distances are measured too, so no parameter's scale counts.

    Args:
        made: What `replicates` returned.
        alpha: False alarms of `ok`.

    Raises:
        ValueError: `made` is something else, or none finished.
    """
    _check_arguments(made, alpha)
    truth, draws = _distances(made, made.truth[:, None]), _distances(made, made.draws)
    u = quantiles(truth[:, 0], draws, made.random("tarp"))
    ranks = to_ranks(u, made.most)
    counts = np.bincount(ranks, minlength=made.most + 1)
    rng = np.random.default_rng([made.seed, len(made)])
    resampled = rng.multinomial(len(made), counts / len(made), size=BOOTSTRAPS)
    tail = (1 - BOOTSTRAP_CONFIDENCE) / 2
    low, high = np.quantile(_curve(resampled), [tail, 1 - tail], axis=0)
    return Tarp(
        replicates=made,
        credibility=np.linspace(0.0, 1.0, made.most + 2),
        expected_coverage=_curve(counts),
        low=low,
        high=high,
        ranks=ranks,
        ecdf=p_value(ranks, made.most),
        kolmogorov_smirnov=float(stats.kstest(u, "uniform").pvalue),
        alpha=alpha,
    )


def _distances(made: Replicates, rows: np.ndarray) -> np.ndarray:
    """Distance of rows [R, m, d] from each replicate's random point, [R, m]; NaN stays NaN."""
    flat = rows.reshape(-1, rows.shape[-1])
    missing = np.any(np.isnan(flat), axis=-1)
    full = np.where(missing[:, None], flat[0], flat)  # any numbers, so that shapes stay the same
    u = made.prior.to_unit(made.prior.to_dict(full))
    u[missing] = np.nan
    points = made.random("random points", len(made.prior))
    return np.linalg.norm(u.reshape(rows.shape) - points[:, None], axis=-1)


def _curve(counts: np.ndarray) -> np.ndarray:
    """Counts of ranks [..., L + 1] -> share of ranks below 0, 1, .., L + 1: [..., L + 2]."""
    below = np.cumsum(counts, axis=-1)
    zero = np.zeros_like(below[..., :1])
    return np.concatenate([zero, below], axis=-1) / below[..., -1:]
