"""The names under which things are logged; a view shows everything under one of the roots."""

from typing import Final

SCAN: Final = "scan"
SCAN_POINTS: Final = "scan/points"
SCAN_CODES: Final = "scan/codes"
SCAN_OPERATOR: Final = "scan/operator"
SCAN_LABEL: Final = "scan/motion/label"
SCAN_FURNITURE: Final = "scan/furniture"
SCAN_LABEL_WORDS: Final = "scan/words/label"

CAMERA: Final = "camera"
CAMERA_IMAGE: Final = "camera/image"
CAMERA_GESTURE: Final = "camera/gesture"
CAMERA_LABEL_WORDS: Final = "camera/words/label"

MAP: Final = "map"
MAP_ROBOT: Final = "map/robot"
MAP_OPERATOR: Final = "map/operator"
MAP_ROBOT_WAY: Final = "map/robot_way"
MAP_OPERATOR_WAY: Final = "map/operator_way"
MAP_SURROUNDINGS: Final = "map/surroundings"

LANE_LABEL: Final = "label"
LANE_GESTURE_LABEL: Final = "label/gesture"
LANE_COMMAND: Final = "robot/command"
LANE_MODE: Final = "robot/mode"
LANE_GESTURE: Final = "operator/gesture"
LANES: Final = ("label/**", "model/**", "operator/**", "robot/**")
"""The lanes stand in the order of their names, with the name as it is: label, model, operator, robot."""

LOSS: Final = "loss"
FRONT_RANGE: Final = "sensor/front_range_m"
CODE_SHARE: Final = "sensor/codes_percent"
SPEED: Final = "sensor/speed_mps"
LOG: Final = "log"
SESSION_LOG: Final = "log/session"
ERRORS: Final = "errors"
ERROR_LIST: Final = "errors/list"
ERROR_WORDS: Final = "errors/words"
LEGEND: Final = "legend"


def scan_motion(model: str) -> str:
    """The arrow of a model's prediction."""
    return f"scan/motion/model/{part(model)}"


def scan_words(model: str) -> str:
    """The line that tells a model's answer."""
    return f"scan/words/model/{part(model)}"


def camera_words(model: str) -> str:
    """The line that tells a model's answer to a picture."""
    return f"camera/words/model/{part(model)}"


def lane_predicted(model: str) -> str:
    """What a model answered."""
    return f"model/{part(model)}/predicted"


def lane_tag(model: str) -> str:
    """Whether, and why, a model was wrong."""
    return f"model/{part(model)}/tag"


def loss(model: str) -> str:
    """The loss of a model over time."""
    return f"{LOSS}/{part(model)}"


def error_log(model: str) -> str:
    """Where a model's errors are told in words."""
    return f"{LOG}/model/{part(model)}"


def part(name: str) -> str:
    """A name as one part of an entity path: what Rerun would read as structure becomes an underscore."""
    return "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name) or "_"
