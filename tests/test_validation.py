"""What is refused before Pinocchio sees it: broken URDFs one by one, and a good one changed at random."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from hands import BOX_URDF, HAND_URDF
from hypothesis import given, settings
from hypothesis import strategies as st

from softhand.errors import ModelError
from softhand.model.body import ObjectModel
from softhand.model.hand import HandModel
from softhand.model.urdf.document import LARGEST, read_text
from softhand.model.urdf.examination import HAND, OBJECT, Role, examine
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.model.world import load_world
from softhand.settings.toml import tomllib

DATA = Path(__file__).parent / "data"
BROKEN = sorted((DATA / "broken").glob("*.urdf"))
EXPECTED = tomllib.loads((DATA / "broken/expected.toml").read_text())
GOOD = DATA / "good.urdf"
GOOD_TEXT = GOOD.read_text()


def refusal(file: Path) -> ModelError:
    with pytest.raises(ModelError) as caught:
        Urdf.read(file)
    return caught.value


def model_of(text: str, role: Role = HAND, file: Path = GOOD, folder: Path | None = None) -> pin.Model:
    """The text checked and read by Pinocchio."""
    return build_model(Urdf.parse(text, file, role, folder))


# ---------------------------------------------------------------------------------------- broken files


def test_every_broken_file_has_its_message() -> None:
    """The table names each file once; there are more than 40."""
    assert {file.stem for file in BROKEN} == set(EXPECTED) and len(BROKEN) > 40


@pytest.mark.parametrize("file", BROKEN, ids=lambda file: file.stem)
def test_a_broken_file_is_refused_with_its_message(file: Path) -> None:
    """File, line, element, value and remedy, as the table has them; the same line as an attribute."""
    error = refusal(file)
    message = EXPECTED[file.stem].replace("FOLDER", str(file.parent))
    assert str(error).splitlines()[0] == f"{file}, {message}"
    assert error.file == str(file) and f"line {error.line}" in message


@pytest.mark.parametrize("file", BROKEN, ids=lambda file: file.stem)
def test_the_line_is_where_the_file_differs(file: Path) -> None:
    """The line of a message about one element holds this element."""
    tag = re.match(r"line (\d+), <([\w:]+)>", EXPECTED[file.stem])
    if tag:
        assert f"<{tag[2]}" in file.read_text().splitlines()[int(tag[1]) - 1]


def test_all_errors_of_a_file_are_told() -> None:
    """One line an error, in the order of the file."""
    text = GOOD_TEXT.replace('value="0.050"', 'value="0,05"').replace('xyz="0 1 0"', 'xyz="0 0 0"')
    with pytest.raises(ModelError) as caught:
        model_of(text)
    lines = str(caught.value).splitlines()
    assert len(lines) == 3 and "<axis>" in lines[0] and "<mass>" in lines[1] and "<mass>" in lines[2]


def test_many_errors_are_cut_short() -> None:
    """More than ten are counted."""
    links = "".join(f'<link name="l{k}"/>' for k in range(30))
    with pytest.raises(ModelError, match=r"and 19 more\.$") as caught:
        model_of(f"<robot name='many'>{links}</robot>")
    assert len(str(caught.value).splitlines()) == 11


def test_an_object_is_rigid() -> None:
    """A moving joint in an object is refused where it is."""
    with pytest.raises(ModelError, match=r"line 10, <joint> 'left_flexion'.*one rigid body"):
        model_of(GOOD_TEXT, OBJECT)


def test_an_object_has_a_mass(tmp_path: Path) -> None:
    """The root of an object must weigh, that of a hand need not."""
    text = '<robot name="air"><link name="air"/></robot>'
    with pytest.raises(ModelError, match="<link> 'air': no <inertial> in it"):
        model_of(text, OBJECT, tmp_path / "air.urdf")
    assert model_of(text, HAND, tmp_path / "air.urdf").nv == 0


def test_no_pinocchio_is_needed() -> None:
    """The checks run where Pinocchio is not installed."""
    program = (
        "import sys; sys.modules['pinocchio'] = None\n"
        "from softhand.model.urdf.examination import examine\n"
        f"print(len(examine(open({str(DATA / 'broken/zero_axis.urdf')!r}).read(), 'x').findings))"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "1"


# ---------------------------------------------------------------------------------------- good files


@pytest.mark.parametrize("file", sorted(HAND_URDF.parent.glob("*.urdf")), ids=lambda file: file.stem)
def test_nothing_is_found_in_what_ships(file: Path) -> None:
    """No error and no warning in the shipped URDFs."""
    assert list(examine(read_text(file), file, folder=file.parent).findings) == []


def test_nothing_is_found_in_the_good_file() -> None:
    """The broken files have only the mistake that they are named for."""
    assert list(examine(GOOD_TEXT, GOOD, folder=DATA).findings) == []
    assert model_of(GOOD_TEXT).nv == 2


def test_elements_of_other_programs_are_left_alone() -> None:
    """Gazebo, transmissions and sensors are no mistakes."""
    other = (
        '<gazebo reference="palm"><joint name="left_flexion" type="own"/><mu1>0.2</mu1></gazebo>'
        '<transmission name="t"><joint name="left_flexion"/><actuator name="a"/></transmission>'
        '<ros2_control name="c" type="system"/></robot>'
    )
    assert list(examine(GOOD_TEXT.replace("</robot>", other), GOOD).findings) == []


def test_rounded_numbers_are_taken() -> None:
    """A plate on the edge of the triangle inequality and an axis of four digits may be rounded."""
    text = GOOD_TEXT.replace('izz="16.0e-6"', 'izz="18.1e-6"').replace('xyz="0 0 -1"', 'xyz="0.7071 0 -0.7071"')
    assert list(examine(text, GOOD).findings) == []


def test_a_link_of_no_weight_is_taken_if_fixed_to_one_that_weighs() -> None:
    """Zero mass and zero inertia on a tip: a warning."""
    inertial = '<inertial><mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>'
    text = GOOD_TEXT.replace('<link name="right_tip"/>', f'<link name="right_tip">{inertial}</link>')
    findings = examine(text, GOOD).findings
    assert not findings.errors and "weighs nothing" in str(findings.warnings[0])
    assert model_of(text).nv == 2


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ('xyz="0.06 0 0"', 'xyz="50 0 0"', 31, "50 m long; is it in millimetres?"),
        ('length="0.06"', 'length="60"', 25, 'length="60" is more than 1 m'),
        ('size="0.10 0.04 0.02"', 'size="100 40 20"', 7, "is it in millimetres?"),
        ('radius="0.010"', 'radius="10"', 35, "is it in millimetres?"),
        ('rpy="0 -1.5707963 0"', 'rpy="0 -90 0"', 13, "is it in degrees?"),
        ('lower="-0.5" upper="1.2"', 'lower="-30" upper="70"', 15, "is it in degrees?"),
        ('lower="-0.02" upper="0.03"', 'lower="-20" upper="30"', 43, "is it in millimetres?"),
        ('value="0.050"', 'value="50"', 20, "is it in grams?"),
        ('ixx="2.0e-6" ixy="0" ixz="0" iyy="16.0e-6" iyz="0" izz="16.0e-6"',
         'ixx="2.0" ixy="0" ixz="0" iyy="16.0" iyz="0" izz="16.0"', 21, "radius of gyration is 1.79e+04 mm"),
        ('velocity="20.0"', 'velocity="0"', 15, "could not move"),
        ('velocity="20.0"/>', 'velocity="20.0"/><dynamics damping="0.1"/>', 15, "run free"),
        ('<box size="0.10 0.04 0.02"/>', '<mesh filename="palm.stl"/>', 7, "there is no such file"),
    ],
)  # fmt: skip
def test_what_is_hardly_meant_is_a_warning(old: str, new: str, line: int, words: str) -> None:
    """The file is read, and the warning has the line and the reason."""
    text = GOOD_TEXT.replace(old, new, 1)
    assert text != GOOD_TEXT
    findings = examine(text, GOOD, folder=DATA).findings
    assert not findings.errors
    assert [warning.line for warning in findings.warnings] == [line] and words in str(findings.warnings[0])
    model_of(text, folder=DATA)


def test_meshes_are_found_beside_the_file_and_by_package(tmp_path: Path) -> None:
    """A relative path starts at the URDF, package:// at a folder above; the current folder plays no part."""
    (tmp_path / "my_hand/meshes").mkdir(parents=True)
    (tmp_path / "my_hand/urdf").mkdir()
    (tmp_path / "my_hand/meshes/palm.stl").write_text("solid")
    names = ["../meshes/palm.stl", "package://my_hand/meshes/palm.stl", str(tmp_path / "my_hand/meshes/palm.stl")]
    for name in names:
        text = GOOD_TEXT.replace('<box size="0.10 0.04 0.02"/>', f'<mesh filename="{name}"/>')
        assert list(examine(text, GOOD, folder=tmp_path / "my_hand/urdf").findings) == []
    text = GOOD_TEXT.replace('<box size="0.10 0.04 0.02"/>', '<mesh filename="meshes/palm.stl"/>')
    assert len(examine(text, GOOD, folder=tmp_path / "my_hand/urdf").findings) == 1


def test_a_tip_may_have_the_name_of_a_joint(tmp_path: Path) -> None:
    """Where a link and a joint have one name, the tip is the link."""
    text = GOOD_TEXT.replace('name="left_mount"', 'name="right_tip"')
    file = tmp_path / "hand.urdf"
    file.write_text(text)
    world = load_world(HandModel.read(file, ["left_tip", "right_tip"]), ObjectModel.read(BOX_URDF))
    assert world.tips[1].joint == 2


def test_hand_and_object_may_share_names(tmp_path: Path) -> None:
    """A link of the object that is called like one of the hand is no mistake."""
    file = tmp_path / "box.urdf"
    file.write_text(BOX_URDF.read_text().replace('<link name="box">', '<link name="palm">'))
    assert load_world(HandModel.read(GOOD, ["left_tip", "right_tip"]), ObjectModel.read(file)).model.nv == 8


# ---------------------------------------------------------------------------------------- files at large


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    """A pipe, a device and a folder are no files."""
    os.mkfifo(tmp_path / "pipe.urdf")
    for file, what in ((tmp_path / "pipe.urdf", "no regular file"), (Path("/dev/zero"), "no regular file"),
                       (tmp_path, "is a directory")):  # fmt: skip
        with pytest.raises(ModelError, match=what):
            read_text(file)


def test_a_huge_file_is_not_read(tmp_path: Path) -> None:
    """More than a URDF can be is refused before it is parsed."""
    file = tmp_path / "huge.urdf"
    with file.open("wb") as stream:
        stream.truncate(LARGEST + 1)
    with pytest.raises(ModelError, match="longer than 8000000 bytes"):
        read_text(file)


@pytest.mark.parametrize("content", [b"\x00\x01\x02" * 100, b"\x89PNG\r\n\xff\xfe", "ünï".encode("latin-1"), b""])
def test_what_is_no_text_is_refused(content: bytes, tmp_path: Path) -> None:
    """Bytes of other files: one error, with the name."""
    file = tmp_path / "other.urdf"
    file.write_bytes(content)
    with pytest.raises(ModelError, match=r"other\.urdf"):
        Urdf.read(file)


def test_a_chain_without_end_is_refused() -> None:
    """More links than any hand has."""
    links = "".join(f'<link name="l{k}"/>' for k in range(1001))
    with pytest.raises(ModelError, match="1001 links; at most 1000"):
        model_of(f"<robot name='many'>{links}</robot>")


# ---------------------------------------------------------------------------------------- random mutations

PARTS = list(ElementTree.fromstring(GOOD_TEXT).iter())
WORDS = st.sampled_from(
    ["", "0", "-1", "nan", "inf", "-inf", "1e400", "1e-400", "1e300", "1e9", "-1e9", "1e-12", "50 g", "0,05", "0x1F",
     "1_0", "+.5e1", "1e", "palm", "left_tip", "universe", "root_joint", "\u0663", "0 0 1", "0 0 0", "1 1 1",
     "0 0 0 0", "revolute", "continuous", "prismatic", "fixed", "floating", "a" * 300, "&", "<"]
) | st.floats().map(repr) | st.text(max_size=8)  # fmt: skip
ATTRIBUTES = sorted({name for part in PARTS for name in part.attrib} | {"joint", "filename", "scale"})
TAGS = sorted({part.tag for part in PARTS} | {"mimic", "mesh", "dynamics", "capsule"})


def mutate(root: ElementTree.Element, draw: st.DrawFn) -> None:
    """One change: a value, an attribute, a tag, or an element gone, doubled or moved."""
    parts = list(root.iter())
    part = parts[draw(st.integers(0, len(parts) - 1))]
    deed = draw(st.sampled_from(["value", "value", "value", "drop", "add", "tag", "remove", "double", "move"]))
    if deed in ("value", "drop") and part.attrib:
        name = draw(st.sampled_from(sorted(part.attrib)))
        if deed == "value":
            part.set(name, draw(WORDS))
        else:
            del part.attrib[name]
    elif deed == "add":
        part.set(draw(st.sampled_from(ATTRIBUTES)), draw(WORDS))
    elif deed == "tag":
        part.tag = draw(st.sampled_from(TAGS))
    elif len(part):
        child = part[draw(st.integers(0, len(part) - 1))]
        if deed in ("remove", "move"):
            part.remove(child)
        if deed in ("double", "move"):
            others = [part] if deed == "double" else list(root.iter())
            others[draw(st.integers(0, len(others) - 1))].append(child)


@st.composite
def mutated_trees(draw: st.DrawFn) -> str:
    """The good file with one to three changes of its elements."""
    root = ElementTree.fromstring(GOOD_TEXT)
    for _ in range(draw(st.integers(1, 3))):
        mutate(root, draw)
    text = ElementTree.tostring(root, encoding="unicode")
    return "".join(character for character in text if character in "\t\n\r" or ord(character) >= 32)


@st.composite
def mutated_texts(draw: st.DrawFn) -> str:
    """The good file with pieces of its text cut out or put in."""
    text = GOOD_TEXT
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.integers(0, 12)))
        text = text[:start] + draw(WORDS) + text[end:]
    return text


def check_is_refused_or_sound(text: str, floating: bool) -> None:
    """Either one ModelError that names the file, or a model whose dynamics are numbers at any state."""
    try:
        urdf = Urdf.parse(text, GOOD, OBJECT if floating else HAND)
        model = build_model(urdf)
    except ModelError as error:
        assert str(error).startswith(str(GOOD))
        return
    more = urdf.with_link("added", "added", urdf.tree.root, (0.1, 0.0, 0.0), (0.0, 0.2, 0.0))
    assert list(Urdf.parse(more.text, GOOD).tree.links) == list(more.tree.links)
    data, rng = model.createData(), np.random.default_rng(0)
    for _ in range(3):
        q = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
        M = np.triu(pin.crba(model, data, q))
        M = M + np.triu(M, 1).T
        assert np.isfinite(M).all() and (np.diag(M) > 0.0).all()
        scale = np.sqrt(np.diag(M))
        assert model.nv == 0 or np.linalg.eigvalsh(M / np.outer(scale, scale))[0] > 0.0
        assert np.isfinite(pin.nonLinearEffects(model, data, q, rng.normal(size=model.nv))).all()


@settings(max_examples=400, deadline=None, derandomize=True)
@given(text=mutated_trees(), floating=st.booleans())
def test_a_mutated_tree_is_refused_or_sound(text: str, floating: bool) -> None:
    """No change of elements crashes the process or lets dynamics with NaN in."""
    check_is_refused_or_sound(text, floating)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(text=mutated_texts())
def test_a_mutated_text_is_refused_or_sound(text: str) -> None:
    """No change of the text crashes the process or lets dynamics with NaN in."""
    check_is_refused_or_sound(text, False)


NUMBERS = re.findall(r'"(-?[\d.e-]+)"', GOOD_TEXT)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(
    index=st.integers(0, len(NUMBERS) - 1),
    value=st.floats(allow_nan=False, allow_infinity=False, width=64),
    scale=st.sampled_from([1.0, 1e-3, 1e3, 1e-9]),
)
def test_any_number_is_refused_or_sound(index: int, value: float, scale: float) -> None:
    """A single number replaced by any finite one."""
    count = iter(range(len(NUMBERS)))
    text = re.sub(
        r'"(-?[\d.e-]+)"', lambda match: f'"{value * scale!r}"' if next(count) == index else match[0], GOOD_TEXT
    )
    check_is_refused_or_sound(text, False)
