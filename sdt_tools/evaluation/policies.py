"""Who drives in an evaluation: a network, the expert, or a baseline that must fail: a constant class, a polar rule."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float64

from sdt_tools.frames import MotionClass, motion_labelled
from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.protocols import Expert
from sdt_tools.scene.expert import SceneExpert


@runtime_checkable
class Policy(Protocol):
    """Decides for many runs at once."""

    @property
    def name(self) -> str:
        """How results and recordings call the policy."""
        ...

    def decide(self, ranges_m: Float64[np.ndarray, "runs rays"], experts: Sequence[Expert]) -> list[MotionClass]:
        """One motion a run, from its newest scan; the scene's truth is there for the expert alone."""
        ...


class NetworkPolicy:
    """A trained follow network: the class of the largest logit."""

    def __init__(self, model: LoadedModel) -> None:
        self._model = model
        self.name = f"policy:{model.name}"

    def decide(self, ranges_m: Float64[np.ndarray, "runs rays"], experts: Sequence[Expert]) -> list[MotionClass]:
        """One motion a run."""
        assert len(experts) == len(ranges_m)
        return [MotionClass(int(best)) for best in self._model.predict_logits(ranges_m).argmax(axis=1)]


class ExpertPolicy:
    """The expert with the scene's truth."""

    name = "expert"

    def decide(self, ranges_m: Float64[np.ndarray, "runs rays"], experts: Sequence[Expert]) -> list[MotionClass]:
        """One motion a run."""
        assert len(experts) == len(ranges_m)
        return [expert.advise() for expert in experts]


class PolarPolicy:
    """The expert's rule for range and bearing of the operator, blind to everything else."""

    name = "polar"

    def decide(self, ranges_m: Float64[np.ndarray, "runs rays"], experts: Sequence[Expert]) -> list[MotionClass]:
        """One motion a run."""
        assert len(experts) == len(ranges_m)
        answers = []
        for expert in experts:
            assert isinstance(expert, SceneExpert)
            answers.append(expert.advise_in_the_open())
        return answers


class ConstantPolicy:
    """Always the same class."""

    def __init__(self, motion: MotionClass) -> None:
        self._motion = motion
        self.name = f"constant:{motion.label}"

    def decide(self, ranges_m: Float64[np.ndarray, "runs rays"], experts: Sequence[Expert]) -> list[MotionClass]:
        """The one motion, for each run."""
        assert len(experts) == len(ranges_m)
        return [self._motion] * len(ranges_m)


def policy_for(spec: str) -> Policy:
    """The policy called ``expert``, ``polar`` or ``constant:<class>``, or kept in a checkpoint folder.

    ``policy:`` may stand before a folder. Raises UsageError for an unknown class, CheckpointError for
    a folder that holds no follow network.
    """
    if spec == "expert":
        return ExpertPolicy()
    if spec == "polar":
        return PolarPolicy()
    if spec.startswith("constant:"):
        return ConstantPolicy(motion_labelled(spec.removeprefix("constant:")))
    return NetworkPolicy(load_checkpoint(Path(spec.removeprefix("policy:"))))
