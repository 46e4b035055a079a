"""run.toml of earlier versions, read as this version writes it."""

from collections.abc import Mapping
from typing import Any

from ..inputs.prior import table_of_text


def upgraded(record: Mapping[str, Any]) -> dict[str, Any]:
    """A run's record in this version's form.

    Version 0.1 wrote each parameter's prior as a text; other versions write a table.
    """
    settings = record.get("settings", {})
    prior = settings.get("prior")
    if not isinstance(prior, Mapping):
        return dict(record)
    tables = {name: _table(one) for name, one in prior.items()}
    return {**record, "settings": {**settings, "prior": tables}}


def _table(prior: Any) -> Any:
    if not isinstance(prior, str):
        return prior
    try:
        return table_of_text(prior)
    except ValueError:
        return prior  # what cannot be read differs from every prior that is asked
