"""How large the follow study is."""

from pydantic import Field

from sdt_tools.certify.verdicts import CertifyConfig
from sdt_tools.config import Config, RateConfig
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.evaluation.closed_loop import ClosedLoopConfig
from sdt_tools.models.follow_net import FollowNetConfig
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.paper.printed import TRAINING_FRAMES, VALIDATION_FRAMES
from sdt_tools.recording.live.perturb import PerturbConfig
from sdt_tools.robustness.attacks import AttackConfig
from sdt_tools.scene.config import SceneConfig


class PracticeConfig(Config):
    """Recordings of the expert in practice worlds: how many of each family, from ``first_seed`` on, and how long.

    ``courses`` counts those that are looked at; one that the expert does not finish is left out, since being stuck is
    nothing to learn. Scans are taken as often as decisions are made.
    """

    first_seed: int = Field(default=0, ge=0)
    worlds: int = Field(default=860, ge=1, le=1000)
    too_close: int = Field(default=140, ge=1, le=1000)
    world_seconds: float = Field(default=12.0, gt=1.0)
    courses: int = Field(default=900, ge=0, le=1000)
    course_seconds: float = Field(default=40.0, gt=1.0)
    scene: SceneConfig = SceneConfig(rates=RateConfig(scan_hz=10.0))
    perturb: PerturbConfig = PerturbConfig()


class AggregationConfig(Config):
    """Rounds of DAgger (Ross et al. 2011): a network drives the practice worlds, the expert says what was right.

    Each round trains a plain level-0 network of ``architecture`` on what there is, for ``epochs`` epochs, and records
    it at the wheel of all courses and of one in ``worlds_every`` practice worlds. It is narrow: it is to make mistakes.
    """

    rounds: int = Field(default=3, ge=0)
    architecture: FollowNetConfig = FollowNetConfig(dropout=0.2)
    epochs: int = Field(default=20, ge=1)
    seconds: float = Field(default=60.0, gt=1.0)
    worlds_every: int = Field(default=3, ge=1)
    frames: int = Field(default=28_000, ge=1)


class FollowStudyConfig(Config):
    """The study's sizes. Practice and training seeds lie below 1,000, reported ones from there on.

    Validation frames come from practice worlds of ``unseen``. Closed-loop runs begin at ``first_reported_seed``: those
    right after 1,000 were looked at while the settings were chosen; 2,000 is the first that was not.

    ``paper_data`` is of the paper's size, drawn for each training seed from its own part of the expert's recordings in
    practice worlds; ``large_data`` is drawn once from everything, and read by networks of ``large_architecture``, the
    same nine layers but wider and with ``large_preprocess``: the narrow one does not take in so much, and so much data
    also says what is far. ``swept_weights`` are values of λ beside the
    recipe's, tried with ``sweep_seeds`` networks each. ``searched_hard`` is the search for violations in one certified
    network.
    """

    training_seeds: int = Field(default=5, ge=1)
    practice: PracticeConfig = PracticeConfig()
    unseen: PracticeConfig = PracticeConfig(first_seed=1000, worlds=215, too_close=35, courses=225)
    aggregation: AggregationConfig = AggregationConfig()
    paper_data: DatasetConfig = DatasetConfig(train_frames=TRAINING_FRAMES, val_frames=VALIDATION_FRAMES)
    large_data: DatasetConfig = DatasetConfig(train_frames=40_000, val_frames=8_000, per_recording_cap=70)
    large_epochs: int = Field(default=30, ge=1)
    large_architecture: FollowNetConfig = FollowNetConfig(widths=(16, 32, 48, 64, 64, 64, 64), hidden=96, dropout=0.2)
    large_preprocess: PreprocessConfig = PreprocessConfig(clip_m=4.0)
    paper_epochs: int = Field(default=80, ge=1)
    first_reported_seed: int = Field(default=2000, ge=1000)
    runs: int = Field(default=20, ge=1)
    evaluation: ClosedLoopConfig = ClosedLoopConfig()
    swept_weights: tuple[float, ...] = (0.1, 0.3, 3.0)
    sweep_seeds: int = Field(default=2, ge=0)
    certify: CertifyConfig = CertifyConfig(attack=AttackConfig(restarts=4, steps=40), attack_certified=True)
    searched_hard: CertifyConfig = CertifyConfig(attack=AttackConfig(restarts=1000, steps=20), attack_certified=True)
