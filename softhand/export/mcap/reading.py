"""The recording that an MCAP file was made from."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from softhand.errors import RecordingError
from softhand.export.mcap.file import METADATA, TEXTS
from softhand.export.mcap.numbers import PREFIX, numbers_of
from softhand.recording.recording import Recording
from softhand.recording.variables import COMPONENTS, VARIABLES


def read(path: Path) -> Recording:
    """The recording, each number bit-equal.

    Raises:
        RecordingError: the file cannot be read, or softhand did not write it.
    """
    try:
        with path.open("rb") as file:
            return _recording(make_reader(file, decoder_factories=[DecoderFactory()]))
    except RecordingError:
        raise
    except Exception as error:
        raise RecordingError(f"{path}: cannot be read as an MCAP file of softhand: {error}", file=path) from error


def _recording(reader: Any) -> Recording:
    about = next((entry.metadata for entry in reader.iter_metadata() if entry.name == METADATA), None)
    if about is None:
        raise ValueError("it has no metadata of that name")
    texts = {attachment.name: attachment.data.decode() for attachment in reader.iter_attachments()}
    names, labels = list(json.loads(about["units"])), json.loads(about["labels"])
    rows: dict[str, list[Any]] = {name: [] for name in names}
    for _, channel, _, message in reader.iter_decoded_messages([PREFIX + name for name in names]):
        rows[channel.topic.removeprefix(PREFIX)].append(list(numbers_of(message)))
    return Recording(
        variables={name: _array(name, values, labels) for name, values in rows.items()},
        labels={dim: tuple(members) for dim, members in labels.items()},
        version=about["version"],
        complete=json.loads(about["complete"]),
        reason=about["reason"],
        stop_time=json.loads(about["stop_time"]),
        attributes=json.loads(about["attributes"]),
        **{field: texts[name] for field, name in TEXTS.items()},
    )


def _array(name: str, rows: list[Any], labels: dict[str, Any]) -> Any:
    lengths = [len(COMPONENTS.get(dim) or labels[dim]) for dim in VARIABLES[name].dims[1:]]
    return np.array(rows, VARIABLES[name].dtype).reshape(len(rows), *lengths)
