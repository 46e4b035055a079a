"""`python -m ur_controller ADDRESS OPTIONS`: one emulated controller, until it is told to end."""

import sys

from .server import main

sys.exit(main())
