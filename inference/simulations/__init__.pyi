from .bank import Simulation as Simulation
from .bank import SimulationBank as SimulationBank
from .bank import Simulations as Simulations
from .job import Job as Job
from .job import jobs as jobs
from .runner import Runner as Runner
from .runner import run_missing as run_missing
