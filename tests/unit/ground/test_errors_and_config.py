from pathlib import Path

import pytest
from pydantic import Field

from sdt_tools.config import Config, MotionConfig, RateConfig, dump_config, load_config
from sdt_tools.errors import ConfigError
from sdt_tools.frames import MotionClass


class Outer(Config):
    rates: RateConfig = RateConfig()
    motions: MotionConfig = MotionConfig()
    name: str = "x"


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "c.toml"
    path.write_text(text)
    return path


def test_unknown_key_names_the_nearest_key_of_the_same_table(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"c\.toml: unknown key 'rates\.folow_hz'; did you mean 'follow_hz'\?"):
        load_config(Outer, write(tmp_path, "[rates]\nfolow_hz = 3"))


def test_unknown_top_level_key_names_the_nearest_top_level_key(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="unknown key 'rate'; did you mean 'rates'"):
        load_config(Outer, write(tmp_path, "[rate]\nfollow_hz = 3"))


def test_bad_value_is_named_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'rates\.scan_hz'.*'fast'"):
        load_config(Outer, write(tmp_path, "[rates]\nscan_hz = 'fast'"))


@pytest.mark.parametrize("text", ["a = ", "[rates", "\x00"])
def test_malformed_toml_is_one_line(tmp_path: Path, text: str) -> None:
    with pytest.raises(ConfigError, match="not valid TOML") as caught:
        load_config(Outer, write(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_missing_file_says_so(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.toml: no such file"):
        load_config(Outer, tmp_path / "none.toml")


def test_the_saved_configuration_reads_back_equal(tmp_path: Path) -> None:
    config = Outer(rates=RateConfig(follow_hz=5.0), name="y")
    assert load_config(Outer, write(tmp_path, dump_config(config))) == config


@pytest.mark.parametrize("motion", list(MotionClass))
def test_the_sign_of_each_twist_is_in_the_name_of_its_class(motion: MotionClass) -> None:
    twist = MotionConfig().twist(motion)
    assert (twist.linear_mps > 0) == ("forward" in motion.label)
    assert (twist.linear_mps < 0) == ("backward" in motion.label)
    assert (twist.angular_radps > 0) == motion.label.startswith("left")
    assert (twist.angular_radps < 0) == motion.label.startswith("right")


def test_mirroring_a_motion_mirrors_its_turn_alone() -> None:
    for motion in MotionClass:
        twist, mirrored = MotionConfig().twist(motion), MotionConfig().twist(motion.mirrored)
        assert (mirrored.linear_mps, mirrored.angular_radps) == (twist.linear_mps, -twist.angular_radps)


class Wall(Config):
    from_: float = Field(alias="from")
    length: float


def test_a_misspelt_required_key_is_explained_as_misspelt(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="unknown key 'lenght'; did you mean 'length'"):
        load_config(Wall, write(tmp_path, "from = 1.0\nlenght = 2.0"))


def test_a_key_is_suggested_by_the_name_that_files_call_it(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="unknown key 'frm'; did you mean 'from'"):
        load_config(Wall, write(tmp_path, "frm = 1.0\nlength = 2.0"))
