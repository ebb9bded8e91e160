"""Stepping from error to error: which errors, in which order, and what is seen at each."""

import json
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from conftest import Viewed
from typer.testing import CliRunner
from view_samples import AHEAD_M, at_errors, jpeg, predictions, rows, scan_ns, tags

from sdt_tools.cli.app import app, main
from sdt_tools.errors import UsageError
from sdt_tools.view.error_steps import error_steps, errors_elsewhere
from sdt_tools.view.log import write_rrd
from sdt_tools.view.palette import STATUSES, packed


def test_the_errors_of_all_models_come_in_order_of_time() -> None:
    one, other = tags("a", "transient", wrong=range(60, 71)), tags("a", "isolated", "other", range(64, 66))
    steps = error_steps("a", [other, one], {"transient", "isolated"})
    assert [(step.stamp_ns, step.model) for step in steps] == [
        (scan_ns(60), "follow-0"),
        (scan_ns(65), "follow-0"),
        (scan_ns(65), "other"),
        (scan_ns(70), "follow-0"),
    ]


def test_only_the_tags_asked_for_and_only_this_recording() -> None:
    told = [tags("a", "transient"), tags("b", "transient"), tags("a", "isolated", "other")]
    assert {step.model for step in error_steps("a", told, {"transient"})} == {"follow-0"}
    assert error_steps("c", told, {"transient"}) == ()


def test_the_like_is_counted_in_other_recordings() -> None:
    told = pl.concat([tags(name, "transient").with_columns(recording=pl.lit(f"drive_{name}")) for name in "abc"])
    more = tags("c", "transient", "other").with_columns(recording=pl.lit("drive_c"))
    assert list(errors_elsewhere("a", [told, more], {"transient"}).items()) == [("drive_c", 6), ("drive_b", 3)]


def test_at_each_error_everything_stands_as_it_did_then(viewed: Viewed) -> None:
    numbers = list(range(3))
    assert [step.stamp_ns for step in viewed.summary.errors] == [scan_ns(60), scan_ns(65), scan_ns(70)]
    scans = at_errors(viewed.rrd, "scan/points", "Points2D:positions")
    assert [number for number, _ in scans] == numbers
    assert np.array(scans[0][1])[:, 1].min() == pytest.approx(-AHEAD_M, abs=1e-5)
    colors = at_errors(viewed.rrd, "scan/points", "Points2D:colors")
    assert [color for _, (color,) in colors] == packed([STATUSES["transient"]] * 3).tolist()
    assert at_errors(viewed.rrd, "model/follow-0/predicted", "StateChange:state") == [
        (n, ["backward"]) for n in numbers
    ]
    assert at_errors(viewed.rrd, "model/follow-3/predicted", "StateChange:state") == [(n, ["forward"]) for n in numbers]
    assert at_errors(viewed.rrd, "label", "StateChange:state") == [(n, ["forward"]) for n in numbers]
    assert at_errors(viewed.rrd, "loss/follow-0", "Scalars:scalars") == [(n, [2.5]) for n in numbers]
    images = at_errors(viewed.rrd, "camera/image", "EncodedImage:blob")
    assert [number for number, _ in images] == numbers
    assert bytes(images[0][1][0]) == jpeg()


def test_the_arrow_at_an_error_is_the_one_of_its_moment(viewed: Viewed) -> None:
    now = {stamp: strips for stamp, _, strips in rows(viewed.rrd, "scan/motion/model/follow-0", "LineStrips2D:strips")}
    stepped = at_errors(viewed.rrd, "scan/motion/model/follow-0", "LineStrips2D:strips")
    assert stepped[1][1] == now[scan_ns(60)]


def test_the_list_lies_on_all_timelines(viewed: Viewed) -> None:
    listed = rows(viewed.rrd, "errors/list", "TextLog:text")
    assert [(stamp, frame) for stamp, frame, _ in listed] == [(scan_ns(n), n) for n in (60, 65, 70)]
    assert [number for number, _ in at_errors(viewed.rrd, "errors/list", "TextLog:text")] == [0, 1, 2]
    assert listed[0][2][0].split() == ["1.20", "s", "transient:", "?,", "not", "?"]


def test_tags_alone_tell_what_the_model_said(viewed: Viewed, tmp_path: Path) -> None:
    said = predictions(viewed.recording_id).filter(pl.col("label").is_not_null())
    told = tags(viewed.recording_id, "isolated").join(said, on=["recording_id", "model", "stamp_ns"])
    summary = write_rrd(viewed.recording, tmp_path / "x.rrd", tags=[told])
    assert summary.models == ("follow-0",)
    assert [(step.predicted, step.label) for step in summary.errors] == [("backward", "forward")] * 3
    assert rows(tmp_path / "x.rrd", "label", "StateChange:state")[0][2] == ["stay"]


def test_an_unknown_tag_is_named(viewed: Viewed, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="unknown error tag 'transitory'; it is one of systematic, conditional, trans"):
        write_rrd(viewed.recording, tmp_path / "x.rrd", step_tags=["transitory"])
    assert not (tmp_path / "x.rrd").exists()


def analysis(viewed: Viewed, folder: Path) -> Path:
    """A folder as an error analysis leaves it."""
    folder.mkdir()
    inside = pl.col("stamp_ns") >= scan_ns(65)
    told = tags(viewed.recording_id, "transient").with_columns(recording=pl.lit("room"), condition_1=inside)
    other = tags("b", "transient").with_columns(recording=pl.lit("drive_b"), condition_1=pl.lit(True))
    made_from = json.dumps({"conditions": [{"text": "front_range_m < 1"}]})
    pl.concat([told, other]).write_parquet(folder / "tags.parquet", metadata={"sdt.error_tags": made_from})
    return folder


def test_the_command_lists_the_errors(viewed: Viewed, tmp_path: Path) -> None:
    out, errors = tmp_path / "x.rrd", analysis(viewed, tmp_path / "errors")
    call = ["view", str(viewed.recording), "--errors", str(errors), "--tag", "transient", "--out", str(out)]
    document = json.loads(CliRunner().invoke(app, [*call, "--json"], catch_exceptions=False).stdout)
    assert [(step["stamp_ns"], step["tag"]) for step in document["errors"]] == [
        (scan_ns(n), "transient") for n in (60, 65, 70)
    ]
    assert [step["condition"] for step in document["errors"]] == ["", "front_range_m < 1", "front_range_m < 1"]
    assert document["errors_elsewhere"] == {"drive_b": 3}
    out.unlink()
    shown = CliRunner().invoke(app, call, catch_exceptions=False).stderr
    assert str(scan_ns(65)) in shown
    assert "transient errors elsewhere: drive_b (3)" in shown


def test_a_tag_that_no_frame_has_is_said(viewed: Viewed, tmp_path: Path) -> None:
    out, errors = tmp_path / "x.rrd", analysis(viewed, tmp_path / "errors")
    call = ["view", str(viewed.recording), "--errors", str(errors), "--tag", "isolated", "--out", str(out)]
    assert "no isolated errors in this recording" in CliRunner().invoke(app, call, catch_exceptions=False).stderr


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--tag", "transient"], "--tag chooses among the errors of --errors"),
        (["--at", "5"], "--at says where the viewer begins; add --open"),
    ],
)
def test_options_that_do_nothing_are_refused(
    viewed: Viewed,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: list[str],
    said: str,
) -> None:
    monkeypatch.setattr(sys, "argv", ["sdt", "view", str(viewed.recording), *options])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    assert said in capsys.readouterr().err
