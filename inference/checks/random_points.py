"""Tests of accuracy with random points: coverage of the posterior as a whole."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .._lazy import stats, xr
from . import bands
from .finished_replicates import Judged, Replicates, check_judged, table
from .ranks import quantiles, to_ranks

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BOOTSTRAPS = 1000
CONFIDENCE = 0.95  # of the bootstrap band


@dataclass(frozen=True, eq=False)
class Tarp(Judged):
    """Expected coverage probability against credibility.

    Attributes:
        replicates: What was tested.
        credibility: 0 to 1, [L + 2].
        expected_coverage: Share of truths within the region of each credibility, [L + 2].
        low, high: Pointwise 95 % bootstrap band of it, over replicates.
        ranks: Of the truths by distance to the random points, 0..L, [R].
        ecdf: Exact p-value of the ranks' ECDF leaving its simultaneous band.
        kolmogorov_smirnov: p-value of the same ranks, randomised to be continuous.
        alpha: False alarms of `ok` when all is right.
    """

    replicates: Replicates
    credibility: np.ndarray
    expected_coverage: np.ndarray
    low: np.ndarray
    high: np.ndarray
    ranks: np.ndarray
    ecdf: float
    kolmogorov_smirnov: float
    alpha: float

    @property
    def atc(self) -> float:
        """Area between curve and diagonal above credibility 1/2; < 0: draws too narrow."""
        upper = self.credibility >= 0.5
        excess = (self.expected_coverage - self.credibility)[upper]
        return float(np.trapezoid(excess, self.credibility[upper]))

    @property
    def warnings(self) -> list[str]:
        """Warnings about the pipeline."""
        said = self.replicates.warnings
        p = min(self.ecdf, self.kolmogorov_smirnov)
        if p < self.alpha / 2:
            said = [
                *said,
                f"the joint posterior does not cover as it says (p = {p:.1g}, area to the "
                f"diagonal {self.atc:+.3f}; negative: draws too narrow, positive: too wide)",
            ]
        return said

    def __str__(self) -> str:
        row = [f"{self.ecdf:.3g}", f"{self.kolmogorov_smirnov:.3g}", f"{self.atc:+.3f}"]
        heading = f"Tests of accuracy with random points: {self.replicates}"
        columns = ["", "p ECDF", "p Kolmogorov-Smirnov", "area to diagonal"]
        return table(heading, columns, [["joint posterior", *row]], self.warnings)

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
    check_judged(made, alpha)
    truth, draws = _distances(made, made.truth[:, None]), _distances(made, made.draws)
    u = quantiles(truth[:, 0], draws, made.random("tarp"))
    ranks = to_ranks(u, made.most)
    counts = np.bincount(ranks, minlength=made.most + 1)
    rng = np.random.default_rng([made.seed, len(made)])
    resampled = rng.multinomial(len(made), counts / len(made), size=BOOTSTRAPS)
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(_curve(resampled), [tail, 1 - tail], axis=0)
    return Tarp(
        replicates=made,
        credibility=np.linspace(0.0, 1.0, made.most + 2),
        expected_coverage=_curve(counts),
        low=low,
        high=high,
        ranks=ranks,
        ecdf=bands.p_value(ranks, made.most),
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
