"""Which camera, and what is asked of it."""

from pydantic import Field

from sdt_tools.config import Config


class CameraConfig(Config):
    """One camera. A camera may give something else than it is asked for, and then says so.

    ``source``: the number of a device, its path (``/dev/video0``), a video file, or a URL (``http://…``, ``rtsp://…``).
    ``exposure`` is in the driver's own units; without it the camera chooses. ``silent_s``: after so long without a
    picture it is told that there is none.
    """

    source: str = "0"
    width: int = Field(default=640, gt=0)
    height: int = Field(default=480, gt=0)
    rate_hz: float = Field(default=30.0, gt=0, le=1000)
    exposure: float | None = None
    silent_s: float = Field(default=0.5, gt=0)
    try_again_s: float = Field(default=0.5, gt=0)
