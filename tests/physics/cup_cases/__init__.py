"""One module a case of the liquid on a grid, in a cup; each defines `CASE`."""
