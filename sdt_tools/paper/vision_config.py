"""How large the vision study is."""

from pydantic import Field

from sdt_tools.config import Config, RateConfig
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.evaluation.vision.run import VisionLoopConfig
from sdt_tools.paper.printed import TRAINING_IMAGES
from sdt_tools.robustness.image_attacks import ImageAttackConfig
from sdt_tools.scene.config import SceneConfig


class GesturePracticeConfig(Config):
    """Recordings of operators before a robot that stands: one a world of ``practice_gestures``, from ``first_seed`` on.

    Many short recordings: what a network has to learn is to see through people, clothes and rooms.
    """

    first_seed: int = Field(default=0, ge=0)
    worlds: int = Field(default=400, ge=2, le=1000)
    seconds: float = Field(default=20.0, gt=4.0)
    scene: SceneConfig = SceneConfig(rates=RateConfig(scan_hz=10.0, image_hz=5.0))


class VisionStudyConfig(Config):
    """The study's sizes. Practice seeds lie below 1,000; people and rooms of ``unseen`` have seeds from there on.

    Each training seed, from ``first_training_seed`` on, draws images of its own, to learn from out of the practice
    recordings and to validate with out of ``unseen``. A control is trained plainly on the schedule of the attacked
    networks. ``attack`` says how hard trained networks are attacked, on ``attacked_images`` validation images. The
    networks of the first training seed are driven through the scenarios, ``follow`` at the wheel while the robot is
    active: a follow network's folder, or expert.
    """

    training_seeds: int = Field(default=3, ge=1)
    first_training_seed: int = Field(default=1000, ge=0)
    epsilons: tuple[int, ...] = (0, 1, 2)
    practice: GesturePracticeConfig = GesturePracticeConfig()
    unseen: GesturePracticeConfig = GesturePracticeConfig(first_seed=1000, worlds=60, seconds=24.0)
    data: DatasetConfig = DatasetConfig(kind="gesture", train_frames=TRAINING_IMAGES)
    plain_epochs: int | None = Field(default=None, ge=1)
    attacked_epochs: int | None = Field(default=None, ge=3)
    width: int = Field(default=256, ge=32)
    height: int = Field(default=192, ge=32)
    attack: ImageAttackConfig = ImageAttackConfig(steps=10)
    attacked_images: int = Field(default=300, ge=3)
    first_reported_seed: int = Field(default=2000, ge=1000)
    runs: int = Field(default=20, ge=1)
    follow: str = "expert"
    evaluation: VisionLoopConfig = VisionLoopConfig()
