"""What is known: analytic solutions and published measurements, in NumPy and SciPy alone."""
