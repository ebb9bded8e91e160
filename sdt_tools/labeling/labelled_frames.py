"""What can be labelled in a recording: scans for motions, pictures for gestures."""

from typing import Final

from sdt_tools.errors import LabelError
from sdt_tools.labeling.vocabulary import LabelKind
from sdt_tools.recording.frames import Frames
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.reader import Recording

FRAME_TOPIC: Final = {LabelKind.MOTION: LIDAR_SCAN, LabelKind.GESTURE: CAMERA_IMAGE}
_NOUN: Final = {LabelKind.MOTION: "scans", LabelKind.GESTURE: "pictures"}
_OTHER: Final = {LabelKind.MOTION: LabelKind.GESTURE, LabelKind.GESTURE: LabelKind.MOTION}


def labelled_frames(recording: Recording, kind: LabelKind) -> Frames:
    """The frames that labels of ``kind`` are about. Raises LabelError where the recording has none."""
    frames = recording.frames(FRAME_TOPIC[kind])
    if not len(frames):
        raise LabelError(
            f"{recording.path}: no {_NOUN[kind]} in it, so there is no {kind} to label; "
            f"{_NOUN[_OTHER[kind]]} are labelled with --kind {_OTHER[kind]}"
        )
    return frames
