"""A real robot's drive: nothing but scans, with the codes that the real sensor gives."""

import gzip
import os
from pathlib import Path

import numpy as np
import pytest
from view_samples import rows

from sdt_tools.recording.exchange.lidar_csv import import_lidar_csv
from sdt_tools.view.log import write_rrd

DATA = os.environ.get("SDT_DATA")


@pytest.mark.skipif(not DATA, reason="SDT_DATA does not name the folder of the real drives")
def test_a_real_drive_is_drawn_point_by_point(tmp_path: Path) -> None:
    drive = Path(str(DATA)) / "p3at_lms1xx" / "trace_0002.csv.gz"
    import_lidar_csv(drive, tmp_path / "drive.mcap", hz=25.0)
    summary = write_rrd(tmp_path / "drive.mcap", tmp_path / "drive.rrd")
    with gzip.open(drive) as stream:
        ranges_m = np.loadtxt(stream, delimiter=",")[:, 3:544]
    assert summary.scans_shown == len(ranges_m)
    angles = np.deg2rad(np.arange(-135.0, 135.5, 0.5))
    found = rows(tmp_path / "drive.rrd", "scan/points", "Points2D:positions")
    ticks = rows(tmp_path / "drive.rrd", "scan/codes", "Points2D:positions")
    assert sum(len(codes) for _, _, codes in ticks) == (ranges_m < 0.005).sum() > 100
    for row in (0, len(ranges_m) // 2, len(ranges_m) - 1):
        valid = (ranges_m[row] >= 0.005) & (ranges_m[row] < 20.0)
        x, y = (ranges_m[row] * f(angles) for f in (np.cos, np.sin))
        assert np.allclose(np.array(found[row][2]), np.column_stack([-y, -x])[valid], atol=1e-5)
