"""A network camera that is not there: MJPEG over HTTP, as most such cameras speak it."""

import threading
from collections import deque
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from random import Random
from time import monotonic
from typing import Final, Protocol, runtime_checkable

from sdt_tools.clock import SECOND_NS, HostClock, Pacer
from sdt_tools.emulation.camera.faults import CameraFault
from sdt_tools.emulation.faults import Fault, Faults
from sdt_tools.errors import DeviceError

_WAIT_S: Final = 0.1
_END_S: Final = 2.0


@runtime_checkable
class PictureSupply(Protocol):
    """What a camera sees, whenever it is asked."""

    def jpeg_at(self, host_ns: int) -> bytes:
        """The picture at ``host_ns``, which never goes back, as a JPEG file."""
        ...


class EmulatedCamera:
    """Listens at once, and films while somebody looks, until ``close``. Raises DeviceError where the port is taken."""

    def __init__(
        self,
        supply: PictureSupply,
        host: str = "127.0.0.1",
        port: int = 0,
        rate_hz: float = 30.0,
        planned: tuple[Fault, ...] = (),
        seed: int = 0,
    ) -> None:
        self.faults = Faults(planned)
        self.pictures = 0
        self._supply = supply
        self._host, self._port = host, port
        self._rate_hz = rate_hz
        self._random = Random(seed)
        self._began_s = monotonic()
        self._ended = threading.Event()
        self._changed = threading.Condition()
        self._looking = 0
        self._newest: tuple[int, bytes] = (0, b"")
        self._late: deque[tuple[float, bytes]] = deque()
        self._server = self._listen()
        self._port = self._server.server_port
        self._film = threading.Thread(target=self._run, name="emulated-camera", daemon=True)
        self._film.start()

    @property
    def url(self) -> str:
        """Where its pictures are."""
        return f"http://{self._host}:{self._port}/video.mjpg"

    def close(self) -> None:
        """Film no more. May be called twice."""
        self._ended.set()
        self._film.join(_END_S)
        self._shut()

    def __enter__(self) -> "EmulatedCamera":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _listen(self) -> ThreadingHTTPServer:
        camera = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                camera._serve(self)

            def log_message(self, *arguments: object) -> None:
                """Say nothing."""

        try:
            server = ThreadingHTTPServer((self._host, self._port), Handler)
        except OSError as error:
            raise DeviceError(
                f"{self._host}:{self._port}: cannot listen there ({error.strerror}); choose another port or --host"
            ) from None
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, args=(_WAIT_S,), name="camera-http", daemon=True).start()
        return server

    def _shut(self) -> None:
        self._server.shutdown()
        self._server.server_close()

    def _serve(self, request: BaseHTTPRequestHandler) -> None:
        """Send one client every new picture, until it goes or the camera does."""
        server, seen = self._server, 0
        with self._changed:
            self._looking += 1
        try:
            request.send_response(200)
            request.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
            request.end_headers()
            while server is self._server and not self._ended.is_set() and not self._holds(CameraFault.POWER):
                with self._changed:
                    self._changed.wait_for(lambda: self._newest[0] != seen, _WAIT_S)  # noqa: B023 - called at once
                    number, data = self._newest
                if number != seen:
                    seen = number
                    head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
                    request.wfile.write(head.encode() + data + b"\r\n")
        except OSError:
            pass  # the client has gone
        finally:
            with self._changed:
                self._looking -= 1

    def _run(self) -> None:
        clock = HostClock()
        pacer = Pacer(round(SECOND_NS / self._rate_hz), clock)
        is_off = False
        while not self._ended.is_set():
            pacer.wait()
            if (goes_off := self._holds(CameraFault.POWER)) is not is_off:
                is_off = goes_off
                if is_off:
                    self._shut()
                else:
                    with suppress(DeviceError):  # tried again at the next picture
                        self._server = self._listen()
                        continue
                    is_off = True
            if self._looking and not is_off and not self._holds(CameraFault.SILENCE):
                self._take(clock.now_ns())
            self._hand_out()

    def _take(self, now_ns: int) -> None:
        data = self._supply.jpeg_at(now_ns)
        if self._random.random() < (self._value(CameraFault.CORRUPT) or 0.0):
            data = data[: len(data) // 2]
        self._late.append((monotonic() + (self._value(CameraFault.DELAY) or 0.0), data))

    def _hand_out(self) -> None:
        while self._late and self._late[0][0] <= monotonic():
            with self._changed:
                self.pictures += 1
                self._newest = (self.pictures, self._late.popleft()[1])
                self._changed.notify_all()

    def _value(self, kind: CameraFault) -> float | None:
        return self.faults.value(kind, monotonic() - self._began_s)

    def _holds(self, kind: CameraFault) -> bool:
        return self._value(kind) is not None
