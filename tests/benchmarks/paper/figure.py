"""A figure with the numbers behind it."""

from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure
from xarray import Dataset

from bolfi_liquids.drawing import write_figure
from bolfi_liquids.files import write_netcdf


@dataclass(frozen=True, eq=False)
class Drawn:
    """What a figure's function returns.

    Attributes:
        data: Everything that was drawn.
        figure: The picture.
        says: Its numbers, in a few lines.
    """

    data: Dataset
    figure: Figure
    says: str

    def write(self, out: Path, name: str, made_with: str) -> None:
        """NAME.nc, NAME.png and NAME.svg; `made_with` goes into the first."""
        data = self.data.assign_attrs(made_with=made_with, says=self.says)
        write_netcdf(data, out / f"{name}.nc")
        write_figure(self.figure, out, name)
