from dataclasses import replace

import pytest
from timing_samples import MS_NS, Stream

from sdt_tools.recording.timing.health import FileState, Health, health_reasons, verdict
from sdt_tools.recording.timing.stamps import StampLog
from sdt_tools.recording.timing.summary import Timing, timing_of

SCANS = Stream(20e6, delay_ns=5 * MS_NS, jitter_ns=200_000, late_ns=500_000)
IMAGES = Stream(1e9 / 30, delay_ns=20 * MS_NS, jitter_ns=200_000, late_ns=1 * MS_NS, seed=1)
SECONDS = 60


def timing(scans: Stream | None = SCANS, images: Stream | None = IMAGES) -> Timing:
    log = StampLog()
    for topic, stream in (("/lidar/scan", scans), ("/camera/image", images)):
        for received_ns, stamp_ns in stream.times(SECONDS) if stream is not None else ():
            log.see(topic, received_ns, stamp_ns)
    return timing_of(log)


def judged(scans: Stream | None = SCANS, images: Stream | None = IMAGES, **state: object) -> tuple[Health, str]:
    """The verdict, and the worst reason for it."""
    reasons = health_reasons(timing(scans, images), FileState(**state))
    return verdict(reasons), reasons[0].text if reasons else ""


def test_a_drive_without_faults_is_good() -> None:
    assert judged() == (Health.GOOD, "")
    assert judged(images=None) == (Health.GOOD, "")


@pytest.mark.parametrize(
    ("scans", "health", "why"),
    [
        (replace(SCANS, missing={7}), Health.GOOD, ""),
        (replace(SCANS, missing=range(7, 2900, 500)), Health.FAIR, "6 messages dropped or missing (0.20%)"),
        (replace(SCANS, missing=range(7, 2900, 50)), Health.POOR, "58 messages dropped or missing (1.93%)"),
        (replace(SCANS, missing=range(600, 612)), Health.FAIR, "ms without a message"),
        (replace(SCANS, missing=range(600, 655)), Health.POOR, "ms without a message"),
        (replace(SCANS, jitter_ns=2 * MS_NS), Health.FAIR, "of the period"),
        (replace(SCANS, late_ns=20 * MS_NS), Health.FAIR, "the delay to the host varies by"),
        (replace(SCANS, late_ns=80 * MS_NS), Health.POOR, "the delay to the host varies by"),
        (replace(SCANS, delay_ns=-9 * MS_NS), Health.FAIR, "before they were taken"),
        (replace(SCANS, delay_ns=-90 * MS_NS), Health.POOR, "before they were taken"),
        (replace(SCANS, drift_ppm=90), Health.GOOD, ""),
        (replace(SCANS, drift_ppm=300), Health.FAIR, "the delay drifts by +"),
        (replace(SCANS, drift_ppm=-1500), Health.POOR, "the delay drifts by -1"),
    ],
)
def test_the_verdict_follows_the_worst_rule(scans: Stream, health: Health, why: str) -> None:
    reasons = health_reasons(timing(scans), FileState())
    assert verdict(reasons) is health
    assert any(why in reason.text and reason.health is health for reason in reasons) or not why


@pytest.mark.parametrize(
    ("state", "health", "why"),
    [
        ({"truncated": True}, Health.FAIR, "it was cut off; sdt repair finishes it"),
        ({"failed": True}, Health.FAIR, "it ended because its source or the disk failed"),
        ({"damaged": 2}, Health.POOR, "2 stretches are damaged and unreadable"),
        ({"lost": 3}, Health.POOR, "3 messages were recorded that the disk did not take"),
        ({"disagreements": 1}, Health.POOR, "its stats disagree with its messages"),
        ({"dropped": {"/lidar/scan": 2}}, Health.GOOD, ""),
        ({"dropped": {"/lidar/scan": 60}}, Health.POOR, "/lidar/scan: 60 messages dropped or missing (1.96%)"),
    ],
)
def test_what_the_file_says_counts_too(state: dict[str, object], health: Health, why: str) -> None:
    assert judged(**state) == (health, why)


def test_images_without_scans_are_not_good() -> None:
    reasons = health_reasons(timing(replace(SCANS, missing=range(1000, 1100))), FileState())
    assert "3.33% of the images have no partner within 20 ms" in [reason.text for reason in reasons]


def test_a_recording_of_nothing_is_poor() -> None:
    assert judged(None, None) == (Health.POOR, "it holds neither scans nor images")
