from .base import Acquisition as Acquisition
from .base import Surrogate as Surrogate
from .families import DiscrepancyFamily as DiscrepancyFamily
from .families import SignalFamily as SignalFamily
from .squared_difference import squared_difference as squared_difference
from .threshold import Predicted as Predicted
from .threshold import Quantile as Quantile
from .warnings import EmulatorWarning as EmulatorWarning
