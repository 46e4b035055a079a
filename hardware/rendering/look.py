"""How a rendered picture looks."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Look:
    """How the picture looks; grey levels are 0 to 255.

    Attributes:
        background: Mean grey level behind everything.
        clutter: Standard deviation of the background's smooth texture.
        stick, liquid, gripper, marker, glass: Grey levels.
        exposure: Time over which a moving thing is smeared [s].
        defocus: Standard deviation of the lens's blur [px].
        read_noise: Standard deviation of the noise in the dark.
        shot_noise: Variance per grey level.
    """

    background: float = 190.0
    clutter: float = 6.0
    stick: float = 45.0
    liquid: float = 150.0
    gripper: float = 60.0
    marker: float = 235.0
    glass: float = 120.0
    exposure: float = 0.008
    defocus: float = 0.8
    read_noise: float = 2.0
    shot_noise: float = 0.05


BRIGHT_STICK = Look(background=50.0, stick=210.0, liquid=90.0, gripper=30.0)
