"""What is known: exact solutions, published measurements and a Navier-Stokes reference.

In NumPy and SciPy alone.
"""
