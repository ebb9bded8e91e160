"""What was said once and holds until it is said again: calibrations and transforms."""

from sdt_tools.frames import CameraCalibration, FrameTransform, Message, Received


class Latched:
    """The newest calibration of each camera and transform of each pair of frames."""

    def __init__(self) -> None:
        self._newest: dict[tuple[str, ...], Received] = {}

    def see(self, received: Received) -> None:
        """Keep ``received`` where it is of that kind."""
        key = _key(received.message)
        if key is not None:
            self._newest[key] = received

    def messages(self, received_ns: int) -> list[Received]:
        """All of them, as if they had been received at ``received_ns``; their own stamps stay."""
        return [Received(received_ns, received.message) for received in self._newest.values()]


def _key(message: Message) -> tuple[str, ...] | None:
    if isinstance(message, CameraCalibration):
        return (message.frame_id,)
    return (message.parent, message.child) if isinstance(message, FrameTransform) else None
