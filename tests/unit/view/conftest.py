from pathlib import Path
from typing import NamedTuple

import pytest
from view_samples import labels, predictions, tags, write_recording

from sdt_tools.view.log import ViewSummary, write_rrd


class Viewed(NamedTuple):
    recording: Path
    recording_id: str
    rrd: Path
    summary: ViewSummary


@pytest.fixture(scope="session")
def viewed(tmp_path_factory: pytest.TempPathFactory) -> Viewed:
    """The known drive with labels and two models, the first one's errors tagged transient."""
    folder = tmp_path_factory.mktemp("viewed")
    recording, rrd = folder / "room.mcap", folder / "room.rrd"
    recording_id = write_recording(recording)
    models = [predictions(recording_id), predictions(recording_id, "follow-3", range(0))]
    summary = write_rrd(recording, rrd, labels=labels(), predictions=models, tags=[tags(recording_id, "transient")])
    return Viewed(recording, recording_id, rrd, summary)


@pytest.fixture(scope="session")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Viewed:
    """The known drive as a robot without camera records it, and nothing else known."""
    folder = tmp_path_factory.mktemp("bare")
    recording, rrd = folder / "bare.mcap", folder / "bare.rrd"
    recording_id = write_recording(recording, camera=False, truth=False)
    return Viewed(recording, recording_id, rrd, write_rrd(recording, rrd))
