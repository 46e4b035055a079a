"""The robot, the cameras and the recording; what they are in a dry run.

Paths are in `motion`, what pictures tell in `vision`. Importing this needs neither OpenCV nor
ur-rtde.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
