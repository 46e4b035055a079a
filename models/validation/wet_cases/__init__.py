"""One module a case of the liquid of pours, in a box; see `bolfi_liquids.models.validation`."""
