"""A chain-binomial epidemic with counted reports, and effects that it may lack.

Each day some of the susceptible are infected and some of the infectious recover, by binomial
draws. A share of the infections is reported; reports are negative binomial counts. Signals are
daily reports, transformed so that their noise has a standard deviation of 1 whatever their number.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpyro.distributions as dist
from bolfi_liquids.inference import criticism
from subject import Columns, Subject, alone

from bolfi_liquids import inference

DAYS = 70
DISPERSION = 200.0  # reports of mean m have the variance m + m^2 / DISPERSION
COPIES = 600  # of the data, from which their covariance is taken

PRIOR = inference.Prior(
    {
        "reproduction": dist.LogUniform(1.4, 3.5),
        "infectious": dist.LogUniform(3.0, 10.0),
        "reported": dist.LogUniform(0.1, 0.6),
    },
    {"infectious": "d"},
)

EXTENSIONS = {
    "delay": criticism.Extension(dist.HalfNormal(3.0), unit="d"),
    "weekend": criticism.Extension(dist.HalfNormal(0.3)),
    "distancing": criticism.Extension(dist.HalfNormal(0.4)),
    "latency": criticism.Extension(dist.HalfNormal(2.0), unit="d"),
    "waning": criticism.Extension(dist.HalfNormal(0.02), unit="1/d"),
    "imported": criticism.Extension(dist.HalfNormal(100.0), unit="1/d"),
    "mixing": criticism.Extension(dist.Normal(0.0, 0.4)),
    "testing": criticism.Extension(dist.Normal(0.0, 0.4)),
}
"""Reports come late; fewer at weekends; contacts fall from day 25 on; infection precedes
infectiousness; immunity is lost; cases arrive; infections go as a power of the susceptible; the
reported share grows."""

OUTSIDE = {
    "holiday": criticism.Extension(dist.HalfNormal(0.3)),
    "backlog": criticism.Extension(dist.HalfNormal(0.4)),
    "variant": criticism.Extension(dist.HalfNormal(0.3)),
    "saturation": criticism.Extension(dist.HalfNormal(0.3)),
}
"""Contacts fall for ten days; reports of four days come on the fifth; a strain spreads faster from
about day 30 on; laboratories cannot count more."""

NEUTRAL = dict.fromkeys((*EXTENSIONS, *OUTSIDE), 0.0)


@dataclass(frozen=True)
class City:
    """An outbreak in a city; `simulate` is what `inference` calls."""

    population: int = 2_000_000
    infected: int = 1500
    weekday: int = 0  # of the first day

    def simulate(self, theta: Columns, seeds: np.ndarray) -> np.ndarray:
        """Transformed reports [b, 70] of outbreaks that differ by chance, their noise left out."""
        generators = [np.random.default_rng([int(seed), 1]) for seed in seeds]

        def draw(n: np.ndarray, p: np.ndarray) -> np.ndarray:
            rows = zip(generators, n.astype(int), p, strict=True)
            return np.array([float(g.binomial(count, chance)) for g, count, chance in rows])

        return stabilised(self._reports(theta, draw))

    def expected(self, theta: Columns) -> np.ndarray:
        """Of an outbreak without chance."""
        return stabilised(self._reports(theta, np.multiply))

    def observe(self, theta: Mapping[str, float], seed: int) -> np.ndarray:
        """Counted reports, transformed [70]."""
        return self._observed(theta, np.array([seed]))[0]

    def covariance(self, theta: Mapping[str, float]) -> np.ndarray:
        """Sample covariance of many outbreaks' [70, 70], and the reports' noise."""
        columns = {name: np.full(COPIES, value) for name, value in theta.items()}
        left = self.simulate(columns, np.arange(COPIES)) - self.expected(alone(theta))
        return left.T @ left / COPIES + np.eye(DAYS)

    def _observed(self, theta: Mapping[str, float], seeds: np.ndarray) -> np.ndarray:
        columns = {name: np.full(len(seeds), value) for name, value in theta.items()}
        mean = counts(self.simulate(columns, seeds))
        rows = [np.random.default_rng([int(s), 2]).gamma(DISPERSION, size=DAYS) for s in seeds]
        rate = mean * np.array(rows) / DISPERSION
        drawn = [
            np.random.default_rng([int(s), 3]).poisson(r) for s, r in zip(seeds, rate, strict=True)
        ]
        return stabilised(np.array(drawn) + 0.375)

    def _reports(self, theta: Columns, draw: Callable) -> np.ndarray:
        """Mean number of reports on each day [b, 70]."""
        size = len(next(iter(theta.values())))
        of = {name: np.full(size, value) for name, value in NEUTRAL.items()}
        of |= {name: np.asarray(column, float) for name, column in theta.items()}
        contact, recovery = (
            of["reproduction"] / of["infectious"],
            -np.expm1(-1.0 / of["infectious"]),
        )
        onset = -np.expm1(-1.0 / np.maximum(of["latency"], 1e-3))
        infectious = np.full(size, float(self.infected))
        susceptible, exposed, daily = self.population - infectious, np.zeros(size), []
        for day in range(DAYS):
            fallen = of["distancing"] * np.clip((day - 25) / 10.0, 0.0, 1.0)
            fallen = fallen + of["holiday"] * (20 <= day < 30)
            spread = 1.0 + of["variant"] / (1.0 + np.exp(-(day - 30) / 3.0))
            left = np.maximum(susceptible, 1.0) / self.population
            force = contact * np.exp(-fallen) * spread * infectious / self.population
            risk = -np.expm1(-force * left ** of["mixing"])
            infections = draw(susceptible, risk)
            recoveries = draw(infectious, recovery)
            immune = np.maximum(self.population - susceptible - exposed - infectious, 0.0)
            lost = draw(immune, -np.expm1(-of["waning"]))
            onsets = draw(exposed + infections, onset)
            susceptible = susceptible - infections + lost
            exposed = exposed + infections - onsets
            infectious = infectious + onsets - recoveries + of["imported"]
            daily.append(infections + of["imported"])
        return self._told(np.stack(daily, 1), of)

    def _told(self, daily: np.ndarray, of: dict[str, np.ndarray]) -> np.ndarray:
        """Reports of daily infections [b, 70]."""
        days = np.arange(DAYS)
        late = days - of["delay"][:, None]
        whole = np.floor(late).astype(int)
        before, after = (np.clip(one, 0, DAYS - 1) for one in (whole, whole + 1))
        rows = np.arange(len(daily))[:, None]
        share = late - whole
        shown = (1.0 - share) * daily[rows, before] + share * daily[rows, after]
        growth = np.exp(of["testing"][:, None] * (days - 20) / 50.0)
        shown = shown * of["reported"][:, None] * growth
        weekend = (days + self.weekday) % 7 >= 5
        shown = shown * np.exp(-of["weekend"][:, None] * weekend)
        shown = shown / (1.0 + of["saturation"][:, None] * shown / 5000.0)
        held = (days >= 26) & (days < 30)
        kept = np.clip(of["backlog"], 0.0, 1.0)[:, None]
        released = np.sum(np.where(held, shown, 0.0), 1, keepdims=True) * kept
        return shown * (1.0 - kept * held) + released * (days == 30)


def stabilised(reports: np.ndarray) -> np.ndarray:
    """Reports so transformed that their noise has a standard deviation of 1 (Anscombe 1948)."""
    return 2.0 * np.sqrt(DISPERSION) * np.arcsinh(np.sqrt(reports / DISPERSION))


def counts(signals: np.ndarray) -> np.ndarray:
    """Reports of transformed ones."""
    return DISPERSION * np.sinh(signals / (2.0 * np.sqrt(DISPERSION))) ** 2


SUBJECT = Subject(
    name="epidemic",
    prior=PRIOR,
    extensions=EXTENSIONS,
    outside=OUTSIDE,
    fitted=City(),
    held_out=City(population=900_000, infected=2500, weekday=3),
    noise=lambda _: criticism.KnownNoise(1.0),
    settings="daily reports y, as 2 sqrt(200) asinh(sqrt((y + 3/8) / 200)); fitted: 2,000,000 "
    "people, 1500 infected at first; held out: 900,000 people, 2500 infected, starting on another "
    "weekday",
)
