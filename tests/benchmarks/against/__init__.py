"""The fluid against stirs and pours that another solver made in liquids that are known.

README.md says which files a reference holds. Bars, rows and figures are those of tests/physics.
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "physics"))  # for scripts, too
