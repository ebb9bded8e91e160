import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import Viewed
from rerun.chunk import RrdReader
from view_samples import (
    AHEAD_M,
    LEFT_M,
    RIGHT_M,
    SCANS,
    START_NS,
    entities_of,
    jpeg,
    predictions,
    room_ranges_m,
    rows,
    scan_ns,
    write_recording,
)

from sdt_tools.errors import OutputExistsError, RecordingError, UsageError
from sdt_tools.frames import LIDAR_AHEAD_M, CameraImage, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter
from sdt_tools.view.log import write_rrd
from sdt_tools.view.palette import STATUSES, packed

POINTS, COLORS, STRIPS = "Points2D:positions", "Points2D:colors", "LineStrips2D:strips"


def test_every_scan_lies_at_its_stamp_to_the_nanosecond(viewed: Viewed) -> None:
    found = rows(viewed.rrd, "scan/points", POINTS)
    assert [(stamp, frame) for stamp, frame, _ in found] == [(scan_ns(number), number) for number in range(SCANS)]


def test_the_room_is_drawn_with_ahead_up_and_left_left(viewed: Viewed) -> None:
    points = np.array(rows(viewed.rrd, "scan/points", POINTS)[0][2])
    assert points[:, 1].min() == pytest.approx(-AHEAD_M, abs=1e-5)
    assert points[:, 0].min() == pytest.approx(-LEFT_M, abs=1e-5)
    assert points[:, 0].max() == pytest.approx(RIGHT_M, abs=1e-5)


def test_codes_are_ticks_at_the_rim_and_full_range_is_nothing(viewed: Viewed) -> None:
    ranges = room_ranges_m()
    ticks = np.array(rows(viewed.rrd, "scan/codes", POINTS)[0][2])
    points = rows(viewed.rrd, "scan/points", POINTS)[0][2]
    assert len(ticks) == (ranges < 0.005).sum() == 10
    assert len(points) == ((ranges >= 0.005) & (ranges < 20.0)).sum()
    assert np.ptp(np.hypot(*ticks.T)) == pytest.approx(0.0, abs=1e-5)
    assert (ticks[:, 0] > 0).all()  # ray 0 is at the right
    assert (ticks[:, 1] > 0).all()  # and behind


def test_scans_have_the_colour_of_the_first_models_tags(viewed: Viewed) -> None:
    colors = [color for _, _, (color,) in rows(viewed.rrd, "scan/points", COLORS)]
    correct, transient = packed([STATUSES["correct"], STATUSES["transient"]]).tolist()
    assert colors == [transient if 60 <= number < 75 else correct for number in range(SCANS)]


def test_the_operator_stands_ahead_of_the_lidar_and_faces_it(viewed: Viewed) -> None:
    stamp, _, (body, nose) = rows(viewed.rrd, "scan/operator", STRIPS)[0]
    assert stamp == START_NS
    assert np.mean(body[:-1], axis=0) == pytest.approx([0.0, -1.5], abs=1e-5)
    assert np.hypot(*(np.array(body) - [0.0, -1.5]).T) == pytest.approx(0.22, abs=1e-5)
    assert nose[1][1] - nose[0][1] == pytest.approx(0.13, abs=1e-5)


def test_the_map_shows_the_robot_where_odometry_puts_it(viewed: Viewed) -> None:
    outline, _ = rows(viewed.rrd, "map/robot", STRIPS)[0][2]
    assert np.mean(outline[:-1], axis=0) == pytest.approx([-2.0, -1.0], abs=1e-5)
    walls = np.array(rows(viewed.rrd, "map/surroundings", POINTS, static=True)[0][2])
    assert walls[:, 0].min() == pytest.approx(-(2.0 + LIDAR_AHEAD_M + AHEAD_M), abs=1e-5)  # the robot faces left in it


def test_images_are_kept_as_they_were_recorded(viewed: Viewed) -> None:
    found = rows(viewed.rrd, "camera/image", "EncodedImage:blob")
    assert [stamp for stamp, _, _ in found] == [scan_ns(number) + 1 for number in range(0, SCANS, 5)]
    assert bytes(found[7][2][0]) == jpeg()


def test_lanes_tell_each_change_once(viewed: Viewed) -> None:
    def lane(entity: str) -> list[tuple[int, str]]:
        return [
            ((stamp - START_NS) // 1_000_000, state)
            for stamp, _, (state,) in rows(viewed.rrd, entity, "StateChange:state")
        ]

    assert lane("label") == [(0, "stay"), (1000, "forward"), (2150, "")]
    assert lane("model/follow-0/predicted") == [
        (0, "stay"),
        (1000, "forward"),
        (1200, "backward"),
        (1420, "forward"),
        (2030, ""),
    ]
    assert lane("model/follow-0/tag") == [(0, "correct"), (1200, "transient"), (1500, "correct"), (2150, "")]
    assert lane("model/follow-3/tag") == [(0, "correct"), (2150, "")]
    assert lane("robot/command") == [(0, "stay"), (1000, "forward"), (2150, "")]
    assert lane("robot/mode") == [(0, "active"), (2150, "")]
    assert lane("operator/gesture") == [(0, "enable"), (1000, "idle"), (4400, "")]


def test_losses_of_all_models_lie_on_one_timeline(viewed: Viewed) -> None:
    first = rows(viewed.rrd, "loss/follow-0", "Scalars:scalars")
    second = rows(viewed.rrd, "loss/follow-3", "Scalars:scalars")
    assert [row[:2] for row in first] == [row[:2] for row in second]
    assert [value for _, _, (value,) in first] == [2.5 if 60 <= 5 * k <= 70 else 0.25 for k in range(20)]


def test_curves_hold_what_the_scan_says(viewed: Viewed) -> None:
    front = rows(viewed.rrd, "sensor/front_range_m", "Scalars:scalars")[0][2]
    share = rows(viewed.rrd, "sensor/codes_percent", "Scalars:scalars")[0][2]
    assert front == pytest.approx([LEFT_M / np.sin(np.deg2rad(59.5))])
    assert share == pytest.approx([1000.0 / 541])


def test_the_log_holds_marks_and_errors(viewed: Viewed) -> None:
    assert rows(viewed.rrd, "log/session", "TextLog:text") == [(START_NS, 0, ["a mark"])]
    assert rows(viewed.rrd, "log/session", "TextLog:level")[0][2] == ["WARN"]
    told = rows(viewed.rrd, "log/model/follow-0", "TextLog:text")
    assert told == [(scan_ns(60), 60, ["follow-0 transient: says backward, label forward (3 frames)"])]


def test_arrows_change_with_the_prediction(viewed: Viewed) -> None:
    found = rows(viewed.rrd, "scan/motion/model/follow-0", STRIPS)
    assert [frame for _, frame, _ in found] == [0, 50, 60, 71, 99]
    backward = found[2][2][0]
    assert backward[-1][1] > backward[0][1]  # down on the screen
    assert found[4][2] == []


def test_a_recording_without_camera_truth_or_predictions_is_drawn_as_far_as_it_goes(bare: Viewed) -> None:
    entities = entities_of(bare.rrd)
    assert "/scan/points" in entities
    assert not any(name.startswith(("/camera/image", "/map/robot", "/model")) for name in entities)
    assert (bare.summary.images, bare.summary.models) == (0, ())


def test_images_alone_are_shown_too(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "film.mcap", SourceInfo("robot"), "") as writer:
        writer.write(Received(START_NS, CameraImage(START_NS, jpeg())))
    summary = write_rrd(tmp_path / "film.mcap", tmp_path / "film.rrd")
    assert (summary.scans, summary.images) == (0, 1)
    assert [row[:2] for row in rows(tmp_path / "film.rrd", "camera/image", "EncodedImage:blob")] == [(START_NS, 0)]


def test_the_layout_is_inside(viewed: Viewed) -> None:
    reader = RrdReader(viewed.rrd)
    (store,) = reader.recordings()
    assert (store.application_id, store.recording_id) == ("sdt room", f"{viewed.recording_id}/room")
    assert len(reader.blueprints()) == 1


def test_the_summary_counts(viewed: Viewed) -> None:
    summary = viewed.summary
    assert (summary.scans, summary.scans_shown, summary.images) == (SCANS, SCANS, 20)
    assert summary.models == ("follow-0", "follow-3")
    assert not summary.truncated


def test_every_thins_scans_but_not_curves(viewed: Viewed, tmp_path: Path) -> None:
    out = tmp_path / "thin.rrd"
    assert write_rrd(viewed.recording, out, every=7).scans_shown == 15
    assert [frame for _, frame, _ in rows(out, "scan/points", POINTS)] == list(range(0, SCANS, 7))
    assert len(rows(out, "sensor/front_range_m", "Scalars:scalars")) == SCANS


def test_a_recording_that_was_cut_off_is_shown_as_far_as_it_goes(viewed: Viewed, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(viewed.recording.read_bytes()[:-2000])
    summary = write_rrd(cut, tmp_path / "cut.rrd")
    assert summary.truncated
    assert summary.scans > 0


def test_nothing_is_written_over(viewed: Viewed) -> None:
    before = viewed.rrd.read_bytes()
    with pytest.raises(OutputExistsError):
        write_rrd(viewed.recording, viewed.rrd)
    assert viewed.rrd.read_bytes() == before


@pytest.mark.parametrize("wrong", ["other recording", "every", "no file"])
def test_a_refusal_leaves_nothing_behind(wrong: str, tmp_path: Path) -> None:
    recording = tmp_path / "room.mcap"
    write_recording(recording, camera=False)
    folder = tmp_path / "out"
    with pytest.raises((UsageError, RecordingError)):
        write_rrd(
            recording if wrong != "no file" else tmp_path / "missing.mcap",
            folder / "room.rrd",
            predictions=[predictions("another")] if wrong == "other recording" else [],
            every=0 if wrong == "every" else 1,
        )
    assert not folder.exists()


def test_a_full_disk_is_no_success(viewed: Viewed, tmp_path: Path) -> None:
    code = (
        "import resource, signal, sys; from pathlib import Path; from sdt_tools.view.log import write_rrd;"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN); resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000));"
        "write_rrd(Path(sys.argv[1]), Path(sys.argv[2]))"
    )
    command = [sys.executable, "-c", code, str(viewed.recording), str(tmp_path / "full.rrd")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.stderr.splitlines()[-1].startswith("sdt_tools.errors.RunError")
    assert "the disk does not take it (File too large)" in done.stderr.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_run_left_is_no_obstacle(viewed: Viewed, tmp_path: Path) -> None:
    (tmp_path / ".room.rrd.partial").write_text("left behind")
    write_rrd(viewed.recording, tmp_path / "room.rrd", every=50)
    assert [path.name for path in tmp_path.iterdir()] == ["room.rrd"]


def test_a_failure_half_way_leaves_no_partial_file(
    viewed: Viewed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise UsageError("half way")

    monkeypatch.setattr("sdt_tools.view.log.send_images", fail)
    with pytest.raises(UsageError, match="half way"):
        write_rrd(viewed.recording, tmp_path / "room.rrd")
    assert list(tmp_path.iterdir()) == []
