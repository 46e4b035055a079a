"""Makes the tasks importable as `tasks`, as they are for the scripts of this directory."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
