"""Names of the files of each view."""

from ..rig import View


def frames_file(view: View) -> str:
    """Name of the table of a view's frames."""
    return f"frames_{view}.csv"


def video_file(view: View) -> str:
    """Name of a view's video."""
    return f"{view}.mkv"


def truth_file(view: View) -> str:
    """Name of the table of what a view's rendered frames truly showed."""
    return f"truth_{view}.csv"
