import os
import resource
import signal
import subprocess
import sys
import uuid
from contextlib import suppress
from pathlib import Path

import pytest
from mcap.reader import make_reader
from recording_samples import CONFIG, INFO, T0, image, one_of_each, read_by_mcap, scan, write

from sdt_tools.errors import OutputExistsError, RecordingError
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.container.file import McapFile
from sdt_tools.recording.inspect import inspect_recording
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter

MANY = [message for number in range(400) for message in (scan(number), image(number))]


def metadata(path: Path, name: str) -> dict[str, str]:
    with path.open("rb") as file:
        return next(record.metadata for record in make_reader(file).iter_metadata() if record.name == name)


def test_equal_input_gives_equal_bytes(tmp_path: Path) -> None:
    one, two = write(tmp_path / "one.mcap", MANY), write(tmp_path / "two.mcap", MANY)
    assert one.read_bytes() == two.read_bytes()


def test_the_session_says_where_the_recording_comes_from(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", one_of_each(), operator="anna", notes={"weather": "rain"})
    session = metadata(path, "sdt.session")
    recording_id = session.pop("recording_id")
    assert uuid.UUID(recording_id).version == 5
    assert session.pop("software_version").startswith("sdt-tools ")
    assert session == {
        "source": "scene",
        "scenario": "plain",
        "seed": "7",
        "operator": "anna",
        "device.lidar": "simulated SICK LMS1xx",
        "weather": "rain",
    }


def test_the_stats_count_and_carry_what_is_noted(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "r.mcap", INFO, CONFIG) as writer:
        for received in [*one_of_each(), scan(1), scan(2)]:
            writer.write(received)
        writer.note({"ending": "time"})
    stats = metadata(tmp_path / "r.mcap", "sdt.stats")
    assert stats["count./lidar/scan"] == "3"
    assert stats["count./tf"] == "1"
    assert stats["ending"] == "time"


@pytest.mark.parametrize(
    "other",
    [
        {"info": SourceInfo("scene", "plain", 8)},
        {"info": SourceInfo("scene", "around_boxes", 7)},
        {"config_toml": "answer = 43\n"},
        {"notes": {"model": "b"}},
    ],
)
def test_the_identity_changes_with_what_the_recording_is_made_from(tmp_path: Path, other: dict[str, object]) -> None:
    usual = {"info": SourceInfo("scene", "plain", 7), "config_toml": CONFIG, "notes": {"model": "a"}}
    with RecordingWriter(tmp_path / "usual.mcap", **usual) as one:
        pass
    with RecordingWriter(tmp_path / "same.mcap", **usual) as same:
        pass
    with RecordingWriter(tmp_path / "other.mcap", **(usual | other)) as two:
        pass
    assert one.recording_id == same.recording_id != two.recording_id


def test_the_folder_is_made(tmp_path: Path) -> None:
    assert write(tmp_path / "a" / "b" / "r.mcap", []).exists()


def test_an_existing_recording_is_left_alone(tmp_path: Path) -> None:
    path = write(tmp_path / "r.mcap", one_of_each())
    before = path.read_bytes()
    with pytest.raises(OutputExistsError, match="exists already; choose another --out"):
        write(path, [])
    assert path.read_bytes() == before


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(RecordingError, match=r"file/r\.mcap: its folder cannot be made: .*; choose another"):
        write(tmp_path / "file" / "r.mcap", [])


def test_an_exception_leaves_a_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    with suppress(ZeroDivisionError), RecordingWriter(path, INFO, CONFIG) as writer:
        writer.write(scan(0))
        raise ZeroDivisionError
    assert len(read_by_mcap(path)) == 1


class Ticking:
    """A monotonic clock that is moved by hand."""

    def __init__(self) -> None:
        self.now_ns = 0

    def __call__(self) -> int:
        return self.now_ns


def test_in_real_time_nothing_older_than_half_a_second_waits_in_memory(tmp_path: Path) -> None:
    path, clock = tmp_path / "r.mcap", Ticking()
    writer = RecordingWriter(path, INFO, CONFIG, realtime=True, monotonic_ns=clock)
    for number in range(60):
        clock.now_ns = number * 20_000_000
        writer.write(scan(number))
    with Recording.open(path) as unfinished:
        assert unfinished.truncated
        assert len(unfinished.scans()) == 51  # those written at 1.0 s and before
    clock.now_ns = 1_600_000_000
    writer.keep_safe()
    with Recording.open(path) as unfinished:
        assert len(unfinished.scans()) == 60
    writer.close()
    assert len(read_by_mcap(path)) == 60


def test_as_fast_as_possible_chunks_do_not_depend_on_the_clock(tmp_path: Path) -> None:
    clock = Ticking()
    with RecordingWriter(tmp_path / "slow.mcap", INFO, CONFIG, monotonic_ns=clock) as writer:
        for number in range(60):
            clock.now_ns = number * 10**9
            writer.write(scan(number))
    fast = write(tmp_path / "fast.mcap", [scan(number) for number in range(60)])
    assert (tmp_path / "slow.mcap").read_bytes() == fast.read_bytes()


KILLED = """
import os, signal, sys
sys.path.insert(0, sys.argv[2])
from pathlib import Path
from recording_samples import CONFIG, INFO, scan
from sdt_tools.recording.writer import RecordingWriter
now = [0]
writer = RecordingWriter(Path(sys.argv[1]), INFO, CONFIG, realtime=True, monotonic_ns=lambda: now[0])
for number in range(130):
    now[0] = number * 20_000_000
    writer.write(scan(number))
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_killed_process_loses_less_than_a_second(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    died = subprocess.run([sys.executable, "-c", KILLED, path, Path(__file__).parent], check=False)
    assert died.returncode == -signal.SIGKILL
    with Recording.open(path) as rest:
        scans = rest.scans()
        assert rest.truncated
        assert rest.session["scenario"] == "plain"
    assert list(scans.stamps_ns) == [T0 + n * 20_000_000 for n in range(len(scans))]
    assert 130 - 50 < len(scans) <= 130


@pytest.fixture
def full_disk():
    """A disk that takes 300 kB a file: the limit raises the same OSError path as a disk without room."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


@pytest.mark.usefixtures("full_disk")
def test_a_full_disk_is_said_and_the_file_stays_whole(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    written = 0
    with RecordingWriter(path, INFO, CONFIG, chunk_bytes=40_000) as writer:
        refused = r"r\.mcap: cannot be written after 0\.\d MB: .*; make room on that disk"
        with pytest.raises(RecordingError, match=refused):  # noqa: PT012 - the loop is the point
            for number in range(400):
                writer.write(scan(number))
                written += 1
    assert path.stat().st_size <= 300_000
    read = read_by_mcap(path)  # summary and checksums are whole
    assert 0 < len(read) < written
    with Recording.open(path) as recording:
        assert not recording.truncated
        assert len(recording.scans()) == len(read) == recording.topics["/lidar/scan"].count
        assert int(recording.stats["count./lidar/scan"]) == len(read)
        assert int(recording.stats["lost"]) == written + 1 - len(read)
    assert inspect_recording(path, full=True).disagreements == ()  # the stats are of what is in the file


def test_closing_twice_is_closing_once(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "r.mcap", INFO, CONFIG)
    writer.close()
    size = (tmp_path / "r.mcap").stat().st_size
    writer.close()
    assert (tmp_path / "r.mcap").stat().st_size == size


@pytest.mark.usefixtures("full_disk")
@pytest.mark.parametrize("scans", range(106, 116))
def test_where_the_end_has_no_room_the_last_chunks_make_some(tmp_path: Path, scans: int) -> None:
    path = tmp_path / "r.mcap"
    writer = RecordingWriter(path, INFO, CONFIG, chunk_bytes=5_000)
    refused = ""
    try:
        for number in range(scans):
            writer.write(scan(number))
        writer.close()
    except RecordingError as error:
        refused = str(error)
        writer.close()
    read = read_by_mcap(path)
    with Recording.open(path) as recording:
        assert not recording.truncated
        assert len(recording.scans()) == len(read)
        lost = int(recording.stats.get("lost", 0))
    assert bool(lost) == bool(refused)
    assert len(read) + lost == writer.counts.total()
    assert inspect_recording(path, full=True).disagreements == ()


def test_as_fast_as_it_can_the_disk_takes_what_is_written_while_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = [message for n in range(60) for message in (scan(n), image(n))]
    all_at_close = write(tmp_path / "a.mcap", drive, chunk_bytes=30_000)
    sizes: list[int] = []
    monkeypatch.setattr("sdt_tools.recording.writer.SYNC_BYTES", 50_000)
    monkeypatch.setattr(McapFile, "sync", lambda file: sizes.append(file.size))
    bit_by_bit = write(tmp_path / "b.mcap", drive, chunk_bytes=30_000)
    assert sizes
    assert sizes[0] < bit_by_bit.stat().st_size
    assert bit_by_bit.read_bytes() == all_at_close.read_bytes()


def test_a_disk_that_cannot_keep_what_it_took_is_heard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_file: McapFile) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("sdt_tools.recording.writer.SYNC_BYTES", 50_000)
    monkeypatch.setattr(McapFile, "sync", fails)
    with pytest.raises(RecordingError, match=r"the disk failed to keep what was written: .*Input/output error"):
        write(tmp_path / "r.mcap", [image(n) for n in range(60)], chunk_bytes=30_000)


def test_a_disk_that_takes_less_than_it_is_given_gets_the_rest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drive = [message for n in range(20) for message in (scan(n), image(n))]
    at_once = write(tmp_path / "a.mcap", drive, chunk_bytes=30_000)
    monkeypatch.setattr(os, "writev", lambda descriptor, parts: os.write(descriptor, b"".join(parts)[:1000]))
    in_parts = write(tmp_path / "b.mcap", drive, chunk_bytes=30_000)
    assert in_parts.read_bytes() == at_once.read_bytes()
