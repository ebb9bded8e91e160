"""The emulated camera's pictures, rendered by a process of their own: the LiDAR and the base wait for none of them."""

import multiprocessing
from dataclasses import dataclass
from multiprocessing.connection import Connection
from threading import Lock
from typing import Final

from sdt_tools.errors import RunError
from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.scene.layout import Behaviour, Layout, Manner

_START_S: Final = 120.0
_RENDER_S: Final = 30.0
_END_S: Final = 2.0


@dataclass(frozen=True)
class Shot:
    """All that a picture shows; what ``SceneCamera.render`` takes."""

    robot: Pose2D
    operator: Pose2D
    gait_phase: float
    gait_amplitude: float
    gesture: Gesture | Behaviour
    gesture_phase: float
    time_s: float
    frame: int
    manner: Manner


class Studio:
    """Renders what a camera in ``layout`` sees, until ``close``. Raises RunError where its process does not start."""

    def __init__(self, layout: Layout) -> None:
        spawning = multiprocessing.get_context("spawn")  # this process has threads, which a fork would lose
        self._here, there = spawning.Pipe()
        self._process = spawning.Process(target=_render, args=(there, layout), name="emulated-camera", daemon=True)
        self._process.start()
        there.close()
        self._lock = Lock()
        self._answer(_START_S)

    def jpeg(self, shot: Shot) -> bytes:
        """``shot`` as a JPEG file. Raises RunError where the process has died."""
        with self._lock:
            try:
                self._here.send(shot)
            except OSError:
                raise RunError("the process that renders the camera's pictures has ended; start anew") from None
            return self._answer(_RENDER_S)

    def close(self) -> None:
        """End the process. May be called twice."""
        with self._lock:
            self._here.close()
        self._process.join(_END_S)
        if self._process.is_alive():
            self._process.kill()

    def _answer(self, within_s: float) -> bytes:
        try:
            if self._here.poll(within_s):
                return self._here.recv_bytes()
        except (OSError, EOFError):
            pass
        raise RunError("the process that renders the camera's pictures does not answer; start anew")


def _render(pipe: Connection, layout: Layout) -> None:
    """Answer each shot with its JPEG, until nobody asks any more."""
    import signal

    from sdt_tools.recording.live.encoder import encode_jpeg
    from sdt_tools.scene.camera import SceneCamera

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to the whole group; who asks ends this
    camera = SceneCamera(layout)
    camera.render(Pose2D(0.0, 0.0, 0.0), Pose2D(2.0, 0.0, 0.0))  # compiled before anybody waits for it
    pipe.send_bytes(b"")
    while True:
        try:
            shot: Shot = pipe.recv()
        except (EOFError, OSError):
            return
        picture = camera.render(
            shot.robot,
            shot.operator,
            shot.gait_phase,
            shot.gait_amplitude,
            shot.gesture,
            shot.gesture_phase,
            shot.time_s,
            shot.frame,
            shot.manner,
        )
        pipe.send_bytes(encode_jpeg(picture))
