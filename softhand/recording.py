"""Recordings: a finished or interrupted run as named arrays with units, kept as NetCDF-4 or CSV.

`VARIABLES` is the one list of what a recording can hold. `Recording` is what a run returns, and what `Recording.load`
reads back bit for bit.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib import import_module
from itertools import product
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from softhand.errors import RecordingError
from softhand.whole_file import write_whole

Array = npt.NDArray[Any]
Attribute = float | int | str


class Variable(NamedTuple):
    """What one array of a recording means.

    Units that differ along the last dimension are listed in its order: "m, rad, rad, rad".
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: type = np.float64


LABELLED_DIMS = ("joint", "contact", "pair", "support")
"""Dimensions whose labels belong to the model, so that each recording brings its own."""

COMPONENTS: dict[str, tuple[str, ...]] = {
    "xyz": ("x", "y", "z"),
    "rpy": ("roll", "pitch", "yaw"),
    "twist": ("v_x", "v_y", "v_z", "w_x", "w_y", "w_z"),
    "deformation_component": ("dr", "dtheta", "dphi", "dpsi"),
    "surface_component": ("dr", "s1", "s2", "psi"),
    "force_component": ("f_x", "f_y", "f_z", "tau"),
    "angle": ("Theta", "Phi"),
    "coordinate": ("theta", "phi", "alpha_o_1", "alpha_o_2", "psi"),
    "row": ("x", "y", "z"),
    "column": ("x", "y", "z"),
}
"""Dimensions whose labels are the same in every recording."""

_JOINT, _PAIR, _CONTACT = ("time", "joint"), ("time", "pair"), ("time", "contact")
_XYZ, _RPY, _SUPPORT = ("time", "xyz"), ("time", "rpy"), ("time", "support")

VARIABLES: dict[str, Variable] = {
    "time": Variable(("time",), "s", "time since the start of the run"),
    "joint_position": Variable(_JOINT, "rad or m", "joint angle, or travel of a slide"),
    "joint_velocity": Variable(_JOINT, "rad/s or m/s", "joint velocity"),
    "joint_torque": Variable(
        _JOINT, "N m or N", "joint torque, or force of a slide, as applied, after the effort limits"
    ),
    "joint_limited": Variable(_JOINT, "1", "1 above the upper, -1 below the lower limit of the joint, else 0", np.int8),
    "torque_limited": Variable(_JOINT, "1", "1 where an effort limit cut the commanded torque, else 0", np.int8),
    "object_position": Variable(_XYZ, "m", "origin of the object frame, in the world"),
    "object_rpy": Variable(_RPY, "rad", "orientation of the object, R = Rz(yaw) Ry(pitch) Rx(roll)"),
    "object_twist": Variable(
        ("time", "twist"),
        "m/s, m/s, m/s, rad/s, rad/s, rad/s",
        "velocity of the origin of the object frame and angular velocity of the object, world axes",
    ),
    "internal_force": Variable(_PAIR, "N", "internal force between two contacts"),
    "tip_position": Variable((*_CONTACT, "xyz"), "m", "centre of the flat face of the hemisphere, in the world"),
    "deformation": Variable((*_CONTACT, "deformation_component"), "m, rad, rad, rad", "fingertip deformation"),
    "contact_force": Variable(
        (*_CONTACT, "force_component"), "N, N, N, N m", "force and torsion on the object, in the contact frame"
    ),
    "contact_angles": Variable((*_CONTACT, "angle"), "rad", "angles of the contact on the hemisphere"),
    "contact_point": Variable((*_CONTACT, "xyz"), "m", "contact point, in the world"),
    "contact_rotation": Variable((*_CONTACT, "row", "column"), "1", "rotation from the contact frame to the world"),
    "contact_coordinates": Variable(
        (*_CONTACT, "coordinate"), "rad, rad, m, m, rad", "contact coordinates eta on fingertip and object"
    ),
    "contact_coordinates_rate": Variable(
        (*_CONTACT, "coordinate"), "rad/s, rad/s, m/s, m/s, rad/s", "rate of the contact coordinates eta"
    ),
    "friction_use": Variable(_CONTACT, "1", "tangential force over the friction limit, |f_t|/(mu f_z)"),
    "contact_feature": Variable(_CONTACT, "1", "1 over a face of the object, 2 over an edge, 3 over a vertex", np.int8),
    "limit_surface_use": Variable(
        _CONTACT, "1", "load over the coupled limit, sqrt((|f_t|/(mu f_z))^2 + (tau/tau_max)^2)"
    ),
    "is_slipping": Variable(_CONTACT, "1", "1 where the step before slipped, else 0", np.int8),
    "slip_travel": Variable(_CONTACT, "m", "tangential slip since the start, its path length"),
    "slip_twist": Variable(_CONTACT, "rad", "torsional slip since the start, its total amount"),
    "slip_loss": Variable(_CONTACT, "J", "work lost to slip since the start"),
    "support_force": Variable(
        (*_SUPPORT, "force_component"), "N, N, N, N m", "force and torsion of a support, in its contact frame"
    ),
    "support_deformation": Variable(
        (*_SUPPORT, "surface_component"), "m, m, m, rad", "depth, shear and torsion of a support"
    ),
    "support_point": Variable(
        (*_SUPPORT, "xyz"), "m", "contact point of a support where it last touched, in the world"
    ),
    "support_rotation": Variable(
        (*_SUPPORT, "row", "column"), "1", "rotation from the contact frame of a support to the world"
    ),
    "support_is_slipping": Variable(_SUPPORT, "1", "1 where the step before slipped, else 0", np.int8),
    "support_slip_loss": Variable(_SUPPORT, "J", "work lost to slip since the start"),
    "object_position_desired": Variable(_XYZ, "m", "desired origin of the object frame, in the world"),
    "object_rpy_desired": Variable(_RPY, "rad", "desired orientation of the object, R = Rz(yaw) Ry(pitch) Rx(roll)"),
    "internal_force_desired": Variable(_PAIR, "N", "desired internal force between two contacts"),
}

_MOST_COMPRESSED = 1100  # bytes in memory for one in the file; deflate reaches 1032
_TITLE = "softhand: recording of a run"
_REPORT = "softhand.viewer.report"  # by name, since it lies far above
_RESERVED = (
    "title", "softhand_version", "scenario", "complete", "reason", "stop_time", "hand_urdf", "object_urdf",
)  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """A run as arrays by name: `recording["deformation"]` or `recording.deformation`; `len` is its samples.

    Attributes:
        variables: arrays by their names in `VARIABLES`, in its dims and units; `time` must be there.
        labels: names along `joint`, `contact`, `pair` and `support`, as far as the variables have these dimensions.
        scenario: the resolved scenario, as TOML text.
        version: version of softhand that computed the run.
        complete: whether the run reached its duration.
        reason: why it ended early; "" when complete.
        stop_time: simulated time at which it ended, [s].
        attributes: further figures of the run, such as `steps_per_second`.
        hand_urdf: text of the hand's URDF as it was loaded; "" in files of versions that did not keep it.
        object_urdf: text of the object's URDF, likewise.

    Raises:
        RecordingError: an array is unknown or has another shape than its dims and labels give.
    """

    variables: dict[str, Array]
    labels: dict[str, tuple[str, ...]]
    scenario: str
    version: str
    complete: bool
    reason: str
    stop_time: float
    attributes: dict[str, Attribute] = field(default_factory=dict)
    hand_urdf: str = ""
    object_urdf: str = ""

    def __post_init__(self) -> None:
        labels = {dim: tuple(names) for dim, names in self.labels.items()}
        object.__setattr__(self, "labels", labels)
        object.__setattr__(self, "variables", _checked_variables(self.variables, labels))
        object.__setattr__(self, "attributes", _checked_attributes(self.attributes))

    def __getitem__(self, name: str) -> Array:
        try:
            return self.variables[name]
        except KeyError:
            raise KeyError(f"no array {name!r} in this recording; {_suggest(name, self.variables)}") from None

    def __getattr__(self, name: str) -> Array:
        variables = self.__dict__.get("variables", {})  # not there yet while a copy is being unpickled
        if name in variables:
            array: Array = variables[name]
            return array
        raise AttributeError(f"no array or attribute {name!r} in this recording; {_suggest(name, variables)}")

    def __len__(self) -> int:
        return len(self.variables["time"])

    def __repr__(self) -> str:
        end = "complete" if self.complete else f"incomplete: {self.reason}"
        contacts = len(self.labels.get("contact", ()))
        return f"<Recording: {self.stop_time:g} s, {len(self)} samples, {contacts} contacts, {end}>"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write NetCDF-4, whole or not at all: first to PATH.partial, which then takes the name PATH.

        Args:
            path: file to write; an older one is replaced.

        Raises:
            RecordingError: the file cannot be written.
        """
        write_whole(Path(path), lambda: _to_netcdf(self))

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write one row a sample, with columns such as `object_position_x_m`, whole or not at all.

        Numbers keep all their digits; labels, scenario and attributes do not go along: use `save` to load again.

        Args:
            path: file to write; an older one is replaced.

        Raises:
            RecordingError: the file cannot be written.
        """
        write_whole(Path(path), lambda: _to_csv(self))

    def to_html(self, path: str | os.PathLike[str], *others: Recording) -> None:
        """Write a report, one HTML file with film, curves and numbers that works offline; see `softhand.write_report`.

        Args:
            path: file to write; an older one is replaced.
            others: runs to be shown beside this one, with the same clock.

        Raises:
            RecordingError: a recording lacks what the report shows, or the file cannot be written.
        """
        import_module(_REPORT).write_report(path, self, *others)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Recording:
        """Read what `save` wrote. Arrays that others added under names of their own are left out.

        Args:
            path: file to read.

        Returns:
            The recording, each number bit-equal to the one saved.

        Raises:
            RecordingError: the file does not exist, is damaged, or is no recording.
        """
        path = Path(path)
        try:
            if not path.is_file():
                raise RecordingError("there is no such file" if not path.exists() else "it is not a file")
            return _from_netcdf(path)
        except Exception as error:  # HDF5 answers a damaged file with almost any type
            why = "a part of it is missing" if "truncated file" in str(error) else error
            raise RecordingError(
                f"{path}: cannot be read as a recording: {why}; give the run.nc of a softhand run", file=path
            ) from error


def _suggest(name: str, names: Iterable[str]) -> str:
    nearest = get_close_matches(name, names, n=1)
    return f"did you mean {nearest[0]!r}?" if nearest else f"there are: {', '.join(names)}"


def _labels_of(dim: str, labels: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    return COMPONENTS[dim] if dim in COMPONENTS else labels[dim]


def _checked_variables(variables: Mapping[str, Any], labels: Mapping[str, tuple[str, ...]]) -> dict[str, Array]:
    """Return the arrays in the dtype of the table; refuse names and shapes that table and labels do not give."""
    for name in variables:
        if name not in VARIABLES:
            raise RecordingError(f"unknown variable {name!r}; {_suggest(name, VARIABLES)}")
    for dim in labels:
        if dim not in LABELLED_DIMS:
            raise RecordingError(f"labels for unknown dimension {dim!r}; {_suggest(dim, LABELLED_DIMS)}")
    if "time" not in variables:
        raise RecordingError("a recording needs the variable 'time'")
    samples = np.size(variables["time"])
    return {name: _checked_array(name, value, samples, labels) for name, value in variables.items()}


def _checked_array(name: str, value: Any, samples: int, labels: Mapping[str, tuple[str, ...]]) -> Array:
    dims = VARIABLES[name].dims
    for dim in dims[1:]:
        if dim not in COMPONENTS and dim not in labels:
            raise RecordingError(f"variable {name!r} needs labels for dimension {dim!r}")
    expected = (samples, *(len(_labels_of(dim, labels)) for dim in dims[1:]))
    if np.shape(value) != expected:
        raise RecordingError(f"variable {name!r} has shape {np.shape(value)}, expected {expected} for {dims}")
    return np.asarray(value, dtype=VARIABLES[name].dtype, order="C")


def _checked_attributes(attributes: Mapping[str, Any]) -> dict[str, Attribute]:
    """Return the attributes as plain Python numbers and text."""
    plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in attributes.items()}
    for name, value in plain.items():
        if name in _RESERVED:
            raise RecordingError(f"attribute {name!r} has a field of its own; choose another name")
        if not isinstance(value, (float, int, str)):
            raise RecordingError(f"attribute {name!r} is a {type(value).__name__}; allowed are float, int and str")
    return {name: int(value) if isinstance(value, bool) else value for name, value in plain.items()}


def _to_netcdf(recording: Recording) -> bytes:
    """Encode the recording as NetCDF-4.

    Built in memory: a full disk then fails in one plain write, where HDF5 would be left with a file it cannot close.
    Not compressed: deflate with shuffle takes 45 % longer and saves a fifth.
    """
    # Imported here, since HDF5 takes 0.1 s to load and most commands do without.
    import h5netcdf
    import h5py

    used = {dim for name in recording.variables for dim in VARIABLES[name].dims[1:]}
    labels = {**recording.labels, **{dim: names for dim, names in COMPONENTS.items() if dim in used}}
    buffer = io.BytesIO()
    with h5netcdf.File(buffer, "w") as file:
        file.attrs.update(title=_TITLE, softhand_version=recording.version, scenario=recording.scenario)
        file.attrs.update(complete=int(recording.complete), reason=recording.reason)
        file.attrs.update(stop_time=float(recording.stop_time), **recording.attributes)
        file.attrs.update(hand_urdf=recording.hand_urdf, object_urdf=recording.object_urdf)
        file.dimensions = {"time": len(recording), **{dim: len(names) for dim, names in labels.items()}}
        for dim, names in labels.items():
            variable = file.create_variable(dim, (dim,), data=np.array(names, h5py.string_dtype()))
            variable.attrs["long_name"] = f"label along {dim}"
        for name, array in recording.variables.items():
            variable = file.create_variable(name, VARIABLES[name].dims, data=array)
            variable.attrs.update(units=VARIABLES[name].units, long_name=VARIABLES[name].long_name)
    return buffer.getvalue()


_SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of a NetCDF-4 file."""


def _from_netcdf(path: Path) -> Recording:
    import h5netcdf  # here for the reason given in _to_netcdf
    import h5py

    with path.open("rb") as content:
        if content.read(len(_SIGNATURE)) != _SIGNATURE:
            raise RecordingError("it is no NetCDF-4 file")
    # An absolute path, because h5netcdf takes one that begins with "http" for an address.
    with h5py.File(path.absolute(), "r") as hdf:
        if "softhand_version" not in hdf.attrs or "time" not in hdf:
            raise RecordingError("it was not written by softhand")
        _refuse_what_is_elsewhere(hdf, path.stat().st_size)
        with h5netcdf.File(hdf, "r", decode_vlen_strings=True) as file:
            fields = dict(file.attrs)
            return Recording(
                variables={name: file[name][...] for name in VARIABLES if name in file.variables},
                labels={dim: tuple(file[dim][...]) for dim in LABELLED_DIMS if dim in file.variables},
                scenario=fields["scenario"],
                version=fields["softhand_version"],
                complete=bool(fields["complete"]),
                reason=fields["reason"],
                stop_time=float(fields["stop_time"]),
                hand_urdf=fields.get("hand_urdf", ""),
                object_urdf=fields.get("object_urdf", ""),
                attributes={
                    name: value for name, value in fields.items() if name not in _RESERVED and np.ndim(value) == 0
                },
            )


def _refuse_what_is_elsewhere(hdf: Any, size: int) -> None:
    """A recording has its arrays in its own file: no links or data in other files, no more than the file can hold."""
    import h5py

    needed = 0
    for name in {*VARIABLES, *LABELLED_DIMS} & set(hdf):
        item = hdf[name] if isinstance(hdf.get(name, getlink=True), h5py.HardLink) else None
        if not isinstance(item, h5py.Dataset) or item.is_virtual or item.external:
            raise RecordingError(f"its array {name!r} is not in the file itself")
        needed += item.size * item.dtype.itemsize
    if needed > _MOST_COMPRESSED * size:
        raise RecordingError(f"its arrays claim {needed:.3g} bytes, which a file of {size} bytes cannot hold")


def _to_csv(recording: Recording) -> bytes:
    """Encode the recording as CSV, each float as the shortest text that reads back the same."""
    header = [column for name in recording.variables for column in _columns(name, recording.labels)]
    samples = len(recording)
    columns = [
        c for array in recording.variables.values() for c in array.reshape(samples, prod(array.shape[1:])).T.tolist()
    ]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(zip(*columns, strict=True))
    return text.getvalue().encode()


def _columns(name: str, labels: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Name the columns of one variable: its name, the label along each dimension, and the unit."""
    variable = VARIABLES[name]
    units = variable.units.replace("/", "_per_").replace(" ", "_").split(",_")
    cells = product(*(_labels_of(dim, labels) for dim in variable.dims[1:]))
    return ["_".join((name, *cell, units[i % len(units)])).removesuffix("_1") for i, cell in enumerate(cells)]
