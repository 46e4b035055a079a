"""Tables of truths: what the liquids of a reference are."""

import csv
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

Truth = TypeVar("Truth", bound=BaseModel)


def read_truths[Truth: BaseModel](path: Path, model: type[Truth]) -> list[Truth]:
    """Read a CSV file with a row for each truth; columns that the model lacks are not read.

    Args:
        path: Of the file.
        model: Of a row; an empty cell takes the model's default.

    Raises:
        ValueError: The file holds no row, or a row that the model refuses; the message names file,
            line and column.
    """
    truths = []
    with path.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        for row in reader:
            try:
                truths.append(model.model_validate({k: v for k, v in row.items() if v}))
            except ValidationError as err:
                raise ValueError(f"{path}, line {reader.line_num}: {err}") from err
    if not truths:
        raise ValueError(f"{path} holds no row; write one for each liquid")
    return truths
