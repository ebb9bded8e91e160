"""Settings that were found to work, by safety level and architecture: where a training without a configuration starts.

At level 0 ranges are clipped at 2.5 m: a few thousand scans do not teach what lies farther, and its variety costs a
point of accuracy. The plain network is certified by one schedule and one λ at every level. It sees ranges up
to 20 m: clipped at the domains' 4 m or less it finds no way to meet them but a constant answer. The gated network keeps
the clip of level 0, which makes all levels one problem, and begins with the data alone. Its gate is wider than it need
be: of eight channels a layer so many can die before the domains come in that from a few thousand frames it never opens.
"""

from typing import Final

from sdt_tools.errors import UsageError
from sdt_tools.frames import MAX_RANGE_M
from sdt_tools.models.follow_net import FollowNetConfig
from sdt_tools.models.gated_net import GateConfig
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.training.augment import AugmentConfig
from sdt_tools.training.follow import FollowTrainingConfig
from sdt_tools.training.loop import LoopConfig
from sdt_tools.training.safety import SafetyConfig
from sdt_tools.training.schedule import LearningRateConfig
from sdt_tools.training.specification import SpecificationConfig

ARCHITECTURES: Final = ("plain", "gate")
_NEARBY: Final = PreprocessConfig(clip_m=2.5)
_UNHELD: Final = FollowTrainingConfig(
    architecture=FollowNetConfig(dropout=0.4),
    preprocess=_NEARBY,
    loop=LoopConfig(learning_rate=LearningRateConfig(peak=3e-3)),
)


def recipe_for(specification: SpecificationConfig, arch: str, where: str = "arch") -> FollowTrainingConfig:
    """The settings for a specification and an architecture, seed 0.

    Raises UsageError for an architecture that there is not; ``where`` says in it who asked.
    """
    if arch not in ARCHITECTURES:
        raise UsageError(f"{where} {arch}: no such architecture; choose {' or '.join(ARCHITECTURES)}")
    if arch == "gate":
        return _gate(specification)
    return _UNHELD if specification.empty else _plain(specification)


def _plain(specification: SpecificationConfig) -> FollowTrainingConfig:
    return FollowTrainingConfig(
        specification=specification,
        preprocess=PreprocessConfig(clip_m=MAX_RANGE_M, scale_m=4.0),
        safety=SafetyConfig(weight=1.0, start_share=0.1, ramp_share=0.5),
        loop=LoopConfig(learning_rate=LearningRateConfig(peak=1e-3)),
    )


def _gate(specification: SpecificationConfig) -> FollowTrainingConfig:
    return FollowTrainingConfig(
        arch="gate",
        specification=specification,
        gate=GateConfig(widths=(16, 16)),
        preprocess=_NEARBY,
        augment=AugmentConfig(near_miss_share=0.5),
        safety=SafetyConfig(weight=1.0, start_share=0.3, ramp_share=0.3, domains_a_step=16),
    )
