"""How the controller's pictures are read: at once, or by a thread of its own, so that no motion waits for it."""

import threading
from collections import deque
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol, runtime_checkable

from sdt_tools.errors import RecordingError
from sdt_tools.frames import CameraImage, Gesture


@runtime_checkable
class GestureNetwork(Protocol):
    """Reads gestures, as a trained vision network does."""

    @property
    def name(self) -> str:
        """How the network is called."""
        ...

    def decide(self, data: bytes) -> Gesture:
        """The gesture in one compressed picture. Raises RecordingError for one that cannot be decoded."""
        ...


@dataclass(frozen=True)
class Reading:
    """What was read in the picture of ``stamp_ns``, None where it cannot be decoded (``why``), and in what time."""

    stamp_ns: int
    gesture: Gesture | None
    took_s: float
    why: str = ""


@runtime_checkable
class Eyes(Protocol):
    """Pictures go in, readings come out, in the same order."""

    @property
    def name(self) -> str:
        """How the network behind them is called."""
        ...

    def look(self, image: CameraImage) -> None:
        """Have a picture read."""
        ...

    def readings(self) -> list[Reading]:
        """What was read since the last call. Raises what reading has raised."""
        ...

    def close(self) -> None:
        """Read nothing more; may be called twice."""
        ...


class PromptEyes:
    """Reads each picture while the caller waits: the same pictures are read at the same moments. Implements Eyes."""

    def __init__(self, network: GestureNetwork) -> None:
        self.name = network.name
        self._network = network
        self._readings: list[Reading] = []

    def look(self, image: CameraImage) -> None:
        """Read it."""
        self._readings.append(_read(self._network, image))

    def readings(self) -> list[Reading]:
        """What was read since the last call."""
        readings, self._readings = self._readings, []
        return readings

    def close(self) -> None:
        """Nothing is open."""


class BackgroundEyes:
    """Reads in a thread of its own. A picture that is still waiting gives way to a newer one. Implements Eyes."""

    def __init__(self, network: GestureNetwork) -> None:
        self.name = network.name
        self._network = network
        self._waiting: CameraImage | None = None
        self._readings: deque[Reading] = deque()
        self._failure: Exception | None = None
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="eyes", daemon=True)
        self._thread.start()

    def look(self, image: CameraImage) -> None:
        """Have it read next."""
        with self._changed:
            self._waiting = image
            self._changed.notify_all()

    def readings(self) -> list[Reading]:
        """What was read since the last call. Raises what reading has raised."""
        with self._changed:
            if self._failure is not None:
                raise self._failure
            readings = list(self._readings)
            self._readings.clear()
        return readings

    def close(self) -> None:
        """End the thread, after the picture that it reads."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting is not None or self._closed)
                image, self._waiting = self._waiting, None
                if self._closed or image is None:
                    return
            try:
                reading = _read(self._network, image)
            except Exception as failure:  # raised again in the thread that drives
                with self._changed:
                    self._failure = failure
                return
            with self._changed:
                self._readings.append(reading)


def _read(network: GestureNetwork, image: CameraImage) -> Reading:
    started_s = perf_counter()
    try:
        gesture, why = network.decide(image.data), ""
    except RecordingError as error:
        gesture, why = None, str(error)
    return Reading(image.stamp_ns, gesture, perf_counter() - started_s, why)
