"""Libraries loaded on first use: importing either takes as long as importing NumPyro."""

import sys
from typing import TYPE_CHECKING, Any

import lazy_loader

if TYPE_CHECKING:
    import xarray as xr
    from scipy import stats as stats
else:
    stats = lazy_loader.load("scipy.stats", suppress_warning=True)
    xr = lazy_loader.load("xarray")


def array_stats() -> Any:
    """ArviZ's statistics of arrays; with them come pandas and Matplotlib."""
    from arviz_stats.base import array, stats_utils

    if sys.flags.optimize > 1:  # it would append to docstrings that `python -OO` leaves out
        stats_utils.update_docstring = lambda *_: None
    return array.array_stats
