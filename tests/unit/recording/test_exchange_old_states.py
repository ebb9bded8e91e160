"""Bags from before the operator's behaviour was written are read as they were."""

import pytest
from rosbags.serde import SerdeError

from sdt_tools.recording.exchange.ros2 import types


def test_a_state_without_behaviour_is_read_and_one_with_it_keeps_it() -> None:
    store = types.type_store()
    old_name = "sdt_msgs/msg/OperatorStateWithoutBehaviour"
    header = types.header(1_700_000_000_000_000_000, "map")
    old = types.new(old_name, header=header, gesture=2, commanded_mode=1)
    new = types.new(types.OPERATOR_STATE, header=header, gesture=1, commanded_mode=0, behaviour="phone_call")

    was = types.decoded(bytes(store.serialize_cdr(old, old_name)), types.OPERATOR_STATE)
    is_now = types.decoded(bytes(store.serialize_cdr(new, types.OPERATOR_STATE)), types.OPERATOR_STATE)

    assert (was.gesture, was.commanded_mode, was.behaviour) == (2, 1, "")
    assert (is_now.gesture, is_now.commanded_mode, is_now.behaviour) == (1, 0, "phone_call")
    with pytest.raises(SerdeError):
        types.decoded(b"\x00\x01\x00\x00\x01", types.OPERATOR_STATE)
