"""What a kept conclusion was made by."""

ENGINE_VERSION = "3"
"""Raised by a change of what the engine concludes from equal simulations."""
