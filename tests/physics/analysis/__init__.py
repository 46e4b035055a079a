"""What a simulation's particles and signals say, as pure functions of arrays."""
