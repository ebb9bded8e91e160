"""Recorders that are killed, and what is left of their recordings."""

import subprocess
import sys
from pathlib import Path

from recording_samples import PERIOD_NS, T0, read_by_mcap

from sdt_tools.frames import LidarScan
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.repair import repair_recording

RECORDS = """
import sys, time
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from recording_samples import CONFIG, INFO, image, scan
from sdt_tools.recording.live.sink import QueuedSink
from sdt_tools.recording.writer import RecordingWriter
sink = QueuedSink(RecordingWriter(Path(sys.argv[1]), INFO, CONFIG, realtime=True))
messages = [(scan(number), image(number, 30_000)) for number in range(50)]
start_s = time.monotonic()
for number in range(2000):
    scan_now, image_now = scan(number), messages[number % 50][1]
    sink.write(scan_now)
    if number % 5 < 3:
        sink.write(image_now)
    print(number, time.monotonic(), flush=True)
    time.sleep(max(0.0, start_s + (number + 1) * 0.02 - time.monotonic()))
"""


def kill_a_recorder(folder: Path, killed_at: int) -> float:
    """Kill a recorder in real time after scan ``killed_at``, repair its file; how many seconds are lost.

    Asserts that the file opens as it lies, without a hole, and that the repaired one holds the same messages.
    """
    path, here = folder / "r.mcap", Path(__file__).parent
    handed_over: dict[int, float] = {}
    command = [sys.executable, "-c", RECORDS, path, here]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as recorder:
        assert recorder.stdout is not None
        for line in recorder.stdout:
            number, _, at_s = line.strip().partition(" ")
            handed_over[int(number)] = float(at_s)
            if int(number) == killed_at:
                recorder.kill()  # what it has said until it dies is read on

    with Recording.open(path) as rest:
        assert rest.truncated
        kept = [(m.message.stamp_ns - T0) // PERIOD_NS for m in rest.messages() if isinstance(m.message, LidarScan)]
        count = sum(topic.count for topic in rest.topics.values())
    assert kept == list(range(len(kept)))
    lost = [at_s for number, at_s in handed_over.items() if number >= len(kept)]
    report = repair_recording(path, folder / "whole.mcap")
    assert len(read_by_mcap(folder / "whole.mcap")) == sum(report.messages.values()) == count
    return max(handed_over.values()) - min(lost) if lost else 0.0
