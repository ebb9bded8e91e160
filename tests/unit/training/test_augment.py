import numpy as np
import pytest
from nearest_object import draw_frames

from sdt_tools.frames import MotionClass
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.training.augment import AugmentConfig, VariedBatches, augment, mirrored

NOTHING = AugmentConfig(mirror=False)


def frames(count: int = 64) -> tuple[np.ndarray, np.ndarray]:
    scans, labels = draw_frames(3, count)
    return scans.astype(np.float32), labels


def side_of_the_nearest(scan: np.ndarray) -> int:
    """-1 right, 0 ahead, 1 left: read off the scan alone."""
    ray = int(np.where(scan > 0.005, scan, np.inf).argmin())
    return int(ray > 315) - int(ray < 225)


def test_labels_turn_with_the_scan() -> None:
    scans, labels = frames(400)
    turned, turned_labels = mirrored(scans, labels, np.ones(400, np.bool_))
    moving = labels != MotionClass.STAY
    side = {0: 0, 1: 0, 2: 1, 3: -1, 4: 0, 5: 1, 6: -1}
    seen = [side_of_the_nearest(scan) for scan in turned[moving]]
    assert seen == [side[label] for label in turned_labels[moving].tolist()]
    assert {-1, 0, 1} == set(seen)


def test_mirroring_twice_changes_nothing() -> None:
    scans, labels = frames()
    chosen = np.ones(len(labels), np.bool_)
    back, back_labels = mirrored(*mirrored(scans, labels, chosen), chosen)
    np.testing.assert_array_equal(back, scans)
    np.testing.assert_array_equal(back_labels, labels)


def test_only_chosen_scans_are_mirrored() -> None:
    scans, labels = frames(2)
    turned, _ = mirrored(scans, labels, np.array([True, False]))
    np.testing.assert_array_equal(turned[0], scans[0, ::-1])
    np.testing.assert_array_equal(turned[1], scans[1])


def test_about_half_of_the_scans_are_mirrored() -> None:
    scans, labels = frames(400)
    varied, _ = augment(scans, labels, AugmentConfig(), np.random.default_rng(0))
    assert 0.4 < (varied == scans[:, ::-1]).all(axis=1).mean() < 0.6


def test_noise_has_the_size_asked_for_and_spares_codes() -> None:
    scans, labels = frames(200)
    varied, _ = augment(scans, labels, AugmentConfig(mirror=False, noise_m=0.05), np.random.default_rng(0))
    assert (varied - scans)[scans > 0].std() == pytest.approx(0.05, rel=0.02)
    assert (varied[scans == 0] == 0).all()


def test_rays_turn_into_codes_at_the_share_asked_for() -> None:
    scans = np.ones((200, 541), np.float32)
    config = AugmentConfig(mirror=False, code_share=0.1)
    varied, _ = augment(scans, np.zeros(200, np.int64), config, np.random.default_rng(0))
    assert (varied == 0).mean() == pytest.approx(0.1, abs=0.005)


def test_arguments_are_left_as_they_were() -> None:
    scans, labels = frames()
    before, before_labels = scans.copy(), labels.copy()
    augment(scans, labels, AugmentConfig(noise_m=0.1, code_share=0.1), np.random.default_rng(0))
    np.testing.assert_array_equal(scans, before)
    np.testing.assert_array_equal(labels, before_labels)


def test_an_epoch_shows_each_frame_once_but_for_the_rest() -> None:
    scans = np.arange(1, 71, dtype=np.float32)[:, None] / 10 + np.zeros((70, 541), np.float32)
    batches = VariedBatches(scans, np.zeros(70, np.int64), 16, NOTHING, PreprocessConfig(), seed=0)
    first, second = ([batch.ranges_m[:, 0].tolist() for batch in batches.epoch(number)] for number in (1, 2))
    assert len(batches) == len(first) == 4
    assert len({value for batch in first for value in batch}) == 64
    assert first != second


def test_an_epoch_is_the_same_whatever_came_before() -> None:
    scans, labels = frames()
    batches = VariedBatches(scans, labels, 16, AugmentConfig(noise_m=0.1), PreprocessConfig(), seed=0)
    list(batches.epoch(1))
    again, fresh = (
        [batch.ranges_m for batch in these.epoch(5)]
        for these in (batches, VariedBatches(scans, labels, 16, AugmentConfig(noise_m=0.1), PreprocessConfig(), seed=0))
    )
    assert all((one == other).all() for one, other in zip(again, fresh, strict=True))


def test_near_misses_bring_one_front_ray_near_where_the_way_is_free_and_the_label_forward() -> None:
    scans = np.full((4, 541), 3.0, np.float32)
    scans[1, 200] = 0.22  # not clear
    labels = np.array([MotionClass.FORWARD, MotionClass.FORWARD, MotionClass.STAY, MotionClass.RIGHT_FORWARD])
    config = AugmentConfig(mirror=False, near_miss_share=1.0)
    varied, kept = augment(scans, labels, config, np.random.default_rng(0))
    assert ((varied != scans).sum(axis=1) == [1, 0, 0, 1]).all()
    rays, values = np.nonzero(varied != scans)[1], varied[varied != scans]
    assert ((rays >= 150) & (rays <= 389)).all()
    assert ((values >= 0.26) & (values <= 0.54)).all()
    np.testing.assert_array_equal(kept, labels)


def test_batches_have_their_codes_resolved() -> None:
    scans, labels = frames()
    batches = VariedBatches(scans, labels, 64, NOTHING, PreprocessConfig(), seed=0)
    assert (scans == 0).any()
    assert all(float(batch.ranges_m.min()) > 0.1 for batch in batches.epoch(1))


def test_a_batch_larger_than_the_data_is_the_data() -> None:
    scans, labels = frames(10)
    batches = VariedBatches(scans, labels, 64, NOTHING, PreprocessConfig(), seed=0)
    assert [len(batch.labels) for batch in batches.epoch(1)] == [10]
