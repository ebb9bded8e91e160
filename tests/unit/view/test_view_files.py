import json
from pathlib import Path

import polars as pl
import pytest
from conftest import Viewed
from typer.testing import CliRunner
from view_samples import START_NS, labels, predictions, rows, scan_ns, tags

from sdt_tools.cli.app import app
from sdt_tools.errors import LabelError, UsageError
from sdt_tools.labeling.journal import Journal
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource, journal_path
from sdt_tools.view.files import read_predictions, read_tags, write_rrd_from_files


def write_journal(folder: Path, stem: str, recording_id: str) -> None:
    acts = labels().with_columns(
        pl.lit("tester").alias("labeler"), pl.lit(str(LabelSource.TRUTH)).alias("source"), pl.lit(1).alias("created_ns")
    )
    with Journal(journal_path(folder, stem, LabelKind.MOTION), recording_id) as journal:
        journal.append_table(acts)


def write_predictions(path: Path, recording_id: str) -> None:
    """A whole prediction file: what the view does not read is null."""
    from sdt_tools.replay.predictions import SCHEMA

    known = predictions(recording_id)
    missing = [pl.lit(None, dtype).alias(name) for name, dtype in SCHEMA.items() if name not in known.columns]
    known.with_columns(missing).select(*SCHEMA).write_parquet(path)


def test_journals_predictions_and_an_analysis_come_together(viewed: Viewed, tmp_path: Path) -> None:
    write_journal(tmp_path / "labels", "room", viewed.recording_id)
    write_predictions(tmp_path / "p.parquet", viewed.recording_id)
    (tmp_path / "errors").mkdir()
    tags(viewed.recording_id, "isolated").write_parquet(tmp_path / "errors" / "tags.parquet")
    out = tmp_path / "room.rrd"
    summary = write_rrd_from_files(
        viewed.recording,
        out,
        labels_dir=tmp_path / "labels",
        predictions=[tmp_path / "p.parquet"],
        errors=[tmp_path / "errors"],
    )
    assert summary.models == ("follow-0",)
    states = [state for _, _, (state,) in rows(out, "model/follow-0/tag", "StateChange:state")]
    assert states == ["correct", "isolated", "correct", ""]
    assert rows(out, "label", "StateChange:state")[0] == (START_NS, 0, ["stay"])


def test_a_missing_journal_is_named(viewed: Viewed, tmp_path: Path) -> None:
    with pytest.raises(LabelError, match=r"room\.motion\.csv: no such journal"):
        write_rrd_from_files(viewed.recording, tmp_path / "x.rrd", labels_dir=tmp_path)


def test_wrong_tag_files_are_named(tmp_path: Path) -> None:
    (tmp_path / "text.parquet").write_text("no parquet")
    pl.DataFrame({"recording_id": ["a"], "stamp_ns": [1], "model": ["m"]}).write_parquet(tmp_path / "no_tag.parquet")
    with pytest.raises(UsageError, match=r"missing\.parquet: no such file; name the tags that `sdt errors` made"):
        read_tags(tmp_path / "missing.parquet")
    with pytest.raises(UsageError, match=r"text\.parquet: not a tags file"):
        read_tags(tmp_path / "text.parquet")
    with pytest.raises(UsageError, match=r"no_tag\.parquet: not a tags file: it lacks the column 'tag'"):
        read_tags(tmp_path / "no_tag.parquet")
    with pytest.raises(UsageError, match=r"tags\.parquet: no such file"):
        read_tags(tmp_path)


def test_wrong_prediction_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"missing\.parquet: no such file"):
        read_predictions(tmp_path / "missing.parquet")


def test_the_command_writes_beside_the_recording_and_says_what(viewed: Viewed, tmp_path: Path) -> None:
    recording = tmp_path / "drive.mcap"
    recording.write_bytes(viewed.recording.read_bytes())
    result = CliRunner().invoke(app, ["view", str(recording), "--every", "10", "--json"], catch_exceptions=False)
    document = json.loads(result.stdout)
    assert document["out"] == str(tmp_path / "drive.rrd")
    assert (document["scans"], document["scans_shown"], document["images"]) == (100, 10, 20)
    assert document["size_bytes"] == (tmp_path / "drive.rrd").stat().st_size
    assert [stamp for stamp, _, _ in rows(tmp_path / "drive.rrd", "scan/points", "Points2D:positions")][1] == scan_ns(
        10
    )
