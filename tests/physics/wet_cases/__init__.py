"""One module a case of the liquid of pours, in a box; each defines `CASE`."""
