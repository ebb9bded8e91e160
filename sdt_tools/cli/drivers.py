"""Drivers by the names that the command line gives them."""

from pathlib import Path

from sdt_tools.errors import UsageError
from sdt_tools.frames import motion_labelled
from sdt_tools.protocols import Driver
from sdt_tools.recording.live.drivers import ConstantDriver, ExpertDriver
from sdt_tools.scene.source import SceneSource

FORMS = "expert, constant:CLASS, policy:MODEL_DIR, keyboard or gamepad"


def make_driver(name: str, source: SceneSource, option: str = "--driver", forms: str = FORMS) -> Driver:
    """The driver called ``name`` (``expert``, ``constant:CLASS``, ``policy:MODEL_DIR``) for ``source``.

    Raises UsageError for any other name or an unknown class, CheckpointError for a folder that holds no network.
    """
    kind, _, rest = name.partition(":")
    if name == "expert":
        return ExpertDriver(source.expert)
    if kind == "constant":
        return ConstantDriver(motion_labelled(rest))
    if kind == "policy" and rest:
        from sdt_tools.control.policy import PolicyDriver  # torch takes a second to import
        from sdt_tools.models.checkpoint import load_checkpoint

        return PolicyDriver(load_checkpoint(Path(rest)))
    raise UsageError(f"{option} {name}: no such driver; choose {forms}")
