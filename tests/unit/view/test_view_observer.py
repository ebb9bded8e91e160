from pathlib import Path

import numpy as np
import pytest
from conftest import Viewed
from view_samples import SCANS, START_NS, messages, rows, scan_ns

from sdt_tools.errors import OutputExistsError
from sdt_tools.protocols import Observer
from sdt_tools.view.observer import RerunObserver


def same(one: list, other: list) -> bool:
    """Equal, numbers within a micrometre: poses are interpolated for a whole recording, and live taken as they come."""
    if one and isinstance(one[0], (list, float)):
        return all(np.allclose(a, b, rtol=0.0, atol=1e-6) for a, b in zip(one, other, strict=True))
    return one == other


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The known drive as seen live."""
    path = tmp_path_factory.mktemp("live") / "live.rrd"
    observer = RerunObserver.to_file(path)
    assert isinstance(observer, Observer)
    for received in messages():
        observer.observe(received)
    observer.close()
    observer.close()
    return path


@pytest.mark.parametrize(
    ("entity", "component"),
    [
        ("scan/points", "Points2D:positions"),
        ("scan/operator", "LineStrips2D:strips"),
        ("camera/image", "EncodedImage:blob"),
        ("sensor/speed_mps", "Scalars:scalars"),
        ("log/session", "TextLog:text"),
    ],
)
def test_what_is_drawn_live_is_what_is_drawn_later(live: Path, viewed: Viewed, entity: str, component: str) -> None:
    later = {stamp: (frame, value) for stamp, frame, value in rows(viewed.rrd, entity, component)}
    shown = rows(live, entity, component)
    assert len(shown) > 0
    for stamp, frame, value in shown:
        assert later[stamp][0] == frame
        assert same(later[stamp][1], value)


def test_an_existing_file_is_left_alone(live: Path) -> None:
    before = live.read_bytes()
    with pytest.raises(OutputExistsError):
        RerunObserver.to_file(live)
    assert live.read_bytes() == before


def test_scans_are_drawn_25_times_a_second(live: Path) -> None:
    shown = rows(live, "scan/points", "Points2D:positions")
    assert [frame for _, frame, _ in shown] == list(range(0, SCANS, 2))


def test_states_are_told_when_they_change(live: Path) -> None:
    def lane(entity: str) -> list[tuple[int, str]]:
        return [(stamp, state) for stamp, _, (state,) in rows(live, entity, "StateChange:state")]

    assert lane("robot/command") == [(START_NS, "stay"), (scan_ns(50), "forward")]
    assert lane("operator/gesture") == [(START_NS, "enable"), (scan_ns(50), "idle")]
    assert lane("robot/mode") == [(START_NS, "active")]
