"""One module a case of a whole stir; each defines `CASE`."""
