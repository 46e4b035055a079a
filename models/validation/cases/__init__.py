"""One module a case; see `bolfi_liquids.models.validation`."""
