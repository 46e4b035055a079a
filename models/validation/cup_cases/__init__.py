"""One module a case of the liquid on a grid, in a cup; see `bolfi_liquids.models.validation`."""
