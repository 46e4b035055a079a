"""Libraries loaded on first use: importing either takes as long as importing NumPyro."""

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    import xarray as xr
    from scipy import stats as stats
else:
    stats = lazy_loader.load("scipy.stats", suppress_warning=True)
    xr = lazy_loader.load("xarray")
