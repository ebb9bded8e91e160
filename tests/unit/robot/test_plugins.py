"""Drivers found by their entry points, and what is said of those that are missing or no drivers."""

from pathlib import Path

import pytest

from sdt_tools.config import Config
from sdt_tools.errors import ConfigError
from sdt_tools.robot.camera.camera import Camera
from sdt_tools.robot.devices import Base, Device, Lidar
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.lms1xx.driver import Lms1xx
from sdt_tools.robot.p3at.base import P3atBase
from sdt_tools.robot.plugins import Kind, base_named, camera_named, device_named, lidar_named, offers

MODULE = """
from sdt_tools.config import Config

class Settings(Config):
    port: int = 7

class Whirl:
    config_model = Settings
    def __init__(self, config, *, clock): ...
    def read(self, until_ns): return []
    def close(self): ...

class Unset(Whirl):
    config_model = dict

class Mute:
    config_model = Settings

def make(): ...
"""


def install(folder: Path, entries: str, name: str = "whirl", module: str = MODULE) -> None:
    """What an installer leaves of a package."""
    (folder / f"{name}.py").write_text(module)
    info = folder / f"{name}-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(entries)


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(__import__("sys").modules, "whirl", raising=False)
    return tmp_path


def test_ours_are_plugins_like_others() -> None:
    assert lidar_named("lms1xx").device is Lms1xx
    assert lidar_named("lms1xx").config_model is Lms1xxConfig
    assert base_named("p3at").device is P3atBase
    assert camera_named("opencv").device is Camera
    assert device_named("camera").device is Camera


@pytest.mark.parametrize(("device", "kind"), [(Lms1xx, Lidar), (P3atBase, Base), (Camera, Device)])
def test_ours_have_what_their_kind_promises(device: type, kind: type) -> None:
    promised = {name for name in kind.__dict__ | Device.__dict__ if not name.startswith("_")}
    assert [name for name in promised - {"finished"} if not hasattr(device, name)] == []


def test_a_driver_of_another_package_is_found_with_its_settings(installed: Path) -> None:
    install(installed, "[sdt_tools.lidars]\nwhirl = whirl:Whirl\n")
    plugin = lidar_named("whirl")
    assert (plugin.kind, plugin.package, plugin.device.__name__) == (Kind.LIDAR, "whirl 1.2", "Whirl")
    settings = plugin.parse({"port": 9}, "robot.toml, [lidar]")
    assert isinstance(settings, Config)
    assert settings.model_dump() == {"port": 9}
    with pytest.raises(ConfigError, match=r"robot.toml, \[lidar\]: unknown key 'prot'; did you mean 'port'"):
        plugin.parse({"prot": 9}, "robot.toml, [lidar]")


def test_a_name_that_nobody_has() -> None:
    with pytest.raises(ConfigError, match=r"no LiDAR driver is called 'lms'; installed: LiDAR: .*lms1xx") as refused:
        lidar_named("lms")
    assert "did you mean 'lms1xx'?" in str(refused.value)
    assert "an entry point in the group sdt_tools.lidars" in str(refused.value)
    with pytest.raises(ConfigError, match=r"installed: LiDAR: .*lms1xx.*; base: p3at.*; camera: opencv"):
        device_named("zzz")
    with pytest.raises(ConfigError, match="no such kind as 'sonar'; the kinds are lidar, base, camera"):
        device_named("sonar:x")


def test_a_base_is_no_lidar() -> None:
    with pytest.raises(ConfigError, match="no LiDAR driver is called 'p3at'"):
        lidar_named("p3at")


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("whirl:Absent", "whirl:Absent cannot be loaded .*AttributeError.*; install it again"),
        ("nowhere:Whirl", "nowhere:Whirl cannot be loaded .*ModuleNotFoundError"),
        ("whirl:make", "whirl:make is no class"),
        ("whirl:Mute", "its class Mute has no method read and no close"),
        ("whirl:Unset", "its class Unset has no config_model"),
    ],
)
def test_what_is_no_driver(installed: Path, value: str, said: str) -> None:
    install(installed, f"[sdt_tools.lidars]\nwhirl = {value}\n")
    with pytest.raises(ConfigError, match=rf"LiDAR driver 'whirl' of whirl 1.2: {said}"):
        lidar_named("whirl")


def test_a_base_must_take_commands(installed: Path) -> None:
    install(installed, "[sdt_tools.bases]\nwhirl = whirl:Whirl\n")
    with pytest.raises(ConfigError, match="its class Whirl has no method command"):
        base_named("whirl")


def test_two_packages_may_not_share_a_name(installed: Path) -> None:
    install(installed, "[sdt_tools.lidars]\nwhirl = whirl:Whirl\n")
    install(installed, "[sdt_tools.lidars]\nwhirl = whirl:Whirl\n", "twirl")
    with pytest.raises(ConfigError, match=r"both twirl 1.2 and whirl 1.2 have one; uninstall one"):
        lidar_named("whirl")


def test_one_name_in_two_kinds_wants_the_kind(installed: Path) -> None:
    install(installed, "[sdt_tools.lidars]\nwhirl = whirl:Whirl\n[sdt_tools.cameras]\nwhirl = whirl:Whirl\n")
    with pytest.raises(ConfigError, match="say lidar:whirl or camera:whirl"):
        device_named("whirl")
    assert device_named("camera:whirl").kind is Kind.CAMERA


def test_nothing_is_imported_to_list_what_there_is(installed: Path) -> None:
    install(installed, "[sdt_tools.lidars]\nwhirl = nowhere:Whirl\n")
    assert "whirl" in [offer.name for offer in offers(Kind.LIDAR)]
