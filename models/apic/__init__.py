"""The liquid: particles carry it, a staggered grid solves pressure and viscosity."""
