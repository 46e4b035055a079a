"""Version of the engine, stored with results."""

ENGINE_VERSION = "11"
"""Raised by a change of what the engine concludes from equal simulations."""
