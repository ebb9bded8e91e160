import numpy as np

from sdt_tools.control.policy import PolicyDriver
from sdt_tools.frames import RAYS, LidarScan, MotionClass
from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.protocols import Driver, Observation


def driver() -> PolicyDriver:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), 3).eval()
    return PolicyDriver(
        LoadedModel(
            "tried",
            network,
            ModelCard(kind=FollowNet.kind, seed=3, architecture=network.architecture, preprocess=network.preprocess),
        )
    )


def test_it_is_a_driver_called_after_its_network() -> None:
    assert isinstance(driver(), Driver)
    assert driver().name == "policy:tried"


def test_it_answers_the_largest_logit_of_the_newest_scan() -> None:
    policy = driver()
    ranges_m = np.random.default_rng(0).uniform(0.5, 4.0, (20, RAYS))
    decided = [policy.decide(Observation(0, LidarScan(0, ranges), None)) for ranges in ranges_m]
    assert decided == [MotionClass(int(best)) for best in policy._model.predict_logits(ranges_m).argmax(axis=1)]


def test_it_stays_until_there_is_a_scan() -> None:
    assert driver().decide(Observation(0, None, None)) is MotionClass.STAY
