import math
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pyarrow.parquet as pq
import pytest
from picture_samples import (
    BROKEN,
    BlueTells,
    behaviour,
    coded,
    gesture,
    label_gestures,
    picture,
    picture_messages,
    stamp_ns,
    write_pictures,
)
from replay_samples import OPERATOR, NearestAhead, label, write, write_drive

from sdt_tools.errors import LabelError, RecordingError, UsageError
from sdt_tools.frames import CameraImage, Gesture
from sdt_tools.replay.picture_features import picture_measures
from sdt_tools.replay.predictions import PICTURE_SCHEMA, scan_predictions
from sdt_tools.replay.replay import ReplayConfig, ReplaySummary, replay


@pytest.fixture
def taken(tmp_path: Path) -> Path:
    path = write_pictures(tmp_path / "recordings", "gestures_0", light="dim", surroundings="garage", mask="yes")
    label_gestures(path, tmp_path / "labels")
    return path


def replayed(path: Path, tmp_path: Path, model: BlueTells | None = None, **options: object) -> pl.DataFrame:
    out = tmp_path / "predictions.parquet"
    replay(model or BlueTells(), [path], tmp_path / "labels", out, ReplayConfig(**options))
    return scan_predictions([out]).collect()


def summary_of(path: Path, tmp_path: Path) -> ReplaySummary:
    return replay(BlueTells(), [path], tmp_path / "labels", tmp_path / "p.parquet")


def test_every_picture_is_answered_and_judged_by_its_gesture(taken: Path, tmp_path: Path) -> None:
    rows = replayed(taken, tmp_path, BlueTells(blind_from=20), batch=7)
    assert rows.schema == pl.Schema(PICTURE_SCHEMA)
    assert rows["stamp_ns"].to_list() == [stamp_ns(n) for n in range(30)]
    assert rows["label"].to_list() == rows["gesture"].to_list() == [gesture(n).label for n in range(30)]
    wrong = [gesture(n) is Gesture.DISABLE and n >= 20 for n in range(30)]
    assert rows["loss_01"].to_list() == wrong
    losses = [math.log(math.exp(2) + 2) - (0 if missed else 2) for missed in wrong]
    np.testing.assert_allclose(rows["loss_ce"].to_numpy(), losses, rtol=1e-6)
    assert (rows["latency_us"] > 0).all()


def test_the_place_in_feature_space_is_kept_in_half_precision(taken: Path, tmp_path: Path) -> None:
    rows = replayed(taken, tmp_path)
    _, features = BlueTells().answer(np.stack([BlueTells().pixels(picture(n)) for n in range(30)]))
    assert rows["features"].dtype == pl.List(pl.Float16)
    np.testing.assert_array_equal(np.array(rows["features"].to_list()), features.astype(np.float16))


def test_the_recording_tells_operator_arms_turn_and_light(taken: Path, tmp_path: Path) -> None:
    rows = replayed(taken, tmp_path)
    np.testing.assert_allclose(rows["turn_radps"].to_numpy(), 0.5, atol=1e-5)
    back_rad = math.pi - abs(math.atan2(OPERATOR.y_m, OPERATOR.x_m))  # he looks along x, the robot is behind him
    np.testing.assert_allclose(rows["operator_turned_rad"].to_numpy(), back_rad, atol=1e-6)
    assert rows["behaviour"].to_list() == [behaviour(n) or "none" for n in range(30)]
    assert rows["arms_changed_s"].to_list()[:7] == pytest.approx([0.6, 0.4, 0.2, 0.0, 0.2, 0.2, 0.0])
    assert rows.select("light", "surroundings", "mask").unique().rows() == [("dim", "garage", True)]


def test_what_a_picture_measures_is_that_of_its_grey() -> None:
    board = np.kron(np.indices((6, 8)).sum(axis=0) % 2, np.ones((80, 80))).astype(np.uint8) * 200 + 50
    sharp = np.repeat(board[..., None], 3, axis=2)
    brightness, contrast, blown, sharpness = picture_measures(sharp)
    assert (brightness, contrast, blown) == pytest.approx((150.0, 100.0, 0.5))
    blurred = picture_measures(cv2.GaussianBlur(sharp, (0, 0), 6.0))[3]
    larger = picture_measures(cv2.resize(sharp, (1280, 960), interpolation=cv2.INTER_NEAREST))[3]
    assert blurred < 0.3 * sharpness
    assert larger == pytest.approx(sharpness, rel=0.01)


def test_pictures_that_no_decoder_reads_are_counted_named_and_passed_over(tmp_path: Path) -> None:
    path = write_pictures(tmp_path, "damaged", broken=True)
    label_gestures(path, tmp_path / "labels")
    summary = summary_of(path, tmp_path)
    (one,) = summary.unreadable
    assert (one.recording, one.stamps_ns) == ("damaged", tuple(stamp_ns(n) for n in BROKEN))
    assert (summary.frames, summary.labelled, summary.labels_without_frame) == (27, 27, 0)


def test_grey_and_oddly_sized_pictures_are_answered(tmp_path: Path) -> None:
    odd = [
        cv2.cvtColor(picture(0), cv2.COLOR_BGR2GRAY),
        picture(1, size=(333, 7)),
        picture(2, size=(1, 1)),
        np.dstack([picture(4), picture(4)[..., :1]]),
        picture(5).astype(np.uint16) * 256,
    ]
    content = [CameraImage(stamp_ns(n), coded(image), "png") for n, image in enumerate(odd)]
    out = tmp_path / "p.parquet"
    summary = replay(BlueTells(), [write(tmp_path / "odd.mcap", content)], None, out)
    assert (summary.frames, summary.unreadable) == (5, ())
    assert scan_predictions([out]).collect()["predicted"].to_list() == ["idle", "idle", "idle", "enable", "enable"]


def test_without_a_camera_one_line_says_so(tmp_path: Path) -> None:
    silent = write_drive(tmp_path, "silent", scans=10)
    with pytest.raises(RecordingError, match=r"silent\.mcap: has no pictures on /camera/image to replay"):
        replay(BlueTells(), [silent], None, tmp_path / "p.parquet")
    content = [CameraImage(stamp_ns(n), b"rubbish") for n in range(4)]
    with pytest.raises(RecordingError, match=r"none of its 4 pictures on /camera/image can be decoded"):
        replay(BlueTells(), [write(tmp_path / "rubbish.mcap", content)], None, tmp_path / "p.parquet")


def test_motions_are_no_labels_of_pictures(tmp_path: Path) -> None:
    drive = write_drive(tmp_path, "drive", scans=10)
    label(drive, tmp_path / "labels")
    with pytest.raises(LabelError, match=r"as in drive\.gesture\.csv"):
        replay(BlueTells(), [drive], tmp_path / "labels", tmp_path / "p.parquet")


def test_only_labelled_pictures_when_asked(taken: Path, tmp_path: Path) -> None:
    journal = tmp_path / "labels" / "gestures_0.gesture.csv"
    journal.write_text("\n".join(journal.read_text().splitlines()[:11]) + "\n")
    assert len(replayed(taken, tmp_path, frames="labelled")) == 10


def test_a_real_robot_knows_less(tmp_path: Path) -> None:
    content = [message for message in picture_messages(12) if isinstance(message, CameraImage)]
    out = tmp_path / "p.parquet"
    replay(BlueTells(), [write(tmp_path / "bare.mcap", content)], None, out)
    rows = scan_predictions([out]).collect()
    unknown = {name for name in rows.columns if rows[name].null_count() == 12}
    assert {"gesture", "behaviour", "arms_changed_s", "operator_turned_rad", "turn_radps", "mask", "mode"} <= unknown
    assert not {"brightness", "sharpness", "features", "predicted"} & unknown


def test_the_file_names_its_classes_and_answers_of_both_kinds_are_not_mixed(taken: Path, tmp_path: Path) -> None:
    replayed(taken, tmp_path)
    metadata = pq.ParquetFile(tmp_path / "predictions.parquet").schema_arrow.metadata
    assert metadata[b"sdt.classes"] == b"idle,enable,disable"
    replay(NearestAhead(), [write_drive(tmp_path, "drive", scans=10)], None, tmp_path / "scans.parquet")
    with pytest.raises(UsageError, match=r"predictions\.parquet: holds answers to pictures, but .* to scans"):
        scan_predictions([tmp_path / "scans.parquet", tmp_path / "predictions.parquet"])
