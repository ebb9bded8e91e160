"""What can be set about the scene."""

from pydantic import Field, model_validator

from sdt_tools.config import Config, MotionConfig, RateConfig
from sdt_tools.scene.sensor import SensorConfig

PHYSICS_HZ = 50
"""Steps of the world in a second; the scan rate divides it."""


class DriveConfig(Config):
    """How the base follows a command.

    The limits are settings of the P3-AT's controller (commands SETA and SETRA). It turns up at its usual 100°/s², and
    stops from 0.5 m/s in 0.16 m.
    """

    accelerate_mps2: float = Field(default=0.6, gt=0)
    brake_mps2: float = Field(default=0.8, gt=0)
    turn_radps2: float = Field(default=1.75, gt=0)
    max_linear_mps: float = Field(default=0.7, gt=0)
    max_turn_radps: float = Field(default=2.4, gt=0)
    calibration_sd: float = Field(default=0.02, ge=0)
    """Spread of each recording's constant error of speed, as a share of the speed."""
    slip_sd: float = Field(default=0.04, ge=0)
    """Spread of the wheels' slip, which comes and goes within ``slip_s``, as a share of the speed."""
    slip_s: float = Field(default=0.5, gt=0)


class SceneConfig(Config):
    """The scene: rates, speeds, sensor and base."""

    rates: RateConfig = RateConfig()
    motions: MotionConfig = MotionConfig()
    sensor: SensorConfig = SensorConfig()
    drive: DriveConfig = DriveConfig()
    linger_s: float = Field(default=10.0, ge=0)
    """How long a scene goes on after the operator has ended his path."""
    stop_at_contact: bool = True
    """Whether a scene ends when the robot touches something: what would follow teaches nothing."""

    @model_validator(mode="after")
    def _rates_fit(self) -> "SceneConfig":
        scan_hz = self.rates.scan_hz
        if PHYSICS_HZ % scan_hz:
            raise ValueError(f"rates.scan_hz = {scan_hz:g} does not divide the scene's {PHYSICS_HZ} steps a second")
        return self
