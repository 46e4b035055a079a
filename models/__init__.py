"""Particle fluid: stirring and pouring scenes. Taichi loads with the first simulation.

Taichi has one state in a process. From the first simulation on it is the simulator's: code of your
own that uses Taichi belongs into another process. What is simulated after a `ti.init` of another's
raises `runtime.ForeignTaichi`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
