"""Data sets of gestures: pictures joined with labels, whatever took them; unreadable ones are named and left out."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest
from labelled_recordings import MS, START_NS, make_labelled

from sdt_tools.dataset.build import DatasetSummary, build_dataset
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.dataset.load import load_dataset, load_gestures
from sdt_tools.errors import DatasetError
from sdt_tools.frames import CameraImage, Received
from sdt_tools.labeling.journal import Journal
from sdt_tools.labeling.vocabulary import LabelKind, journal_path
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter

PERIOD_NS = 200 * MS
CLASSES = LabelKind.GESTURE.classes
CONFIG = DatasetConfig(kind="gesture", val_share=0.3)


def picture(seed: int, number: int) -> bytes:
    image = np.full((48, 64, 3), 20 * (number % 10) + seed, np.uint8)
    return cv2.imencode(".jpg", image)[1].tobytes()


def film(folder: Path, seed: int, count: int = 45, broken: Sequence[int] = (), source: str = "robot") -> Path:
    """A recording of ``count`` pictures at 5 Hz, with labels that change every two seconds; some pictures broken."""
    path = folder / f"film{seed}.mcap"
    with RecordingWriter(path, SourceInfo(source, "", seed), "") as writer:
        for number in range(count):
            data = picture(seed, number)
            data = data[: len(data) // 2] if number in broken else data
            stamp_ns = START_NS + number * PERIOD_NS
            writer.write(Received(stamp_ns, CameraImage(stamp_ns, data)))
    with Recording.open(path) as opened:
        recording_id = opened.recording_id
    rows = [(START_NS + number * PERIOD_NS, CLASSES[(seed + number // 10) % 3]) for number in range(count)]
    table = pl.DataFrame(rows, schema={"stamp_ns": pl.Int64, "label": pl.String}, orient="row")
    extra = {"labeler": "ana", "source": "human"}
    with Journal(journal_path(folder / "labels", path.stem, LabelKind.GESTURE), recording_id) as journal:
        journal.append_table(table.with_columns(created_ns=0, **{name: pl.lit(text) for name, text in extra.items()}))
    return path


def built(folder: Path, paths: Sequence[Path], config: DatasetConfig = CONFIG) -> DatasetSummary:
    return build_dataset(paths, folder / "labels", config, folder / "out")


def test_pictures_come_back_as_they_were_recorded(tmp_path: Path) -> None:
    summary = built(tmp_path, [film(tmp_path, seed) for seed in range(4)])

    dataset = load_gestures(tmp_path / "out")

    assert dataset.classes == CLASSES
    assert (len(dataset.train), len(dataset.val)) == (summary.train_frames, summary.val_frames)
    assert len(set(summary.counts["train"].values())) == 1
    assert summary.train_frames > 20
    for frames in (dataset.train, dataset.val):
        for data, label, stamp_ns, name in zip(
            frames.pictures, frames.labels.tolist(), frames.stamps_ns.tolist(), frames.recordings, strict=True
        ):
            seed, number = int(name.removeprefix("film")), (stamp_ns - START_NS) // PERIOD_NS
            assert data == picture(seed, number)
            assert label == (seed + number // 10) % 3
    assert not set(dataset.train.recordings) & set(dataset.val.recordings)


def test_frames_of_a_recording_are_apart(tmp_path: Path) -> None:
    built(tmp_path, [film(tmp_path, seed) for seed in range(4)])

    train = load_gestures(tmp_path / "out").train

    for name in set(train.recordings):
        stamps_ns = train.stamps_ns[[recording == name for recording in train.recordings]]
        assert np.diff(stamps_ns).min() >= 400 * MS


def test_what_no_decoder_reads_is_left_out_and_named(tmp_path: Path) -> None:
    paths = [film(tmp_path, 0, broken=(3, 17)), *(film(tmp_path, seed) for seed in range(1, 4))]

    summary = built(tmp_path, paths)

    stamps_ns = tuple(START_NS + number * PERIOD_NS for number in (3, 17))
    assert summary.unreadable == {"film0": stamps_ns}
    assert summary.unmatched_labels == 2
    dataset = load_gestures(tmp_path / "out")
    (entry,) = (entry for entry in dataset.manifest["recordings"] if entry["recording"] == "film0")
    assert (entry["pictures"], entry["unreadable_pictures_ns"]) == (43, list(stamps_ns))
    whole = [data.endswith(b"\xff\xd9") for frames in (dataset.train, dataset.val) for data in frames.pictures]
    assert all(whole)


def test_the_same_recordings_give_the_same_hash_and_another_picture_another(tmp_path: Path) -> None:
    hashes = []
    for name, count in (("a", 45), ("b", 45), ("c", 44)):
        folder = tmp_path / name
        folder.mkdir()
        hashes.append(built(folder, [film(folder, seed, count) for seed in range(3)]).hash)

    assert hashes[0] == hashes[1] != hashes[2]


def test_scans_and_pictures_are_not_taken_for_each_other(tmp_path: Path) -> None:
    built(tmp_path, [film(tmp_path, seed) for seed in range(3)])
    scans = tmp_path / "scans"
    scans.mkdir()
    build_dataset([make_labelled(scans, seed) for seed in range(3)], scans / "labels", DatasetConfig(), scans / "out")

    with pytest.raises(DatasetError, match="a data set of gestures, where one of motions is needed"):
        load_dataset(tmp_path / "out")
    with pytest.raises(DatasetError, match="a data set of motions, where one of gestures is needed"):
        load_gestures(scans / "out")
