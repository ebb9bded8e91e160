"""What reads the pictures in an evaluation: a vision network, or a baseline without one."""

from pathlib import Path

from sdt_tools.clock import SECOND_NS
from sdt_tools.control.eyes import Eyes, GestureNetwork, PromptEyes, Reading
from sdt_tools.errors import UsageError
from sdt_tools.evaluation.vision.run import EyesFor
from sdt_tools.frames import CameraImage, Gesture
from sdt_tools.models.vision.checkpoint import load_vision_checkpoint
from sdt_tools.scene.source import SceneSource

TRUTH = "truth"


class TrueEyes:
    """Reads in the scene what the operator shows. Implements Eyes."""

    name = TRUTH

    def __init__(self, source: SceneSource) -> None:
        self._world = source.world
        self._start_ns = source.start_ns
        self._readings: list[Reading] = []

    def look(self, image: CameraImage) -> None:
        """Ask the scene for the gesture at the picture's stamp."""
        gesture = self._world.gesture_at((image.stamp_ns - self._start_ns) / SECOND_NS)
        self._readings.append(Reading(image.stamp_ns, gesture, 0.0))

    def readings(self) -> list[Reading]:
        """What was read since the last call."""
        readings, self._readings = self._readings, []
        return readings

    def close(self) -> None:
        """Nothing is open."""


class _Constant:
    """Reads the same gesture in every picture. Implements GestureNetwork."""

    def __init__(self, gesture: Gesture) -> None:
        self.name = f"constant:{gesture.label}"
        self._gesture = gesture

    def decide(self, data: bytes) -> Gesture:
        """The constant."""
        del data
        return self._gesture


def reader_for(spec: str) -> tuple[str, EyesFor]:
    """The name of, and what makes, the eyes called ``truth`` or ``constant:<gesture>``, or kept in a checkpoint folder.

    Raises UsageError for an unknown gesture, CheckpointError for a folder that holds no vision network.
    """
    if spec == TRUTH:
        return TRUTH, TrueEyes
    if spec.startswith("constant:"):
        return _read_by(_Constant(_gesture_labelled(spec.removeprefix("constant:"))))
    return _read_by(load_vision_checkpoint(Path(spec)))


def _read_by(network: GestureNetwork) -> tuple[str, EyesFor]:
    def eyes_for(source: SceneSource) -> Eyes:
        del source  # it sees pictures alone
        return PromptEyes(network)

    return network.name, eyes_for


def _gesture_labelled(label: str) -> Gesture:
    known = {gesture.label: gesture for gesture in Gesture}
    if label not in known:
        raise UsageError(f"'{label}': no such gesture; the gestures are {', '.join(known)}")
    return known[label]
