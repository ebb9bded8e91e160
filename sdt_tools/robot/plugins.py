"""Drivers of the robot's devices, found by their entry points: ours, and those of whatever else is installed.

A driver is one class that does what ``robot.devices`` promises of its kind, and one entry point in the group of that
kind, under the name that the robot's file gives as ``driver``.
"""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final, Generic, TypeVar

from sdt_tools.config import Config, parse_config
from sdt_tools.errors import ConfigError
from sdt_tools.robot.devices import BaseClass, CameraClass, DeviceClass, LidarClass

ClassT = TypeVar("ClassT", bound=DeviceClass)
_OURS: Final = "sdt-tools"


class Kind(Enum):
    """What a device is; the value is what messages call it."""

    LIDAR = "LiDAR"
    BASE = "base"
    CAMERA = "camera"

    @property
    def group(self) -> str:
        """The group of entry points."""
        return f"sdt_tools.{self.name.lower()}s"


_CALLS: Final = {Kind.LIDAR: ("read", "close"), Kind.BASE: ("read", "close", "command"), Kind.CAMERA: ("read", "close")}


@dataclass(frozen=True)
class Plugin(Generic[ClassT]):
    """An installed driver: its class, and the model of its settings. ``package`` is whose it is, with its version."""

    kind: Kind
    name: str
    package: str
    device: ClassT
    config_model: type[Config]

    def parse(self, values: Mapping[str, Any], where: str, options: Mapping[str, str] | None = None) -> Config:
        """Settings of this driver. Raises ConfigError, as ``parse_config`` does."""
        return parse_config(self.config_model, values, where, options)


@dataclass(frozen=True)
class Offer:
    """A driver that some package offers, before it is loaded."""

    kind: Kind
    name: str
    package: str
    entry: EntryPoint


def offers(kind: Kind) -> list[Offer]:
    """Every driver of ``kind`` that is installed, by name; nothing is loaded yet."""
    found = (Offer(kind, entry.name, _package(entry), entry) for entry in entry_points(group=kind.group))
    return sorted(found, key=lambda offer: (offer.name, offer.package))


def load(offer: Offer) -> Plugin[Any]:
    """The driver behind ``offer``. Raises ConfigError where it cannot be loaded, or is no driver of its kind."""
    what = f"{offer.kind.value} driver '{offer.name}' of {offer.package}"
    try:
        device = offer.entry.load()
    except Exception as error:  # whatever somebody's module does when it is imported
        raise ConfigError(
            f"{what}: {offer.entry.value} cannot be loaded ({type(error).__name__}: {error}); install it again"
        ) from error
    if not isinstance(device, type):
        raise ConfigError(f"{what}: {offer.entry.value} is no class; the entry point must name the driver's class")
    missing = [name for name in _CALLS[offer.kind] if not callable(getattr(device, name, None))]
    if missing:
        raise ConfigError(f"{what}: its class {device.__name__} has no method {' and no '.join(missing)}")
    model = getattr(device, "config_model", None)
    if not (isinstance(model, type) and issubclass(model, Config)):
        raise ConfigError(
            f"{what}: its class {device.__name__} has no config_model; set it to a class derived from "
            "sdt_tools.config.Config, which says what can be set"
        )
    return Plugin(offer.kind, offer.name, offer.package, device, model)


def lidar_named(name: str) -> Plugin[LidarClass]:
    """The LiDAR driver called ``name``. Raises ConfigError, listing what is installed, where there is none."""
    return load(_offer(Kind.LIDAR, name))


def base_named(name: str) -> Plugin[BaseClass]:
    """The driver of a base called ``name``. Raises ConfigError, listing what is installed, where there is none."""
    return load(_offer(Kind.BASE, name))


def camera_named(name: str) -> Plugin[CameraClass]:
    """The camera driver called ``name``. Raises ConfigError, listing what is installed, where there is none."""
    return load(_offer(Kind.CAMERA, name))


def device_named(name: str) -> Plugin[Any]:
    """The driver called ``name``, whatever its kind; ``kind:name`` where two kinds have that name.

    The name of a kind alone, as ``camera``, is its only driver.

    Raises ConfigError, listing what is installed, where there is none.
    """
    kind_word, colon, rest = name.partition(":")
    if colon:
        kinds = [kind for kind in Kind if kind.name.lower() == kind_word.lower()]
        if not kinds:
            known = ", ".join(kind.name.lower() for kind in Kind)
            raise ConfigError(f"source '{name}': no such kind as '{kind_word}'; the kinds are {known}")
        return load(_offer(kinds[0], rest))
    only = [offers(kind) for kind in Kind if kind.name.lower() == name]
    if only and len(only[0]) == 1:
        return load(only[0][0])
    found = [kind for kind in Kind if any(offer.name == name for offer in offers(kind))]
    if len(found) > 1:
        ways = " or ".join(f"{kind.name.lower()}:{name}" for kind in found)
        raise ConfigError(f"source '{name}': there is more than one; say {ways}")
    if not found:
        raise ConfigError(f"source '{name}': no driver is called so; {_installed(tuple(Kind), name)}")
    return load(_offer(found[0], name))


def _offer(kind: Kind, name: str) -> Offer:
    found = [offer for offer in offers(kind) if offer.name == name]
    if not found:
        raise ConfigError(
            f"no {kind.value} driver is called '{name}'; {_installed((kind,), name)} "
            f"(a driver is a package with an entry point in the group {kind.group})"
        )
    if len(found) > 1:
        packages = " and ".join(offer.package for offer in found)
        raise ConfigError(f"{kind.value} driver '{name}': both {packages} have one; uninstall one of them")
    return found[0]


def _installed(kinds: tuple[Kind, ...], name: str) -> str:
    """What there is, and what may be meant."""
    known = {kind: [offer.name for offer in offers(kind)] for kind in kinds}
    if not any(known.values()):
        return (
            f"none is installed, not even those of {_OURS}, whose installation is older than its code: "
            "install it again, as with pip install -e ."
        )
    parts = [f"{kind.value}: {', '.join(names) or 'none'}" for kind, names in known.items()]
    near = difflib.get_close_matches(name, [one for names in known.values() for one in names], n=1)
    return f"installed: {'; '.join(parts)}" + (f"; did you mean '{near[0]}'?" if near else "")


def _package(entry: EntryPoint) -> str:
    return "an unknown package" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
