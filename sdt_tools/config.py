"""Configuration: TOML files parsed once, at the edge, into frozen typed values.

A key that does not exist is an error that names the one that may be meant, or those that exist. The resolved
configuration is saved beside every result it shaped.
"""

import difflib
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar, get_args

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo

from sdt_tools.errors import ConfigError
from sdt_tools.frames import MotionClass, Twist


class Config(BaseModel):
    """Base of all configuration: frozen, its numbers finite, without room for unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


_MOST_KEYS: Final = 12

ConfigT = TypeVar("ConfigT", bound=Config)


class MotionConfig(Config):
    """Twist of each motion class.

    ``forward``/``backward`` give the sign of the linear speed; ``left``/``right`` the sign of the turn, left being
    counter-clockwise whichever way the robot drives.
    """

    forward_mps: float = Field(default=0.5, gt=0)
    turning_forward_mps: float = Field(default=0.35, ge=0)
    backward_mps: float = Field(default=0.4, gt=0)
    turning_backward_mps: float = Field(default=0.25, ge=0)
    turn_radps: float = Field(default=0.9, gt=0)

    def twist(self, motion: MotionClass) -> Twist:
        """The twist of ``motion``."""
        turn = {"LEFT": self.turn_radps, "RIGHT": -self.turn_radps}.get(motion.name.split("_")[0], 0.0)
        if motion is MotionClass.STAY:
            return Twist(0.0, 0.0)
        if motion.is_forward:
            return Twist(self.turning_forward_mps if turn else self.forward_mps, turn)
        return Twist(-(self.turning_backward_mps if turn else self.backward_mps), turn)


class RateConfig(Config):
    """How often sensors speak and networks decide, in hertz."""

    scan_hz: float = Field(default=50.0, gt=0, le=1000)
    image_hz: float = Field(default=30.0, gt=0, le=1000)
    follow_hz: float = Field(default=10.0, gt=0, le=1000)
    vision_hz: float = Field(default=5.0, gt=0, le=1000)


def load_config(model: type[ConfigT], path: Path | None) -> ConfigT:
    """Read ``path`` as TOML into ``model``; without a path, the defaults.

    Raises ConfigError for a missing file, bad TOML, an unknown key (naming valid ones) or a bad value.
    """
    return model() if path is None else parse_config(model, read_toml(path), str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file. Raises ConfigError where it is missing or malformed."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; check the path") from None
    except IsADirectoryError:
        raise ConfigError(f"{path}: is a folder; name the TOML file in it") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}; check path and rights") from None


def parse_config(
    model: type[ConfigT], values: Mapping[str, Any], where: str, options: Mapping[str, str] | None = None
) -> ConfigT:
    """``values`` as ``model``.

    Raises ConfigError; ``where`` says in it where the values stood. Of settings that were given as ``options`` (by
    their place, as ``rates.scan_hz``) it says the option instead.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise ConfigError(_explain(model, error, where, options or {})) from None


def dump_config(config: Config) -> str:
    """The resolved configuration as TOML; unset optional values are left out."""
    return tomli_w.dumps(config.model_dump(mode="json", exclude_none=True))


def _explain(model: type[Config], error: ValidationError, where: str, options: Mapping[str, str]) -> str:
    unknown_keys = [one for one in error.errors() if one["type"] == "extra_forbidden"]
    first = (unknown_keys or error.errors())[0]  # a misspelt key is also a missing one
    place = ".".join(str(part) for part in _without_tags(model, first["loc"]))
    if first["type"] == "extra_forbidden":
        known = _keys_at(model, first["loc"][:-1])
        near = difflib.get_close_matches(str(first["loc"][-1]), known, n=1)
        return f"{where}: unknown key '{place}'; " + (
            f"did you mean '{near[0]}'?" if near else f"known: {_some(known)}"
        )
    named = options.get(place) or (f"{where}: '{place}'" if place else where)
    reason = str(first["msg"]).removeprefix("Value error, ")
    if first["type"] == "value_error":  # said by a rule of ours, which names what is wrong
        return f"{named}: {reason}"
    return f"{named}: {reason[:1].lower()}{reason[1:]}, not {first['input']!r}"


def _some(keys: list[str]) -> str:
    """At most a line of them."""
    return ", ".join(keys[:_MOST_KEYS]) + (" …" if len(keys) > _MOST_KEYS else "")


def _without_tags(model: type[BaseModel], place: tuple[int | str, ...]) -> list[int | str]:
    """The steps of ``place`` that a file has; which member of a union was tried is none of them."""
    return [
        step
        for number, step in enumerate(place)
        if isinstance(step, int) or number == len(place) - 1 or step in _keys_at(model, place[:number])
    ]


def _keys_at(model: type[BaseModel], place: tuple[int | str, ...]) -> list[str]:
    """Valid keys of the table at ``place``, list positions skipped."""
    tables = [model]
    for step in (part for part in place if isinstance(part, str)):
        inner = [field.annotation for table in tables for key, field in _fields(table) if key == step]
        tables = [found for annotation in inner for found in _models_in(annotation)] or tables
    return sorted({key for table in tables for key, _ in _fields(table)})


def _fields(table: type[BaseModel]) -> list[tuple[str, FieldInfo]]:
    """Fields by the keys that a file calls them."""
    return [(field.alias or name, field) for name, field in table.model_fields.items()]


def _models_in(annotation: object) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models_in(part)
