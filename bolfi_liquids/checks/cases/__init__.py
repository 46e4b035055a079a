"""Validation cases on the application's own data, one module a case.

They are found beside those of `bolfi_liquids.models.validation.cases`, which know no recordings.
"""
