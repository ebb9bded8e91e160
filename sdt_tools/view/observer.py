"""What passes during a session, shown live: the drawing of a whole recording, one message at a time."""

import time
from contextlib import suppress
from pathlib import Path
from typing import Final

import numpy as np
import rerun as rr
from jaxtyping import Float64

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import MotionConfig
from sdt_tools.errors import OutputExistsError
from sdt_tools.frames import (
    CameraImage,
    FrameTransform,
    LidarScan,
    LogEntry,
    MotionCommand,
    Odometry,
    OperatorPose,
    OperatorState,
    Pose2D,
    Received,
)
from sdt_tools.top_view import codes, front_range_m, lidar_poses, seen_from
from sdt_tools.view import entities, palette
from sdt_tools.view.blueprint import Content, blueprint
from sdt_tools.view.camera_view import send_images, send_signals, style_signals
from sdt_tools.view.lanes import style_lane
from sdt_tools.view.notes import USUAL_MOUNT, USUAL_WIDTH_PX, is_lidar_mount, mount_of
from sdt_tools.view.people import send_operator, style_operator
from sdt_tools.view.rrd_file import RrdFile
from sdt_tools.view.scan_view import BOLD, draw_furniture, send_motions, send_scans, style_motion, style_scans
from sdt_tools.view.series import send_scalars, style_sensor_series
from sdt_tools.view.timeline import When, send
from sdt_tools.view.viewer import open_window, viewer_url
from sdt_tools.view.words import draw_legend

LIVE_REACH_M: Final = 4.0
LIVE_CONTENT: Final = Content(reach_m=LIVE_REACH_M, camera=True, lanes=True, log=True)
LIVE_PERIOD_NS: Final = SECOND_NS // 25 - SECOND_NS // 1000
"""Scans and poses are drawn 25 times a second at most; a millisecond is for their jitter."""

CLOSE_S: Final = 10.0
LIVE: Final = "sdt live"
COMMAND: Final = "command"


class RerunObserver:
    """An Observer that streams what it sees to Rerun: ``in_window``, ``to_viewer`` or ``to_file``."""

    def __init__(
        self, stream: rr.RecordingStream, motions: MotionConfig | None = None, period_ns: int = LIVE_PERIOD_NS
    ) -> None:
        self._stream = stream
        self._period_ns = period_ns
        self._file: RrdFile | None = None
        self._motions = motions or MotionConfig()
        self._mount = USUAL_MOUNT
        self._frame = 0
        self._scans = 0
        self._robot: Pose2D | None = None
        self._told: dict[str, str] = {}
        self._drawn_ns: dict[str, int] = {}
        self._prepare()

    @classmethod
    def in_window(cls, motions: MotionConfig | None = None) -> "RerunObserver":
        """A viewer in a window of its own, on this machine; it stays when the session ends."""
        return cls.to_viewer(viewer_url(open_window()), motions)

    @classmethod
    def to_viewer(
        cls, url: str, motions: MotionConfig | None = None, period_ns: int = LIVE_PERIOD_NS
    ) -> "RerunObserver":
        """A viewer that runs already, as at ``rerun+http://127.0.0.1:9876/proxy``.

        Scans and poses are drawn so far apart at least; a ``period_ns`` of 0 draws all.
        """
        stream = rr.RecordingStream(LIVE, recording_id=_live_id(), send_properties=False)
        stream.connect_grpc(url, default_blueprint=blueprint(LIVE_CONTENT))
        return cls(stream, motions, period_ns)

    @classmethod
    def to_file(cls, path: Path, motions: MotionConfig | None = None) -> "RerunObserver":
        """An .rrd that grows with the session. Raises OutputExistsError."""
        if path.exists():
            raise OutputExistsError(path)
        file = RrdFile(path, LIVE, _live_id(), blueprint(LIVE_CONTENT))
        observer = cls(file.stream, motions)
        observer._file = file
        return observer

    def observe(self, received: Received) -> None:
        """Draw one message."""
        match received.message:
            case LidarScan() as scan:
                self._see_scan(scan)
            case CameraImage() as image:
                send_images(self._stream, self._at(image.stamp_ns), [image])
            case Odometry(pose=pose):
                self._robot = pose
            case OperatorPose() as operator:
                self._see_operator(operator)
            case MotionCommand() as command:
                self._see_command(command)
            case OperatorState() as signal:
                self._see_signal(signal)
            case LogEntry() as entry:
                columns = rr.TextLog.columns(text=[entry.text], level=[palette.LOG_LEVELS[entry.level]])
                send(self._stream, entities.SESSION_LOG, self._at(entry.stamp_ns), columns)
            case FrameTransform() as transform if is_lidar_mount(transform):
                self._mount = mount_of(transform)
                draw_furniture(self._stream, self._mount, LIVE_REACH_M)
            case _:
                pass

    def flush(self) -> None:
        """Wait until what was observed has been sent; a viewer that is gone is no error."""
        with suppress(RuntimeError):
            self._stream.flush(timeout_sec=CLOSE_S)

    def close(self) -> None:
        """Send what is left and let go of the viewer or file; may be called twice.

        Raises RunError where a file could not be written whole.
        """
        if self._file is not None:
            self._file.close()
            return
        self.flush()  # someone may have closed the viewer: a session does not depend on it
        self._stream.disconnect()

    def _prepare(self) -> None:
        stream = self._stream
        draw_furniture(stream, self._mount, LIVE_REACH_M)
        colors = {"scan": palette.STATUSES[palette.UNLABELED], COMMAND: palette.MODELS[0]}
        draw_legend(stream, colors | {"operator (truth)": palette.OPERATOR, "safety zone, 0.2 m": palette.ZONE})
        style_scans(stream)
        style_operator(stream, entities.SCAN_OPERATOR)
        style_motion(stream, entities.scan_motion(COMMAND), palette.MODELS[0], BOLD, 12.0)
        style_signals(stream, USUAL_WIDTH_PX)
        style_sensor_series(stream)
        style_lane(stream, entities.LANE_COMMAND, palette.MOTIONS)
        style_lane(stream, entities.LANE_MODE, palette.MODES)
        style_lane(stream, entities.LANE_GESTURE, palette.GESTURES)

    def _see_scan(self, scan: LidarScan) -> None:
        self._frame, self._scans = self._scans, self._scans + 1
        if not self._is_due(entities.SCAN_POINTS, scan.stamp_ns):
            return
        rows, ranges_m = self._at(scan.stamp_ns), scan.ranges_m[None]
        send_scans(self._stream, rows, ranges_m, [palette.UNLABELED], LIVE_REACH_M)
        send_scalars(self._stream, entities.FRONT_RANGE, rows, front_range_m(ranges_m))
        send_scalars(self._stream, entities.CODE_SHARE, rows, 100.0 * codes(ranges_m).mean(axis=1))

    def _see_operator(self, operator: OperatorPose) -> None:
        if self._robot is not None and self._is_due(entities.SCAN_OPERATOR, operator.stamp_ns):
            seen = seen_from(lidar_poses(_row(self._robot), self._mount), _row(operator.pose))
            send_operator(self._stream, entities.SCAN_OPERATOR, self._at(operator.stamp_ns), seen)

    def _see_command(self, command: MotionCommand) -> None:
        rows, motion = self._at(command.stamp_ns), command.motion.label
        speed_mps = np.array([command.twist.linear_mps])
        send_scalars(self._stream, entities.SPEED, rows, speed_mps)
        if self._tell(entities.LANE_COMMAND, rows, motion):
            entity = entities.scan_motion(COMMAND)
            send_motions(self._stream, entity, rows, [motion], self._motions, self._mount)
        self._tell(entities.LANE_MODE, rows, command.mode.label)

    def _see_signal(self, signal: OperatorState) -> None:
        rows = self._at(signal.stamp_ns)
        if self._tell(entities.LANE_GESTURE, rows, signal.gesture.label):
            send_signals(self._stream, rows, [signal])

    def _tell(self, lane: str, rows: When, state: str) -> bool:
        """Log ``state`` where it differs from the lane's last; returns whether it does."""
        if self._told.get(lane) == state:
            return False
        self._told[lane] = state
        send(self._stream, lane, rows, rr.StateChange.columns(state=[state]))
        return True

    def _is_due(self, entity: str, stamp_ns: int) -> bool:
        """Whether ``entity`` was last drawn long enough ago; then it counts as drawn now."""
        if 0 <= stamp_ns - self._drawn_ns.get(entity, -self._period_ns) < self._period_ns:
            return False
        self._drawn_ns[entity] = stamp_ns
        return True

    def _at(self, stamp_ns: int) -> When:
        return When(np.array([stamp_ns], np.int64), np.array([self._frame], np.int64))


def _live_id() -> str:
    return f"live {time.time_ns()}"


def _row(pose: Pose2D) -> Float64[np.ndarray, "1 3"]:
    return np.array([[pose.x_m, pose.y_m, pose.yaw_rad]])
