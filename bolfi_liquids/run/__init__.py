"""The run directory: settings, simulations, recordings, provenance."""
