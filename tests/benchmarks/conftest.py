"""Makes the tasks importable as `tasks`, as they are for the scripts of this directory.

Truths, rows and tables of the physics' cases are importable, too, and the study of criticism.
"""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE / "misfit"), str(HERE.parent / "physics")]
