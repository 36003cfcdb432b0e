"""Every array of a recording as a topic of its own: a message a sample, a field a number, by its labels.

The schemas are made for the recording, so that a plot finds `/run/deformation.finger_1_tip.dr`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from softhand.recording.variables import COMPONENTS, VARIABLES

PREFIX = "/run/"
_PACKAGE = "softhand"
_Field = descriptor_pb2.FieldDescriptorProto
Labels = Mapping[str, Sequence[str]]


def message_types(names: Sequence[str], labels: Labels) -> dict[str, Any]:
    """A type of messages for each variable."""
    file = descriptor_pb2.FileDescriptorProto(name="softhand_run.proto", package=_PACKAGE, syntax="proto3")
    for name in names:
        dims = VARIABLES[name].dims[1:]
        _add_type(file.message_type.add(), f"{_PACKAGE}.{name}", name, dims, labels)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return {name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{_PACKAGE}.{name}")) for name in names}


def fill(message: Any, values: Any) -> Any:
    """Put the numbers of one sample, nested lists, into a message."""
    for field, value in zip(message.DESCRIPTOR.fields, values if isinstance(values, list) else [values], strict=True):
        if isinstance(value, list):
            fill(getattr(message, field.name), value)
        else:
            setattr(message, field.name, value)
    return message


def numbers_of(message: Any) -> Iterator[float]:
    """The numbers of a message, in the order of the array."""
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        if field.message_type is None:
            yield value
        else:
            yield from numbers_of(value)


def _add_type(message: Any, full_name: str, name: str, dims: Sequence[str], labels: Labels) -> None:
    """The type of one variable, or of one label of it; a type within it for the labels of the next dimension."""
    message.name = full_name.rpartition(".")[2]
    if not dims:
        _add_field(message, "value", name, "")
        return
    inner = ""
    if len(dims) > 1:
        inner = f"{full_name}.{dims[0]}_"
        _add_type(message.nested_type.add(), inner, name, dims[1:], labels)
    for field in field_names(dims[0], COMPONENTS.get(dims[0]) or labels[dims[0]]):
        _add_field(message, field, name, inner)


def _add_field(message: Any, field: str, name: str, inner: str) -> None:
    kind = _Field.TYPE_DOUBLE if VARIABLES[name].dtype is np.float64 else _Field.TYPE_INT32
    added = message.field.add(name=field, number=len(message.field) + 1, label=_Field.LABEL_OPTIONAL)
    if inner:
        added.type, added.type_name = _Field.TYPE_MESSAGE, f".{inner}"
    else:
        added.type = kind


def field_names(dim: str, labels: Sequence[str]) -> list[str]:
    """Names of fields for labels: letters, digits and underscores, none twice."""
    names: list[str] = []
    for label in labels:
        name = re.sub(r"[^A-Za-z0-9_]", "_", label)
        name = name if re.match(r"[A-Za-z]", name) else f"{dim}_{name}"
        while name in names:
            name += "_"
        names.append(name)
    return names
