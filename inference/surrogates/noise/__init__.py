"""Noise that is not the same everywhere: by the simulated mean, and by the parameters."""
