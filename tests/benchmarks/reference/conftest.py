"""Makes the reference and its script importable, as they are for that script."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
