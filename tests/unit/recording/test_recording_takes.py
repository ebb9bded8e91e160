"""Sessions: take after take under somebody's controls, resumed, and the last seconds kept."""

import os
import time
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from recording_rig import Forward, HandClock, TapeSource, Wheels
from recording_samples import CONFIG, INFO, PERIOD_NS, T0, image, one_of_each, raw_picture, read_by_mcap, scan

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import Config, MotionConfig, RateConfig
from sdt_tools.errors import RecordingError, RunError
from sdt_tools.frames import (
    CameraCalibration,
    CameraImage,
    FrameTransform,
    LidarScan,
    LogEntry,
    LogLevel,
    Mode,
    MotionClass,
    MotionCommand,
    Received,
    Twist,
)
from sdt_tools.recording.live.control import Control, Wish
from sdt_tools.recording.live.decide import Deciders, DecisionLoop
from sdt_tools.recording.live.encoder import Encode, PictureEncoder, encode_jpeg
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.recording.live.keep_last import KeepLast, Ring
from sdt_tools.recording.live.loop import LiveLoop
from sdt_tools.recording.live.outcome import Ending
from sdt_tools.recording.live.pace import paced
from sdt_tools.recording.live.session_folder import ChangedConfigError, SessionFolder, TakeEntry, config_differences
from sdt_tools.recording.live.take import Tally
from sdt_tools.recording.live.takes import TakeRecorder
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.trash import restore
from sdt_tools.recording.writer import RecordingWriter


@pytest.fixture(autouse=True)
def _no_waiting_for_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a power cut would leave is not asked here, and disks take their time."""
    monkeypatch.setattr(os, "fsync", lambda _descriptor: None)


class Settings(Config):
    scenario: str = "plain"
    rates: RateConfig = RateConfig()


@dataclass
class Fingers:
    """Presses keys when a scan of some number passes."""

    control: Control
    keys: Mapping[int, Wish]
    closed: int = 0

    def observe(self, received: Received) -> None:
        if isinstance(received.message, LidarScan):
            wish = self.keys.get((received.message.stamp_ns - T0) // PERIOD_NS)
            if wish is not None:
                self.control.want(wish)

    def close(self) -> None:
        self.closed += 1


@dataclass
class Session:
    """A tape of scans, pictures, a calibration and a transform, recorded into takes."""

    folder: SessionFolder
    realtime: bool = False
    scans: int = 100
    extra: list[Received] = field(default_factory=list)
    happens: dict[int, BaseException | int] = field(default_factory=dict)
    wheels: Wheels = field(default_factory=Wheels)
    encode: Encode | None = None
    """With it pictures come raw."""

    def run(
        self, keys: Mapping[int, Wish] | None, seconds: float | None = None, keep_last: KeepLast | None = None
    ) -> Ending:
        control = None if keys is None else Control()
        recorder = TakeRecorder(self.folder, RateConfig(), seconds, self.realtime, control, keep_last)
        introduction = [one for one in one_of_each(T0) if isinstance(one.message, CameraCalibration | FrameTransform)]
        pictures = [image(n, 100) if self.encode is None else raw_picture(n) for n in range(self.scans)]
        messages = [*map(scan, range(self.scans)), *pictures]
        messages = [m for m in messages if m.received_ns < T0 + self.scans * PERIOD_NS]
        tape = [Received(T0, m.message) for m in introduction]
        tape += sorted([*messages, *self.extra], key=lambda m: m.received_ns)
        source = TapeSource(tape, self.happens)
        decisions = DecisionLoop(Deciders(Forward()), MotionConfig(), RateConfig(), T0)
        clock = HandClock()
        pace = paced(T0, 50.0, clock if self.realtime else None, clock.sleep)

        def open_writer(path: Path, notes: Mapping[str, str], start_ns: int, realtime: bool) -> RecordingWriter:
            return RecordingWriter(path, INFO, CONFIG, notes=notes, start_ns=start_ns, realtime=realtime)

        def tally() -> Tally:
            return Tally(decisions.decisions, decisions.forced, pace.missed + decisions.missed)

        observers = [Fingers(control, keys)] if control is not None and keys is not None else []
        encoder = PictureEncoder(self.realtime, encode=self.encode or encode_jpeg)
        loop = LiveLoop(source, self.wheels, decisions, pace, observers, recorder, encoder=encoder)
        recorder.begin(T0, open_writer, tally, loop.settle)
        try:
            return loop.run(Interrupt())
        finally:
            loop.close()
            recorder.close()

    def listed(self) -> list[TakeEntry]:
        """As the file on the disk says."""
        table = tomllib.loads((self.folder.folder / "session.toml").read_text())
        return [TakeEntry.model_validate(take) for take in table.get("takes", [])]

    def read(self, name: str) -> list[Received]:
        assert read_by_mcap(self.folder.folder / name)
        with Recording.open(self.folder.folder / name) as recording:
            assert not recording.truncated
            return list(recording.messages())

    def scans_of(self, name: str) -> list[int]:
        return [(m.message.stamp_ns - T0) // PERIOD_NS for m in self.read(name) if isinstance(m.message, LidarScan)]


@pytest.fixture(params=[False, True], ids=["fast", "realtime"])
def session(request: pytest.FixtureRequest, tmp_path: Path) -> Session:
    return Session(SessionFolder.create(tmp_path / "s", Settings(), "the-session"), realtime=request.param)


def texts(messages: list[Received], name: str) -> list[str]:
    return [m.message.text for m in messages if isinstance(m.message, LogEntry) and m.message.name == name]


def about(numbers: list[int], first: int, after: int) -> bool:
    """Whether ``numbers`` are those of ``[first, after)``; a key is heard at a tick, so ends may be one off."""
    return numbers == list(range(numbers[0], numbers[-1] + 1)) and (
        abs(numbers[0] - first) <= 1 and abs(numbers[-1] + 1 - after) <= 1
    )


def test_the_next_take_begins_where_the_last_one_ends_and_nothing_is_between(session: Session) -> None:
    assert session.run({20: Wish.NEXT, 60: Wish.QUIT}) is Ending.STOPPED
    first, second = session.scans_of("take_001.mcap"), session.scans_of("take_002.mcap")
    assert about(first + second, 0, 61)
    assert about(first, 0, 21)
    assert [(take.name, take.ending) for take in session.listed()] == [
        ("take_001.mcap", "stopped"),
        ("take_002.mcap", "stopped"),
    ]


def test_pictures_that_are_still_encoded_belong_to_the_take_they_were_received_in(session: Session) -> None:
    def slow(_image_bgr_u8: np.ndarray) -> bytes:
        time.sleep(0.003)
        return b"jpeg"

    session.encode = slow
    session.run({20: Wish.NEXT, 40: Wish.PAUSE, 50: Wish.RESUME, 60: Wish.QUIT})
    first, second = (session.read(f"take_00{number}.mcap") for number in (1, 2))
    images = [m for m in (*first, *second) if isinstance(m.message, CameraImage)]
    ticks = [(m.received_ns - T0) // PERIOD_NS for m in images]
    stamps = [m.message.stamp_ns for m in images]
    assert stamps == sorted(set(stamps))
    assert not set(ticks) & set(range(42, 50))
    assert set(stamps) >= {T0 + n * 33_333_333 for n in (*range(24), *range(31, 36))}
    (start_ns,) = (m.received_ns for m in second if isinstance(m.message, CameraCalibration))
    assert min(m.received_ns for m in second if isinstance(m.message, CameraImage)) >= start_ns
    last_scan_ns = max(m.received_ns for m in first if isinstance(m.message, LidarScan))
    assert max(m.received_ns for m in first) - last_scan_ns <= PERIOD_NS


def test_a_later_take_begins_with_calibration_and_transforms_received_at_its_start(session: Session) -> None:
    session.run({20: Wish.STOP, 50: Wish.START})
    messages = session.read("take_002.mcap")
    assert {type(m.message) for m in messages[:2]} == {CameraCalibration, FrameTransform}
    assert messages[0].received_ns == messages[1].received_ns
    assert abs(messages[0].received_ns - (T0 + 50 * PERIOD_NS)) <= PERIOD_NS
    assert messages[0].message.stamp_ns == T0
    with Recording.open(session.folder.folder / "take_002.mcap") as recording:
        assert (recording.session["session"], recording.session["take"]) == ("the-session", "take_002")


def test_a_pause_leaves_out_what_passes_is_told_and_is_no_gap(session: Session) -> None:
    session.run({20: Wish.TOGGLE, 60: Wish.TOGGLE})
    scans = session.scans_of("take_001.mcap")
    assert about([n for n in scans if n < 40], 0, 21)
    assert about([n for n in scans if n > 40], 61, 100)
    assert texts(session.read("take_001.mcap"), "pause") == [
        "paused: nothing is recorded until it is resumed",
        "resumed after a pause of 0.800 s",
    ]
    with Recording.open(session.folder.folder / "take_001.mcap") as recording:
        stats = recording.stats
    assert stats["missing./lidar/scan"] == stats["dropped./lidar/scan"] == "0"
    start_ns, end_ns = map(int, stats["pauses_ns"].split("-"))
    assert end_ns - start_ns == 800_000_000
    assert float(stats["seconds"]) == pytest.approx(1.2, abs=0.05)


def test_the_robot_is_driven_while_nothing_is_recorded(session: Session) -> None:
    session.run({0: Wish.STOP})
    assert len(session.wheels.twists) >= 20
    assert session.wheels.twists[-1] == Twist(0.0, 0.0)


def test_a_take_is_discarded_while_it_runs(session: Session) -> None:
    session.run({20: Wish.DISCARD, 40: Wish.START})
    first, second = session.listed()
    assert not (session.folder.folder / first.name).exists()
    assert (session.folder.folder / first.trash / first.name).exists()
    assert (second.ending, second.trash) == ("source", "")
    assert about(session.scans_of("take_002.mcap"), 41, 100)


def test_the_last_take_kept_is_discarded_when_none_runs(session: Session) -> None:
    session.run({20: Wish.NEXT, 40: Wish.STOP, 50: Wish.DISCARD})
    assert [(take.name, bool(take.trash)) for take in session.listed()] == [
        ("take_001.mcap", False),
        ("take_002.mcap", True),
    ]


def begun(path: Path) -> SessionFolder:
    """A session with one take that was kept."""
    folder = SessionFolder.create(path, Settings(), "the-session")
    take = folder.next_path("take")
    take.write_bytes(b"a take")
    folder.started(take, T0)
    folder.saved(take, 1.0, 1)
    return folder


def test_a_relative_folder_has_its_trash_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    folder = begun(Path("recordings/monday"))
    folder.discard(Path("recordings/monday/take_001.mcap"), "", T0)
    (take,) = folder.record.takes
    assert (tmp_path / "recordings/monday" / take.trash / take.name).exists()


def test_a_take_that_is_gone_is_not_the_last_one_kept(tmp_path: Path) -> None:
    folder = begun(tmp_path / "s")
    first = folder.last_kept()
    assert first is not None
    first.unlink()
    assert folder.last_kept() is None


def test_a_take_that_was_restored_is_kept_again_when_the_session_goes_on(tmp_path: Path) -> None:
    folder = begun(tmp_path / "s")
    folder.discard(tmp_path / "s/take_001.mcap", "", T0)
    assert SessionFolder.resume(folder.folder, Settings()).last_kept() is None
    restore(folder.folder, "take_001")
    assert SessionFolder.resume(folder.folder, Settings()).last_kept() == tmp_path / "s/take_001.mcap"


def test_whoever_presses_keys_is_told_what_came_of_it(tmp_path: Path) -> None:
    shown: list[str] = []
    control, signals = Control(), Interrupt()
    recorder = TakeRecorder(begun(tmp_path / "s"), RateConfig(), None, False, control)
    for wish in (Wish.DISCARD, Wish.DISCARD, Wish.QUIT):
        control.want(wish)
    assert not recorder.wait_for_start(signals, lambda: T0, lambda now: shown.append(now.state))
    assert shown == [
        "the source has ended",
        "the source has ended (take_001 discarded)",
        "the source has ended (nothing to discard)",
    ]


def test_marks_are_numbered(session: Session) -> None:
    session.run({20: Wish.MARK, 40: Wish.MARK})
    assert texts(session.read("take_001.mcap"), "mark") == ["mark 1", "mark 2"]


def test_takes_of_a_length_end_by_themselves_and_the_session_goes_on(session: Session) -> None:
    session.run({60: Wish.START}, seconds=0.5)
    assert [(take.ending, take.seconds) for take in session.listed()] == [("time", 0.5), ("time", 0.5)]


def test_a_pause_does_not_shorten_a_take(session: Session) -> None:
    session.run({10: Wish.PAUSE, 30: Wish.RESUME}, seconds=0.5)
    (take,) = session.listed()
    assert (take.ending, take.seconds) == ("time", 0.5)
    assert len(session.scans_of("take_001.mcap")) in (25, 26)


def test_without_controls_a_session_is_one_take(session: Session) -> None:
    assert session.run(None, seconds=0.5) is Ending.TIME
    assert len(session.listed()) == 1


def test_a_source_that_fails_leaves_its_take_whole_and_listed(session: Session) -> None:
    session.happens = {80: ConnectionResetError("the LiDAR hung up")}
    with pytest.raises(RunError, match=r"the scene failed after \d\.\d s \(the LiDAR hung up\)"):
        session.run({})
    (take,) = session.listed()
    assert take.ending == "failed"
    assert texts(session.read(take.name), "sdt")[-1].startswith("the recording stopped: ConnectionResetError")


def test_a_session_goes_on_under_the_same_config_with_new_names(session: Session) -> None:
    session.run({20: Wish.DISCARD})
    again = SessionFolder.resume(session.folder.folder, Settings())
    assert again.record.id == "the-session"
    Session(again, session.realtime).run({})
    assert [take.name for take in session.listed()] == ["take_001.mcap", "take_002.mcap"]


def test_a_take_that_was_never_closed_is_known_when_the_session_is_resumed(tmp_path: Path) -> None:
    session = SessionFolder.create(tmp_path / "s", Settings(), "id")
    session.started(session.next_path("take"), T0)
    assert SessionFolder.resume(tmp_path / "s", Settings()).cut_off == (tmp_path / "s" / "take_001.mcap",)


def test_a_changed_config_is_refused_line_by_line(tmp_path: Path) -> None:
    SessionFolder.create(tmp_path / "s", Settings(), "id")
    with pytest.raises(ChangedConfigError, match=r"another config \(rates\.scan_hz, scenario\); resume it") as refused:
        SessionFolder.resume(tmp_path / "s", Settings(scenario="around_boxes", rates=RateConfig(scan_hz=25.0)))
    assert refused.value.differences == (
        "rates.scan_hz: 50.0 before, 25.0 now",
        'scenario: "plain" before, "around_boxes" now',
    )


def test_a_key_that_was_not_there_before_is_a_difference() -> None:
    assert config_differences({"a": 1}, {"a": 1, "b": {"c": [2]}}) == ("b.c: not set before, [\n    2,\n] now",)


@pytest.mark.parametrize(
    ("prepare", "call", "message"),
    [
        (True, SessionFolder.create, "holds a session already; add --resume"),
        (False, SessionFolder.resume, "no session to resume; leave --resume out"),
    ],
)
def test_a_session_is_neither_begun_twice_nor_resumed_from_nothing(
    tmp_path: Path, prepare: bool, call: Callable[..., SessionFolder], message: str
) -> None:
    if prepare:
        SessionFolder.create(tmp_path / "s", Settings(), "id")
    arguments = (tmp_path / "s", Settings(), "id") if prepare else (tmp_path / "s", Settings())
    with pytest.raises(RecordingError, match=message):
        call(*arguments)


def test_a_ring_holds_the_last_seconds() -> None:
    ring = Ring(1.0)
    for number in range(100):
        ring.add(scan(number))
    assert [(m.message.stamp_ns - T0) // PERIOD_NS for m in ring.messages()] == list(range(50, 100))


def test_a_ring_is_bounded_in_bytes() -> None:
    ring = Ring(1000.0, size_bytes=100_000)
    for number in range(200):
        ring.add(image(number, 10_000))
        assert ring.size_bytes <= 100_000
    assert len(ring.messages()) == 9


def event(number: int, level: LogLevel = LogLevel.ERROR) -> Received:
    stamp_ns = T0 + number * PERIOD_NS
    return Received(stamp_ns, LogEntry(stamp_ns, level, "the base stalls"))


def test_what_led_to_an_error_is_written_out_as_a_recording(session: Session) -> None:
    session.extra = [event(80), event(30, LogLevel.WARNING)]
    session.run({}, keep_last=KeepLast(0.5))
    (entry,) = session.listed()
    assert (entry.name, entry.trigger, entry.ending) == ("event_001.mcap", "error: the base stalls", "saved")
    messages = session.read("event_001.mcap")
    assert {type(m.message) for m in messages[:2]} == {CameraCalibration, FrameTransform}
    assert about(session.scans_of("event_001.mcap"), 56, 81)
    assert 0.4 < (messages[-1].received_ns - messages[0].received_ns) / SECOND_NS <= 0.5
    with Recording.open(session.folder.folder / "event_001.mcap") as recording:
        assert recording.session["trigger"] == "error: the base stalls"
        assert recording.session["keep_last_s"] == "0.5"
        assert recording.config_toml == CONFIG
        assert recording.stats["ending"] == "saved"


def test_a_key_saves_and_events_close_to_each_other_share_the_next_file(session: Session) -> None:
    session.extra = [event(30), event(40)]
    session.run({20: Wish.SAVE}, keep_last=KeepLast(10.0))
    assert [take.trigger for take in session.listed()] == ["a key", "error: the base stalls"]


def test_a_ring_without_controls_saves_what_led_to_a_failure(session: Session) -> None:
    session.happens = {120: ConnectionResetError("the LiDAR hung up")}
    with pytest.raises(RunError):
        session.run(None, seconds=60.0, keep_last=KeepLast(0.5))
    (entry,) = session.listed()
    assert "ConnectionResetError: the LiDAR hung up" in entry.trigger
    assert "the recording stopped" in texts(session.read(entry.name), "sdt")[-1]


def command(number: int, mode: Mode) -> Received:
    stamp_ns = T0 + number * PERIOD_NS
    return Received(stamp_ns, MotionCommand(stamp_ns, MotionClass.STAY, Twist(0.0, 0.0), "policy:a", mode))


def test_a_change_of_mode_is_an_event_and_the_first_mode_is_none() -> None:
    keep = KeepLast(10.0)
    keep.see(command(0, Mode.IDLE))
    keep.see(command(1, Mode.IDLE))
    assert keep.due(T0) is None
    keep.see(command(2, Mode.ACTIVE))
    snapshot = keep.due(T0 + 2 * PERIOD_NS)
    assert snapshot is not None
    assert snapshot.triggers == ("mode: active",)
    assert len(snapshot.messages) == 3
