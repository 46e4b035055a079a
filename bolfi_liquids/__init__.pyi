from .calibration.baseline import Baseline as Baseline
from .calibration.baseline import learn_baseline as learn_baseline
from .calibration.calibrate import calibrate as calibrate
from .calibration.result import Calibration as Calibration
from .criticism.criticise import criticise as criticise
from .criticism.result import Criticism as Criticism
from .cut import trim as trim
from .errors import InputError as InputError
from .inputs.open import open_recording as open_recording
from .inputs.pour_table import open_pours as open_pours
from .inputs.recording import Recording as Recording
from .inputs.table_import import import_table as import_table
from .models import Cups as Cups
from .next_stir import NextStir as NextStir
from .next_stir import design_stir as design_stir
from .pouring.choose import choose_pour as choose_pour
from .pouring.known import known as known
from .pouring.result import Pour as Pour
from .reporting.report import report as report
from .robot.pour import execute_pour as execute_pour
from .robot.record import record as record
from .simulation.simulate import simulate_pour as simulate_pour
from .simulation.simulate import simulate_stir as simulate_stir

__version__: str
