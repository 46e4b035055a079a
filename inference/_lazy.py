"""SciPy's distributions, loaded on first use: importing them takes as long as importing NumPyro."""

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from scipy import stats as stats
else:
    stats = lazy_loader.load("scipy.stats", suppress_warning=True)
