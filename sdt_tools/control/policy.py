"""A trained follow network at the wheel."""

import numpy as np

from sdt_tools.frames import MotionClass
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.protocols import Observation


class PolicyDriver:
    """Drives as a follow network says: the class of the largest logit for the newest scan. Implements Driver."""

    def __init__(self, model: LoadedModel) -> None:
        self._model = model
        self.name = f"policy:{model.name}"

    def decide(self, observation: Observation) -> MotionClass:
        """The network's answer; it stays where there is no scan yet."""
        if observation.scan is None:
            return MotionClass.STAY
        logits = self._model.predict_logits(observation.scan.ranges_m[np.newaxis])
        return MotionClass(int(logits[0].argmax()))
