"""What is random in the study, beside the phases of the application."""

from enum import Enum


class Phase(Enum):
    """What random numbers are for; its text is part of their seed and must not change."""

    BOOTSTRAP = "bootstrap"
    CAMERA_NOISE = "camera noise"
    EXECUTION = "execution of a chosen pour"
    GEOMETRY = "pours of other cups"
    TRUTHS = "liquids of the study"
    TRUTH_STIRS = "stirs and pours of a liquid of the study"
    UNKNOWING = "draws of the prior"
