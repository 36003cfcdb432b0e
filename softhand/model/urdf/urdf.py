"""A URDF: read once, checked once, and then asked."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace
from pathlib import Path

from softhand.errors import ModelError
from softhand.model.urdf.document import Element, as_bytes, extended, read_document, read_text
from softhand.model.urdf.examination import EITHER, Examination, Role, examine
from softhand.model.urdf.findings import Finding, Findings
from softhand.model.urdf.geometry import Geometry, Purpose, read_geometries
from softhand.model.urdf.joints import check_place
from softhand.model.urdf.meshes import find_mesh
from softhand.model.urdf.tree import Joint, Tree

Vector3 = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Urdf:
    """A URDF without errors, as text and as the same in elements.

    Attributes:
        text: all of it, with what was added.
        file: where it comes from, for messages.
        folder: where its meshes are looked for; None if nobody knows.
        root: its root element.
        tree: links and joints.
        is_object: one rigid body that moves freely, or a hand fixed at its root.
        warnings: what is hardly meant.
    """

    text: str
    file: Path
    folder: Path | None
    root: Element
    tree: Tree
    is_object: bool
    warnings: tuple[Finding, ...]

    @classmethod
    def read(cls, file: str | Path, role: Role = EITHER) -> Urdf:
        """Read and check a file; one that was read before is checked again only if it, or one of its meshes, is other.

        Args:
            file: of the URDF; its meshes are looked for from its folder.
            role: what it shall be.

        Raises:
            ModelError: no such file, no XML, no URDF, or it describes no possible hand or object.
        """
        place = Path(file)
        return kept_urdf(read_text(place), place, role)

    @classmethod
    def parse(cls, text: str, file: Path, role: Role = EITHER, folder: Path | None = None) -> Urdf:
        """Check a text; meshes are not looked for without a folder. Raises as `read`."""
        return cls.of(examine(text, file, role, folder))

    @classmethod
    def of(cls, found: Examination) -> Urdf:
        """What an examination found to be sound.

        Raises:
            ModelError: a line for each error.
        """
        found.findings.raise_errors()
        assert found.tree is not None
        warnings = tuple(found.findings.warnings)
        return cls(found.text, found.file, found.folder, found.root, found.tree, found.is_object, warnings)

    @property
    def moving_joints(self) -> list[Joint]:
        """Those with a degree of freedom, from the root outward."""
        return [joint for joint in self.tree.joints if joint.is_moving]

    @property
    def ends(self) -> list[str]:
        """Links that carry no other."""
        carriers = {joint.parent for joint in self.tree.joints}
        return [name for name in self.tree.links if name not in carriers]

    def geometries(self, purpose: Purpose) -> list[Geometry]:
        """The visual or the collision shapes of all links."""
        return read_geometries(self.root, self.folder, purpose)

    def with_link(self, new: str, parent: str, child: str, position: Vector3, rpy: Vector3) -> Urdf:
        """One link more, at one end of one fixed joint more, at the end of the file.

        Args:
            new: name of the link; NEW_place is that of the joint.
            parent: the new link or the one that carries it.
            child: likewise.
            position: of the child in the frame of the parent [m].
            rpy: its roll, pitch, yaw there [rad].

        Raises:
            ModelError: one of the names is taken.
        """
        from xml.sax.saxutils import quoteattr  # which loads all of urllib

        name = f"{new}_place"
        taken = {element.get("name") for element in self.root if element.tag in ("link", "joint")}
        for word in (new, name):
            if word in taken:
                raise ModelError(
                    f"{self.file}: a link or joint is called '{word}' already; give the tip another name.",
                    file=str(self.file),
                )
        xyz, angles = (" ".join(map(repr, map(float, numbers))) for numbers in (position, rpy))
        added = (
            f'<link name={quoteattr(new)}/><joint name={quoteattr(name)} type="fixed">'
            f"<parent link={quoteattr(parent)}/><child link={quoteattr(child)}/>"
            f'<origin xyz="{xyz}" rpy="{angles}"/></joint>'
        )
        data, end = as_bytes(self.text), self.root.end
        link, joint = _read(added, self.file, 1 + data[:end].count(b"\n"))
        findings = Findings(self.file)
        check_place(joint, findings)
        fixed, is_root = Joint(joint, name, "fixed", parent, child), child == self.tree.root
        joints = [fixed, *self.tree.joints] if is_root else [*self.tree.joints, fixed]
        return replace(
            self,
            text=(data[:end] + as_bytes(added) + data[end:]).decode(),
            root=extended(self.root, [link, joint], len(as_bytes(added))),
            tree=Tree({**self.tree.links, new: link}, joints, new if is_root else self.tree.root),
            warnings=(*self.warnings, *findings),
        )


_KEPT = 32
_Meshes = tuple[tuple[str, Path | None, tuple[int, ...]], ...]
_kept: OrderedDict[tuple[str, Path, Role], tuple[Urdf, _Meshes]] = OrderedDict()


def kept_urdf(text: str, file: Path, role: Role) -> Urdf:
    """The text of a file, checked now or before; what is kept is never changed, and shared by all who ask."""
    key, folder = (text, file, role), file.parent
    known = _kept.get(key)
    if known is not None and all(_mesh(name, folder, role) == (found, written) for name, found, written in known[1]):
        return known[0]
    urdf = Urdf.parse(text, file, role, folder)
    names = {element.get("filename", "").strip() for element in urdf.root.iter("mesh")}
    _kept[key] = urdf, tuple((name, *_mesh(name, folder, role)) for name in names if name)
    while len(_kept) > _KEPT:
        _kept.popitem(last=False)
    return urdf


def _mesh(name: str, folder: Path, role: Role) -> tuple[Path | None, tuple[int, ...]]:
    """A mesh, and when it was written if masses are made from it."""
    found = find_mesh(name, folder)
    if found is None or role.density is None:
        return found, ()
    try:
        status = found.stat()
    except OSError:
        return found, ()
    return found, (status.st_mtime_ns, status.st_size)


def _read(added: str, file: Path, line: int) -> list[Element]:
    """The elements of a piece of text that stands in a line of a file."""
    parts = [part for part in read_document(f"<robot>{added}</robot>", file) if isinstance(part, Element)]
    for part in parts:
        for element in part.iter():
            assert isinstance(element, Element)
            element.line += line - 1
    return parts
