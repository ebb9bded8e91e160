"""The protobuf schemas of a recording: Foxglove's wherever one exists, two of our own where none does.

Ours, as they would be written in a ``.proto`` file of package ``sdt`` (the numbers of the enums are those of
``sdt_tools.frames``)::

    message MotionCommand {
      google.protobuf.Timestamp timestamp = 1;  // of the scan that the decision was based on
      MotionClass motion = 2;
      double linear_mps = 3;
      double angular_radps = 4;
      string driver = 5;
      Mode mode = 6;
      bool intervention = 7;
      optional MotionClass expert = 8;          // what the expert would do
    }
    message OperatorState {
      google.protobuf.Timestamp timestamp = 1;
      Gesture gesture = 2;
      Mode commanded_mode = 3;
      string behaviour = 4;
    }
"""

from enum import IntEnum
from functools import cache
from typing import Final

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp

from sdt_tools.frames import Gesture, Mode, MotionClass

_FILE: Final = "sdt/messages.proto"
_STAMP: Final = ".google.protobuf.Timestamp"
_MOTION: Final = ".sdt.MotionClass"
_MODE: Final = ".sdt.Mode"
_GESTURE: Final = ".sdt.Gesture"


def _add_enum(file: FileDescriptorProto, name: str, prefix: str, values: type[IntEnum]) -> None:
    enum = file.enum_type.add(name=name)
    for value in values:
        enum.value.add(name=f"{prefix}_{value.name}", number=value.value)


def _add_field(message: DescriptorProto, name: str, number: int, kind: int, type_name: str = "") -> None:
    field = message.field.add(name=name, number=number, type=kind, label=FieldDescriptorProto.LABEL_OPTIONAL)
    if type_name:
        field.type_name = type_name


def _own_file() -> FileDescriptorProto:
    field = FieldDescriptorProto
    file = FileDescriptorProto(name=_FILE, package="sdt", syntax="proto3")
    file.dependency.append(Timestamp.DESCRIPTOR.file.name)
    _add_enum(file, "MotionClass", "MOTION", MotionClass)
    _add_enum(file, "Mode", "MODE", Mode)
    _add_enum(file, "Gesture", "GESTURE", Gesture)

    command = file.message_type.add(name="MotionCommand")
    _add_field(command, "timestamp", 1, field.TYPE_MESSAGE, _STAMP)
    _add_field(command, "motion", 2, field.TYPE_ENUM, _MOTION)
    _add_field(command, "linear_mps", 3, field.TYPE_DOUBLE)
    _add_field(command, "angular_radps", 4, field.TYPE_DOUBLE)
    _add_field(command, "driver", 5, field.TYPE_STRING)
    _add_field(command, "mode", 6, field.TYPE_ENUM, _MODE)
    _add_field(command, "intervention", 7, field.TYPE_BOOL)
    _add_field(command, "expert", 8, field.TYPE_ENUM, _MOTION)
    command.field[-1].proto3_optional = True  # presence in proto3 is a oneof of one field
    command.field[-1].oneof_index = 0
    command.oneof_decl.add(name="_expert")

    state = file.message_type.add(name="OperatorState")
    _add_field(state, "timestamp", 1, field.TYPE_MESSAGE, _STAMP)
    _add_field(state, "gesture", 2, field.TYPE_ENUM, _GESTURE)
    _add_field(state, "commanded_mode", 3, field.TYPE_ENUM, _MODE)
    _add_field(state, "behaviour", 4, field.TYPE_STRING)
    return file


@cache
def _own_message(name: str) -> type[Message]:
    pool = descriptor_pool.Default()
    pool.AddSerializedFile(_own_file().SerializeToString())
    kind: type[Message] = message_factory.GetMessageClass(pool.FindMessageTypeByName(name))
    return kind


@cache
def message_class(schema: str) -> type[Message]:
    """The protobuf class of a schema that we write, as in ``foxglove.LaserScan``; KeyError for any other."""
    foxglove = (LaserScan, CompressedImage, CameraCalibration, FrameTransform, PoseInFrame, Log)
    known = {kind.DESCRIPTOR.full_name: kind for kind in foxglove}
    return known[schema] if schema in known else _own_message(schema)


@cache
def schema_data(schema: str) -> bytes:
    """What an MCAP schema record holds for protobuf: the FileDescriptorSet of ``schema`` and all it imports."""
    files = FileDescriptorSet()
    seen: set[str] = set()

    def add(file: FileDescriptor) -> None:
        if file.name in seen:
            return
        seen.add(file.name)
        for imported in file.dependencies:
            add(imported)
        file.CopyToProto(files.file.add())

    add(message_class(schema).DESCRIPTOR.file)
    data: bytes = files.SerializeToString(deterministic=True)
    return data
