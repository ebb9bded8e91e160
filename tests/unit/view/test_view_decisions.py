import numpy as np
import polars as pl
import pytest
from view_samples import SCAN_NS, predictions, scan_ns, tags

from sdt_tools.class_colors import MOTIONS
from sdt_tools.errors import UsageError
from sdt_tools.view.decisions import ErrorRun, Labels, error_runs, judge, labels_of, models_of

NO_LABELS = Labels(np.empty(0, np.int64), ())


def test_without_tags_a_frame_is_correct_wrong_or_unlabelled() -> None:
    (track,) = models_of("a", [predictions("a")], [], NO_LABELS)
    statuses = track.statuses()
    assert (statuses[0], statuses[1], statuses[60], statuses[61]) == ("correct", "unlabeled", "error", "unlabeled")


def test_a_tag_takes_the_place_of_right_and_wrong() -> None:
    (track,) = models_of("a", [predictions("a")], [tags("a", "conditional")], NO_LABELS)
    assert track.statuses()[55:66:5] == ("correct", "conditional", "conditional")


def test_tags_are_taken_from_their_own_model_and_recording() -> None:
    foreign = [tags("b", "transient"), tags("a", "isolated", model="follow-3")]
    (track,) = models_of("a", [predictions("a")], foreign, NO_LABELS)
    assert track.statuses()[60] == "error"


def test_labels_given_later_judge_predictions_made_without() -> None:
    unlabelled = predictions("a").with_columns(pl.lit(None, pl.String).alias("label"), pl.lit(None).alias("loss_ce"))
    given = Labels(np.array([scan_ns(60)]), ("forward",))
    (track,) = models_of("a", [unlabelled], [], given)
    assert (track.statuses()[60], track.statuses()[65]) == ("error", "unlabeled")
    assert np.isnan(track.loss).all()


def test_a_labelled_frames_status_holds_until_the_next_but_not_for_long() -> None:
    (track,) = models_of("a", [predictions("a")], [], NO_LABELS)
    at = np.array([scan_ns(59), scan_ns(60), scan_ns(64), scan_ns(99), scan_ns(99) + 20 * SCAN_NS])
    assert judge(track).at(at) == ["correct", "error", "error", "correct", "unlabeled"]


def test_models_stay_in_the_order_given() -> None:
    tracks = models_of("a", [predictions("a", "z"), predictions("a", "b")], [], NO_LABELS)
    assert [track.model for track in tracks] == ["z", "b"]


def test_predictions_of_other_recordings_only_are_refused() -> None:
    with pytest.raises(UsageError, match=r"none of the predictions is about recording a; they are about b: replay"):
        models_of("a", [predictions("b")], [], NO_LABELS)


def test_tags_of_other_recordings_only_are_refused() -> None:
    with pytest.raises(UsageError, match=r"none of the tags is about recording a; they are about b: analyse"):
        models_of("a", [predictions("a")], [tags("b", "transient")], NO_LABELS)


def test_an_unknown_tag_is_named() -> None:
    with pytest.raises(UsageError, match="unknown error tag 'sporadic'; it is one of unlabeled, correct"):
        models_of("a", [predictions("a")], [tags("a", "sporadic")], NO_LABELS)


def test_unresolved_labels_are_left_out_and_the_rest_is_in_order() -> None:
    frame = pl.DataFrame({"stamp_ns": [30, 10, 20], "label": ["stay", "forward", None]})
    labels = labels_of(frame, MOTIONS)
    assert (labels.stamps_ns.tolist(), labels.names) == ([10, 30], ("forward", "stay"))


def test_errors_in_a_row_are_one_entry() -> None:
    (track,) = models_of("a", [predictions("a")], [tags("a", "transient")], NO_LABELS)
    assert error_runs(track) == [ErrorRun(scan_ns(60), 3, "backward", "forward", "transient")]
    assert error_runs(track)[0].text() == "transient: says backward, label forward (3 frames)"
