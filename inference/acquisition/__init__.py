"""Where to simulate next."""
