"""A topic's messages as columns: those of its protobuf, under their names there, and three of our own.

``stamp_ns`` is when the sensor took it, ``received_ns`` when the host received it, ``place`` its number among all
messages of the recording in order of receipt. Lengths are metres, angles radians, as in the recording; what has several
numbers is a list (ranges one of fixed size), a message within is a struct, an enumeration its name, and what is not set
is null. Every number keeps its bits.
"""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import pyarrow as pa
from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto

from sdt_tools.recording.messages.schemas import message_class
from sdt_tools.recording.messages.topics import LIDAR_SCAN, Topic

PLACE: Final = "place"
RECEIVED: Final = "received_ns"
STAMP: Final = "stamp_ns"
TIMES: Final = (PLACE, RECEIVED, STAMP)
_TIMESTAMP: Final = "timestamp"
_RANGES: Final = "ranges"
_ARROW: Final = {
    FieldDescriptor.CPPTYPE_INT32: pa.int32(),
    FieldDescriptor.CPPTYPE_INT64: pa.int64(),
    FieldDescriptor.CPPTYPE_UINT32: pa.uint32(),
    FieldDescriptor.CPPTYPE_UINT64: pa.uint64(),
    FieldDescriptor.CPPTYPE_DOUBLE: pa.float64(),
    FieldDescriptor.CPPTYPE_FLOAT: pa.float32(),
    FieldDescriptor.CPPTYPE_BOOL: pa.bool_(),
    FieldDescriptor.CPPTYPE_ENUM: pa.string(),
}


def arrow_schema(topic: Topic, first: Any) -> pa.Schema:
    """The columns of ``topic``; the number of rays is that of ``first``, its first message."""
    columns = {name: pa.int64() for name in TIMES}
    for field in message_fields(topic):
        columns[field.name] = _arrow_type(field)
    if topic.name == LIDAR_SCAN:
        columns[_RANGES] = pa.list_(pa.float64(), len(first.ranges))
    return pa.schema(list(columns.items()), metadata={"sdt.topic": topic.name, "sdt.schema": topic.schema})


def message_fields(topic: Topic) -> list[FieldDescriptor]:
    """The fields that become columns: all but the timestamp, which is ``stamp_ns``."""
    return [field for field in _descriptor(topic).fields if field.name != _TIMESTAMP]


def to_columns(topic: Topic, message: Any) -> dict[str, Any]:
    """The values of one message, by column."""
    return {field.name: _value(field, message) for field in message_fields(topic)}


def from_columns(topic: Topic, row: Mapping[str, Any]) -> Any:
    """The message that ``row`` gives. Raises TypeError or ValueError for a value of another type."""
    message = message_class(topic.schema)()
    for field in message_fields(topic):
        _set(field, message, row[field.name])
    return message


def _descriptor(topic: Topic) -> Descriptor:
    return message_class(topic.schema).DESCRIPTOR


def _is_repeated(field: FieldDescriptor) -> bool:
    proto = DescriptorProto()
    field.containing_type.CopyToProto(proto)
    return any(other.name == field.name and other.label == FieldDescriptorProto.LABEL_REPEATED for other in proto.field)


def _arrow_type(field: FieldDescriptor) -> pa.DataType:
    if field.message_type is not None:
        return pa.struct([(inner.name, _arrow_type(inner)) for inner in field.message_type.fields])
    if field.cpp_type == FieldDescriptor.CPPTYPE_STRING:
        single = pa.binary() if field.type == FieldDescriptor.TYPE_BYTES else pa.string()
    else:
        single = _ARROW[field.cpp_type]
    return pa.list_(single) if _is_repeated(field) else single


def _value(field: FieldDescriptor, message: Any) -> Any:
    if field.has_presence and not message.HasField(field.name):
        return None
    value = getattr(message, field.name)
    if field.message_type is not None:
        return {inner.name: _value(inner, value) for inner in field.message_type.fields}
    if field.enum_type is not None:
        known = field.enum_type.values_by_number.get(value)
        return str(value) if known is None else known.name
    return value if isinstance(value, str | bytes | int | float) else np.array(value, np.float64)


def _set(field: FieldDescriptor, message: Any, value: Any) -> None:
    if value is None:
        return
    if field.message_type is not None:
        part = getattr(message, field.name)
        part.SetInParent()
        for inner in field.message_type.fields:
            _set(inner, part, value[inner.name])
    elif field.enum_type is not None:
        known = field.enum_type.values_by_name.get(value)
        setattr(message, field.name, int(value) if known is None else known.number)
    elif isinstance(value, list):
        getattr(message, field.name).extend(value)
    else:
        setattr(message, field.name, value)
