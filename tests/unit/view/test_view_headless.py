"""What the eye gets: the viewer itself, without a window, on loopback."""

import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import psutil
import pytest
from conftest import Viewed
from rerun.experimental import ViewerClient
from typer.testing import CliRunner
from view_samples import MAGENTA_BGR, scan_ns

from sdt_tools.cli.app import app
from sdt_tools.labeling.app.desk import Desk, Task
from sdt_tools.labeling.vocabulary import LabelKind
from sdt_tools.view import viewer as viewer_module
from sdt_tools.view.beside import RerunBeside
from sdt_tools.view.observer import RerunObserver
from sdt_tools.view.palette import LABEL, OPERATOR, STATUSES, ZONE, Rgb
from sdt_tools.view.screenshot import screenshot, show
from sdt_tools.view.viewer import ViewerError, headless_viewer

Screen = Callable[[str], np.ndarray]


@pytest.fixture(scope="module")
def viewer() -> Iterator[ViewerClient]:
    try:
        with headless_viewer(1200, 800) as client:
            yield client
    except ViewerError as error:
        if "graphics driver" not in str(error):
            raise
        pytest.skip(str(error))


@pytest.fixture
def screen(viewer: ViewerClient, tmp_path: Path) -> Screen:
    """The picture of the view of that name, in BGR."""

    def picture(name: str) -> np.ndarray:
        (view,) = [view for view in viewer.get_state().views if view.name.startswith(name)]
        pictures: list[np.ndarray] = []
        while len(pictures) < 2 or (pictures[-1] != pictures[-2]).any():  # the first may come before all is drawn
            assert len(pictures) < 12
            viewer.save_screenshot(str(tmp_path / "view.png"), view.view_id)
            pictures.append(np.asarray(cv2.imread(str(tmp_path / "view.png"))))
        return pictures[-1]

    return picture


def where(image: np.ndarray, color: Rgb, tolerance: int = 12) -> np.ndarray:
    """Pixels of about that colour: rows of (x, y), from 0 to 1 across the picture."""
    near = (np.abs(image.astype(int) - np.array(color[::-1])) <= tolerance).all(axis=2)
    y, x = np.nonzero(near)
    return np.column_stack([x / image.shape[1], y / image.shape[0]])


def test_the_layout_gives_each_thing_its_view(viewer: ViewerClient, viewed: Viewed) -> None:
    show(viewer, viewed.rrd, scan_ns(99))
    views = viewer.get_state().views
    assert {(view.name, view.view_class) for view in views} == {
        ("Scan from above (ahead is up)", "2D"),
        ("Key", "2D"),
        ("Camera", "2D"),
        ("Map (odometry)", "2D"),
        ("Labels, predictions, tags", "StateTimeline"),
        ("Loss (cross-entropy)", "TimeSeries"),
        ("Range ahead and speed", "TimeSeries"),
        ("Log", "TextLog"),
        ("This error", "TextDocument"),
        ("Errors (a number leads to it)", "TextLog"),
    }
    assert [report.summary for view in views for report in view.reports] == []


def test_the_scan_is_seen_right_way_up(viewer: ViewerClient, viewed: Viewed, screen: Screen) -> None:
    show(viewer, viewed.rrd, scan_ns(20))
    image = screen("Scan")
    walls = where(image, STATUSES["correct"])
    zone = where(image, ZONE)
    operator = where(image, OPERATOR)
    assert min(len(walls), len(zone), len(operator)) > 50
    lidar_x, lidar_y = zone[:, 0].mean(), zone[:, 1].max()
    low_walls = walls[walls[:, 1] > operator[:, 1].max()]
    left, right = lidar_x - low_walls[:, 0].min(), low_walls[:, 0].max() - lidar_x
    assert right / left == pytest.approx(1.5, rel=0.05)  # the walls stand 2 m to the left and 3 m to the right
    assert walls[:, 1].min() < operator[:, 1].min() < lidar_y  # wall, operator, LiDAR, from far to near


def test_an_error_changes_the_colour_of_the_scan(viewer: ViewerClient, viewed: Viewed, screen: Screen) -> None:
    show(viewer, viewed.rrd, scan_ns(65))
    image = screen("Scan")
    below_the_words = image[image.shape[0] // 4 :]
    assert len(where(below_the_words, STATUSES["transient"])) > 60
    assert len(where(below_the_words, STATUSES["correct"])) == 0
    assert len(where(below_the_words, LABEL)) > 50


def test_a_step_to_an_error_shows_its_scan(viewer: ViewerClient, viewed: Viewed, screen: Screen) -> None:
    show(viewer, viewed.rrd, error=1)
    image = screen("Scan")
    assert len(where(image[image.shape[0] // 4 :], STATUSES["transient"])) > 60
    assert len(where(screen("This error"), (255, 255, 255), tolerance=60)) > 50


def test_the_picture_is_seen(viewer: ViewerClient, viewed: Viewed, screen: Screen) -> None:
    show(viewer, viewed.rrd, scan_ns(65))
    image = screen("Camera")
    shown = where(image, MAGENTA_BGR[::-1])
    assert len(shown) > 0.4 * image.shape[0] * image.shape[1]


def test_without_a_camera_there_is_no_room_for_one(viewer: ViewerClient, bare: Viewed, screen: Screen) -> None:
    show(viewer, bare.rrd, scan_ns(65))
    names = {view.name for view in viewer.get_state().views}
    assert names == {
        "Scan from above (ahead is up)",
        "Key",
        "Labels, predictions, tags",
        "Range ahead and speed",
        "Rays without a distance",
        "Log",
    }
    assert len(where(screen("Scan"), STATUSES["unlabeled"])) > 200


def test_a_session_is_seen_live(viewer: ViewerClient, viewed: Viewed, screen: Screen) -> None:
    from view_samples import messages

    observer = RerunObserver.to_viewer(viewer.url)
    for received in messages():
        observer.observe(received)
    observer.close()
    (live,) = [found for found in viewer.get_state().recordings if "sdt live" in found.store_id]
    viewer.set_location(live.location)
    assert len(where(screen("Scan"), STATUSES["unlabeled"])) > 200
    assert len(where(screen("Camera"), MAGENTA_BGR[::-1])) > 1000


def test_a_screenshot_of_the_whole_viewer_has_the_size_asked_for(
    viewer: ViewerClient, viewed: Viewed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sdt_tools.view.screenshot.NOTICES_S", 0.0)
    screenshot(viewed.rrd, tmp_path / "whole.png", scan_ns(20), width=900, height=600)
    image = np.asarray(cv2.imread(str(tmp_path / "whole.png")))
    assert image.shape == (600, 900, 3)
    assert len(where(image, STATUSES["correct"])) > 50


def test_the_viewer_listens_on_loopback_and_is_gone_afterwards(viewer: ViewerClient) -> None:
    with headless_viewer(400, 300) as other:
        port = int(other.url.removeprefix("rerun+http://127.0.0.1:").removesuffix("/proxy"))
        listening = [c.laddr.ip for c in psutil.net_connections("tcp") if c.laddr.port == port and c.status == "LISTEN"]
        assert listening == ["127.0.0.1"]
    assert not [c for c in psutil.net_connections("tcp") if c.laddr.port == port and c.status == "LISTEN"]


def test_the_viewer_sends_no_usage_data(tmp_path: Path) -> None:
    said = subprocess.run(
        [viewer_module._executable(), "analytics", "config"],
        env=viewer_module._secluded(tmp_path),
        capture_output=True,
        check=True,
    )
    assert json.loads(said.stdout)["analytics_enabled"] is False


def test_without_a_graphics_driver_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "/nonexistent")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nonexistent")
    with (
        pytest.raises(ViewerError, match=r"no graphics driver; install one \(Debian: mesa-vulkan-drivers\)"),
        headless_viewer(),
    ):
        pass


@pytest.mark.slow
def test_what_is_recorded_and_what_is_labelled_is_seen(
    viewer: ViewerClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, screen: Screen
) -> None:
    """``sdt record scene --viewer``, then a frame of that recording as ``sdt label edit --viewer`` shows it."""
    port = int(viewer.url.removeprefix("rerun+http://127.0.0.1:").removesuffix("/proxy"))
    monkeypatch.setattr(viewer_module, "open_window", lambda: port)
    known = {found.store_id for found in viewer.get_state().recordings}

    def look_at_the_new_one() -> None:
        (live,) = [found for found in viewer.get_state().recordings if found.store_id not in known]
        known.add(live.store_id)
        viewer.set_location(live.location)

    path = tmp_path / "drive.mcap"
    call = ["record", "scene", "--realtime", "--viewer", "--seed", "7", "--seconds", "0.6", "--out", str(path)]
    assert CliRunner().invoke(app, call).exit_code == 0
    look_at_the_new_one()
    assert len(where(screen("Scan"), STATUSES["unlabeled"])) > 200

    task = Task(path, LabelKind.MOTION, tmp_path / "labels", "anna")
    beside = RerunBeside(port)
    with Desk(task) as desk:
        stamps_ns = desk.opened.labels.stamps_ns.tolist()
        pictures = []
        for row in (20, 5, 20):
            beside.show(desk.messages_at(stamps_ns[row]), stamps_ns[row])
            if not pictures:
                look_at_the_new_one()
            pictures.append(screen("Scan"))
    beside.close()
    assert len(where(pictures[0], STATUSES["unlabeled"])) > 200
    assert (pictures[0] != pictures[1]).any()
    assert (pictures[0] == pictures[2]).all()
