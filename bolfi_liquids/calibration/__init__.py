"""Learn a liquid from its recordings."""
