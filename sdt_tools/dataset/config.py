"""How a data set is drawn from recordings."""

from typing import Literal

from pydantic import Field, model_validator

from sdt_tools.config import Config


class DatasetConfig(Config):
    """Which frames of labelled recordings make up a data set.

    ``train_frames`` and ``val_frames`` are totals; where one is not given, all that the other rules leave is taken.
    With ``balanced``, all classes have equal quotas (or quotas one apart, where a total does not divide).
    """

    kind: Literal["motion", "gesture"] = "motion"
    """What is learnt: motions from scans, or gestures from pictures."""
    interventions: Literal["none", "only", "also"] = "none"
    """Frames at which a person took over from a policy, labelled by what he drove: not used, alone, or beside labels.

    Beside labels, people's labels go before them, and they go before all others.
    """
    tolerance_ms: float = Field(default=10.0, ge=0.0, le=1000.0)
    """A label belongs to a scan or picture that is no farther from it in time: half a period of a scan at 50 Hz."""
    spacing_s: float = Field(default=0.4, ge=0.0)
    """Frames of one recording are at least so far apart; closer ones hardly differ."""
    per_recording_cap: int | None = Field(default=40, ge=1)
    """At most so many frames of one recording, so that no world dominates."""
    balanced: bool = True
    train_frames: int | None = Field(default=None, ge=1)
    val_frames: int | None = Field(default=None, ge=1)
    val_share: float = Field(default=0.2, gt=0.0, lt=1.0)
    """Share of the recordings, of each scenario, that is kept for validation."""
    seed: int = Field(default=0, ge=0)
    conflict_level: int = Field(default=3, ge=0, le=4)
    """Level of the safety domains that labels must not contradict."""
    allow_conflicts: bool = False

    @model_validator(mode="after")
    def _interventions_are_motions(self) -> "DatasetConfig":
        if self.kind != "motion" and self.interventions != "none":
            raise ValueError(
                f"interventions = '{self.interventions}' are motions; they do not fit kind = '{self.kind}'"
            )
        return self
