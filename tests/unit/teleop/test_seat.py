"""``sdt record scene`` with somebody or something beside it."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from sdt_tools.cli import seat
from sdt_tools.cli.app import app
from sdt_tools.config import MotionConfig
from sdt_tools.errors import RunError, UsageError
from sdt_tools.view import viewer
from sdt_tools.view.observer import RerunObserver


def test_what_is_recorded_is_streamed_to_rerun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    urls: list[str] = []

    def to_file(url: str, motions: MotionConfig | None = None) -> RerunObserver:
        urls.append(url)
        return RerunObserver.to_file(tmp_path / f"live{len(urls)}.rrd")

    monkeypatch.setattr(viewer, "open_window", lambda: 1234)
    monkeypatch.setattr(RerunObserver, "to_viewer", to_file)
    call = ["record", "scene", "--no-camera", "--seconds", "0.5", "--viewer"]
    assert CliRunner().invoke(app, [*call, "--out", str(tmp_path / "x.mcap")]).exit_code == 0
    assert CliRunner().invoke(app, [*call, "--session", str(tmp_path / "s")]).exit_code == 0
    assert urls == ["rerun+http://127.0.0.1:1234/proxy"] * 2
    for number in (1, 2):
        assert (tmp_path / f"live{number}.rrd").stat().st_size > 10_000


def test_without_a_display_nothing_is_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> int:
        raise viewer.ViewerError("the viewer's window does not open")

    monkeypatch.setattr(viewer, "open_window", refuse)
    result = CliRunner().invoke(app, ["record", "scene", "--viewer", "--out", str(tmp_path / "x.mcap")])
    assert isinstance(result.exception, RunError)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("driver", "asked", "seated"), [("expert", False, False), ("expert", True, True), ("keyboard", False, True)]
)
def test_who_sits_in_the_cockpit(driver: str, asked: bool, seated: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(seat, "at_a_terminal", lambda: True)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert seat.in_cockpit(driver, asked, gamepad=False, perturb=False) is seated


def test_what_cannot_go_together_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UsageError, match="--gamepad needs --cockpit"):
        seat.in_cockpit("expert", False, gamepad=True, perturb=False)
    with pytest.raises(UsageError, match="leave it out with --driver keyboard"):
        seat.in_cockpit("keyboard", False, gamepad=False, perturb=True)
    monkeypatch.setattr(seat, "at_a_terminal", lambda: False)
    with pytest.raises(UsageError, match="--cockpit needs a terminal"):
        seat.in_cockpit("expert", True, gamepad=False, perturb=False)
