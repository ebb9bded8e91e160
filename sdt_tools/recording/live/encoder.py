"""Raw pictures become JPEG files: at once, or in a thread of its own, so that a slow encoder delays nothing else.

The thread's queue is bounded as ``pressure`` says: a picture that arrives when it is full is dropped, those that wait
stay. Pictures come out in the order in which they went in, dropped ones in their place.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from jaxtyping import UInt8
from numpy import ndarray

from sdt_tools.errors import RunError
from sdt_tools.frames import CameraImage, RawPicture, Received
from sdt_tools.recording.live.pressure import QueueLimits

Encode = Callable[[UInt8[ndarray, "height width 3"]], bytes]


def encode_jpeg(image_bgr_u8: UInt8[ndarray, "height width 3"], quality: int = 80) -> bytes:
    """``image_bgr_u8`` as a JPEG file."""
    import cv2  # only pictures need it

    done, data = cv2.imencode(".jpg", image_bgr_u8, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done, "an 8-bit picture always encodes"
    return bytes(data)


@dataclass
class _Place:
    """A picture on its way; ``data`` when it is encoded, ``failure`` where it cannot be."""

    picture: RawPicture
    dropped: bool = False
    data: bytes | None = None
    failure: RunError | None = None

    @property
    def done(self) -> bool:
        """Whether nobody works on it any more."""
        return self.dropped or self.data is not None or self.failure is not None


class PictureEncoder:
    """Encodes what is ``put`` in and hands it out again; ``close`` it.

    With ``behind`` a thread encodes, else ``put`` does: then the same pictures come out at the same places.
    """

    def __init__(self, behind: bool, limits: QueueLimits | None = None, encode: Encode = encode_jpeg) -> None:
        self._behind = behind
        self._limit = (limits or QueueLimits()).raw_pictures
        self._encode = encode
        self._line: deque[_Place] = deque()
        self._waiting: deque[_Place] = deque()
        self._waiting_bytes = 0
        self._changed = threading.Condition()
        self._closed = False
        self._thread: threading.Thread | None = None

    def put(self, picture: RawPicture) -> None:
        """Take in a picture; with a thread this never waits."""
        place = _Place(picture)
        self._line.append(place)
        if not self._behind:
            self._work(place)
            return
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="recording-encoder", daemon=True)
            self._thread.start()
        size_bytes = picture.image_bgr_u8.nbytes
        with self._changed:
            waiting, limit = len(self._waiting), self._limit
            place.dropped = bool(waiting) and (
                waiting >= limit.messages or self._waiting_bytes + size_bytes > limit.size_bytes
            )
            if not place.dropped:
                self._waiting.append(place)
                self._waiting_bytes += size_bytes
                self._changed.notify_all()

    def take(self) -> Received | RawPicture | None:
        """The next picture, as it is recorded, or raw where it was dropped; None while it is not ready.

        Raises RunError for one that cannot be encoded.
        """
        if not self._line or not self._line[0].done:
            return None
        place = self._line.popleft()
        if place.failure is not None:
            raise place.failure
        picture = place.picture
        if place.data is None:
            return picture
        return Received(picture.received_ns, CameraImage(picture.stamp_ns, place.data, frame_id=picture.frame_id))

    def wait(self) -> None:
        """Until all that was put in is ready; where that is interrupted, what is not encoded yet is dropped."""
        try:
            with self._changed:
                self._changed.wait_for(lambda: all(place.done for place in self._line))
        except BaseException:
            self._give_up()
            raise

    def close(self) -> None:
        """End the thread; what waits is given up. May be called twice."""
        self._give_up()
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()

    def _give_up(self) -> None:
        with self._changed:
            for place in self._line:
                place.dropped = place.dropped or not place.done
            self._waiting.clear()
            self._waiting_bytes = 0

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._closed)
                if not self._waiting:
                    return
                place = self._waiting.popleft()
                self._waiting_bytes -= place.picture.image_bgr_u8.nbytes
            self._work(place)
            with self._changed:
                self._changed.notify_all()

    def _work(self, place: _Place) -> None:
        try:
            place.data = self._encode(place.picture.image_bgr_u8)
        except Exception as error:
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            shape = "×".join(map(str, place.picture.image_bgr_u8.shape))
            place.failure = RunError(
                f"a picture of {shape} values of {place.picture.image_bgr_u8.dtype} cannot be encoded ({reason}); "
                "a camera gives height × width × 3 bytes"
            )
