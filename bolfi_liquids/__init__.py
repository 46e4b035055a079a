"""Learn a liquid's parameters by stirring it, then pour it without spilling."""

from importlib.metadata import version

import lazy_loader

from .home import ensure_home

ensure_home()
__version__ = version("bolfi-liquids")
# loaded on use: `import bolfi_liquids` must cost neither JAX nor Taichi
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
