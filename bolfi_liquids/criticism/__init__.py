"""Find the effect that the simulator lacks."""
