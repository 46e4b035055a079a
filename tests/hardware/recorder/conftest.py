import json

import numpy as np
import pytest
from bolfi_liquids.hardware.csv_file import CsvAppender
from bolfi_liquids.hardware.recorder.directory import start_directory
from bolfi_liquids.hardware.recorder.samples import Sample
from bolfi_liquids.hardware.vision.frame import FrameMeasurement
from closed_form_session import COMPLETED, DELAY, HOST, RIG, WAY, frames_of, samples_of


@pytest.fixture
def session(tmp_path):
    """Writes the directory of a session that was as the closed forms say."""

    def write(*, duration=12.0, events=COMPLETED, change=lambda samples, frames: None):
        directory = start_directory(tmp_path / "session", RIG, {"source": "a closed form"})
        rng = np.random.default_rng(1)
        until = duration + 2 * WAY
        samples = samples_of(until, duration)
        frames = {view: frames_of(view, until, duration, rng) for view in DELAY}
        change(samples, frames)
        tables = {"samples": samples} | {f"frames_{v}": rows for v, rows in frames.items()}
        for name, rows in tables.items():
            fields = Sample._fields if name == "samples" else FrameMeasurement._fields
            table = CsvAppender(directory / f"{name}.csv", fields)
            table.append(rows)
            table.close()
        lines = [json.dumps({"host": HOST, **event}) for event in events]
        (directory / "events.jsonl").write_text("\n".join([*lines, ""]))
        return directory

    return write
