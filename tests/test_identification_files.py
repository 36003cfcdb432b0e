"""Files of measurements: units, the forms that laboratories write, what is refused, and files of strangers."""

from __future__ import annotations

import os
import random
from math import pi

import numpy as np
import pytest
from measured import script

import softhand
from softhand.errors import MeasurementError, SofthandError
from softhand.identification.files.table import MOST_ROWS
from softhand.identification.measurements import EXAMPLE, read_length, read_measurements


def write(folder, text):
    file = folder / "data.csv"
    file.write_text(text, encoding="utf-8")
    return file


def test_units_are_those_of_the_header(tmp_path):
    """The same row in two sets of units is the same measurement; the radius too."""
    one = read_measurements(
        [write(tmp_path, "# radius [mm] = 12\nphi [deg],dr [mm],dphi [deg],Fphi [N mm]\n60,3,10,25\n")]
    )
    two = read_measurements(
        [write(tmp_path, f"# radius = 0.012 m\nFphi [Nm];dphi [rad];dr [m];phi [rad]\n.025;{pi / 18};.003;{pi / 3}\n")]
    )
    for data in (one, two):
        assert data.deformation[0] == pytest.approx([0.003, 0.0, pi / 18, 0.0])
        assert (data.phi[0], data.force[0, 2], data.radius) == pytest.approx((pi / 3, 0.025, 0.012))
        assert np.isnan(data.force[0, [0, 1, 3]]).all()


def test_force_and_moment_are_short_names(tmp_path):
    """`force` is Fr; `moment` is the moment about the only angle of deformation."""
    data = read_measurements([write(tmp_path, "phi [deg],dr [mm],dpsi [deg],force [N],moment [N mm]\n90,3,10,11,7\n")])
    assert (data.force[0, 0], data.force[0, 3]) == pytest.approx((11.0, 0.007))


def test_files_are_joined(tmp_path):
    """Several files are one set of measurements, each with its own columns."""
    press, twist = tmp_path / "press.csv", tmp_path / "twist.csv"
    press.write_text("phi [deg],dr [mm],force [N]\n90,2,5\n")
    twist.write_text("phi [rad],dr [cm],dpsi [rad],moment [mN m]\n1.5,0.4,0.1,12\n")
    data = read_measurements([press, twist])
    assert data.deformation[:, 0] == pytest.approx([0.002, 0.004]) and len(data) == 2


HEAD = "phi [deg],dr [mm],Fr [N]\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("phi [deg],dr,Fr [N]\n90,1,1\n", ['"dr"', "no unit", "[mm]"]),
        ("phi [deg],dr [],Fr [N]\n90,1,1\n", ['"dr []"', "no unit"]),
        ("phi [deg],dr [mm],dphi [rad],Fr [N]\n90,1,0,1\n", ['"dphi [rad]"', '"phi [deg]"', "one unit"]),
        ("phi [deg],dr [mm],Fphi [N mm],Fpsi [N m]\n90,1,1,1\n", ['"Fpsi [N m]"', '"Fphi [N mm]"', "one unit"]),
        ("phi [deg],dr [mm],Fphi [N]\n90,1,1\n", ['"Fphi [N]"', "moment", "[N mm]"]),
        ("phi [deg],dr [inch],Fr [N]\n90,1,1\n", ['"dr [inch]"', "length", "[mm]"]),
        ("phi [deg],dr [mm],Fx [N]\n90,1,1\n", ['"Fx [N]"', "no known column"]),
        ("phi [deg],dr [mm],dr [mm],Fr [N]\n90,1,1,1\n", ['"dr [mm]"', "twice"]),
        ("dr [mm],Fr [N]\n1,1\n", ['"phi"', "missing"]),
        ("phi [deg],dr [mm]\n90,1\n", ["Fr, Ftheta, Fphi, Fpsi", "missing"]),
        ("phi [deg],dr [mm],moment [N mm]\n90,1,1\n", ['"moment"', "no angle"]),
        (HEAD + "90,1 mm,1\n", ["line 2", '"dr"', "1 mm"]),
        (HEAD + "90,,1\n", ["line 2", '"dr"', "empty cell"]),
        (HEAD + "90,1,nan\n", ["line 2", '"Fr"', "nan"]),
        (HEAD + "90,1\n", ["line 2", "2 cells", "3 columns"]),
        (HEAD + "1.5,1,1\n190,1,1\n", ["line 3", '"phi"', "190"]),
        ("# radius [mm] = 10\n" + HEAD + "90,12,1\n", ["line 3", '"dr"', "12"]),
        (HEAD, ["at least one row"]),
    ],
)
def test_a_file_that_is_not_clear_is_refused(tmp_path, text, words):
    """Each refusal names the file and the column or line."""
    with pytest.raises(MeasurementError) as caught:
        read_measurements([write(tmp_path, text)])
    for word in ["data.csv", *words]:
        assert word in str(caught.value)


@pytest.mark.parametrize("text", ["10", "-1 mm", "ten mm", "10 N", ""])
def test_a_radius_without_a_length_is_refused(text):
    """A radius is a positive number with a unit of length."""
    with pytest.raises(MeasurementError, match="--radius"):
        read_length(text, "--radius")


def test_the_example_is_what_its_script_makes_and_says_so():
    """The shipped file is the output of the script, and begins by saying that it was not measured."""
    text = EXAMPLE.read_text(encoding="utf-8")
    assert text == script().generate() and text.startswith("# GENERATED, NOT MEASURED")


# ---------------------------------------------------------------------------------------- as laboratories write them

ROWS = [(phi, dr, round(0.31 * dr * dr + 0.02 * phi, 3)) for phi in (60, 75) for dr in (0.5, 1.0, 2.5)]


def table(header, rows, separator=",", mark="."):
    """A file as text."""
    lines = [separator.join(str(number).replace(".", mark) for number in row) for row in rows]
    return "\n".join([separator.join(header), *lines]) + "\n"


PLAIN = table(["phi [deg]", "dr [mm]", "Fr [N]"], ROWS)
FORMS = {
    "decimal comma": "# radius [mm] = 10,0\n" + table(["phi [deg]", "dr [mm]", "Fr [N]"], ROWS, ";", ","),
    "tabs and decimal comma": "# radius = 10 mm\n" + table(["phi [deg]", "dr [mm]", "Fr [N]"], ROWS, "\t", ","),
    "round brackets": "# radius (mm) = 10\n" + table(["phi (deg)", "dr (mm)", "Fr (N)"], ROWS),
    "slashes": "# radius / mm = 10\n" + table(["phi / deg", "dr / mm", "Fr / N"], ROWS),
    "degree sign": "# radius [mm] = 10\n" + table(["phi [°]", "dr [mm]", "Fr [N]"], ROWS),
    "separators at the end": "# radius [mm] = 10\n" + table(["phi [deg]", "dr [mm]", "Fr [N]", ""], [
        (*row, "", "") for row in ROWS]),
    "spaces and capitals of exponents": "# radius [mm] = 1E1\n" + table(["phi [deg]", " dr [mm]", "Fr [N]"], [
        (f"{phi:.3E}", f"  {dr} ", force) for phi, dr, force in ROWS]),
    "minus sign of a text processor": "# radius [mm] = 10\n" + table(["phi [deg]", "dr [mm]", "Fr [N]"], [
        *ROWS, (60, "\N{MINUS SIGN}0.1", 0)]),
    "a byte order mark, DOS line ends": "\ufeff# radius [mm] = 10\r\n" + PLAIN.replace("\n", "\r\n"),
    "before touch": "# radius [mm] = 10\n" + table(["phi [deg]", "dr [mm]", "Fr [N]"], [
        (60, -0.4, 0.01), (60, -0.1, 0.0), *ROWS]),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_a_file_is_read_in_each_form(tmp_path, form):
    """The same measurements from all of them."""
    plain, found = read_measurements([write(tmp_path, PLAIN)]), read_measurements([write(tmp_path, FORMS[form])])
    assert found.radius == pytest.approx(0.010)
    assert found.imposed == pytest.approx(plain.imposed)
    assert np.array_equal(found.force, plain.force, equal_nan=True)
    touched = form in ("before touch", "minus sign of a text processor")
    assert ("before touch" in " ".join(found.notes)) == touched


def test_time_orders_nothing_but_parts_runs(tmp_path):
    """A time that falls begins a new run; a column of series says what the series are."""
    rows = [(t, phi, dr, 1.0) for phi in (60, 60) for t, dr in ((0.0, 1), (0.1, 2), (0.2, 3))]
    timed = read_measurements([write(tmp_path, table(["t [s]", "phi [deg]", "dr [mm]", "Fr [N]"], rows))])
    assert timed.runs.tolist() == [0, 0, 0, 1, 1, 1] and not timed.has_series
    named = read_measurements([write(tmp_path, table(["series", "phi [deg]", "dr [mm]", "Fr [N]"],
                                                     [(name, 60, 1.0, 1.0) for name in ("b", "a", "b")]))])  # fmt: skip
    assert named.runs.tolist() == [1, 0, 1] and named.has_series


def test_each_file_is_a_run_of_its_own(tmp_path):
    """Rows of different files are never one series; files with and without a column of series do not go together."""
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    one.write_text(PLAIN)
    two.write_text(PLAIN)
    assert read_measurements([one, two]).runs.tolist() == [0] * 6 + [1] * 6
    two.write_text(table(["series", "phi [deg]", "dr [mm]", "Fr [N]"], [(1, *row) for row in ROWS]))
    with pytest.raises(MeasurementError, match="series"):
        read_measurements([one, two])


def test_a_unit_of_time_is_needed_as_well(tmp_path):
    """As of every column."""
    with pytest.raises(MeasurementError, match=r"time.*\[s\]"):
        read_measurements([write(tmp_path, "time,phi [deg],dr [mm],Fr [N]\n0,60,1,1\n")])


HEADER = "# radius [mm] = 10\nphi [deg],dr [mm],Fr [N]\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEADER + "60,1,NaN\n", ["line 3", '"Fr"', "NaN", "leave the cell of a force empty"]),
        ("phi [deg];dr [mm];Fr [N]\n60;1,5;2.5\n", ["1,5", "2.5", "use one"]),
        (HEADER + "60,1,5,2,5\n", ["5 cells", "3 columns", "semicolons"]),
        (HEADER + "60,-1,1\n60,-2,4\n", ["line 3", '"dr"', "-1 mm", "turn the sign"]),
        ("phi,dr,Fr\ndeg,mm,N\n60,1,1\n", ['"phi"', "no unit", "[deg]"]),
        ("made on Monday\nphi [deg],dr [mm],Fr [N]\n60,1,1\n", ["made on Monday", "one column", "put # before lines"]),
        (HEADER + "60,1,1_0\n", ["1_0", "no finite number"]),
        (HEADER + '60,1,"1\n', ["line 3", "no row of CSV"]),
        (HEADER + "60,1,1\x1b[31m\n", ["\\u001b[31m", "no finite number"]),
        (HEADER + "60,1,2e7\n", ["2e+07 N", "unit"]),
        ("phi [deg],dr [mm],dphi [deg],Fr [N]\n60,1,400,1\n", ['"dphi"', "400 deg", "unit"]),
    ],
)  # fmt: skip
def test_what_a_laboratory_may_write_is_refused_with_the_remedy(tmp_path, text, words):
    """NaN, two decimal marks, commas of both kinds, a sign, lines above the header, units in a row of their own."""
    with pytest.raises(MeasurementError) as caught:
        read_measurements([write(tmp_path, text)])
    for word in words:
        assert word in str(caught.value)
    assert "\x1b" not in str(caught.value)


# --------------------------------------------------------------------------------------------------- of strangers

HUGE = {
    "a header of spaces": " " * 60_000 + "\n1,2\n",
    "spaces in a label": "phi [deg],dr [mm],Fr" + " " * 60_000 + "[N]\n60,1,1\n",
    "spaces in a remark": "# radius" + " " * 9_000 + "\n" + PLAIN.replace("\n60", " " * 9_000 + "\n60", 1),
    "a cell of 200 kB": HEADER + "60,1," + "1" * 200_000 + "\n",
    "a quoted cell of 200 kB": HEADER + '60,1,"' + "x" * 200_000 + '"\n',
    "numbers near 1e308": HEADER + "60,1,1.7e308\n60,2,1e308\n",
    "an integer of 5,000 digits": HEADER + "60,1," + "9" * 5000 + "\n",
    "a radius of 5,000 digits": "# radius [mm] = " + "9" * 5000 + "\n" + PLAIN,
    "a unit of 9,000 letters": "phi [deg],dr [mm],Fr [" + "N" * 9000 + "]\n60,1,1\n",
    "3,000 columns": ",".join(f"x{k}" for k in range(1500)) + "\n1\n",
    "zero bytes": HEADER + "60,1,\0" + "1\n",
    "too many rows": HEADER + "60,1,1\n" * (MOST_ROWS + 1),
    "nothing": "",
    "remarks only": "# one\n# two\n",
}


@pytest.mark.parametrize("what", HUGE)
def test_a_file_of_a_stranger_gives_one_short_error(tmp_path, what):
    """No traceback of another kind, and no message longer than what a console shows at a glance."""
    with pytest.raises(MeasurementError) as caught:
        softhand.identify(write(tmp_path, HUGE[what]))
    assert len(str(caught.value)) < 1000


def test_what_is_no_file_is_not_read(tmp_path):
    """A device without end, a pipe that nobody writes to, a folder, a path that cannot be: refused at once."""
    os.mkfifo(tmp_path / "pipe")
    for file, words in (("/dev/zero", "pipe or a device"), (tmp_path / "pipe", "pipe or a device"),
                        (tmp_path, "directory"), (tmp_path / "a\0b", "null")):  # fmt: skip
        with pytest.raises(MeasurementError, match=words):
            read_measurements([file])


def test_a_file_that_is_too_large_is_not_read_to_its_end(tmp_path):
    """A sparse file of 1 TB."""
    with open(tmp_path / "large.csv", "wb") as file:
        file.truncate(10**12)
    with pytest.raises(MeasurementError, match="longer than 16000000 bytes"):
        read_measurements([tmp_path / "large.csv"])


@pytest.mark.parametrize("force", ["1e-310", "1e-200", "999999"])
def test_numbers_of_any_size_make_no_nonsense(tmp_path, force):
    """Forces far below and far above those of tips: a fit of finite numbers, or an error."""
    text = HEADER + "".join(f"{phi},{dr},{float(force) * dr * dr}\n" for phi in (60, 75) for dr in (0.2, 0.5, 1.0))
    try:
        found = softhand.identify(write(tmp_path, text))
    except SofthandError:
        return
    assert np.isfinite(found.coefficients["k_r"].value) and found.coefficients["k_r"].value >= 0.0


SPICE = ["", "nan", "inf", "-", "1e999", "-1", "0", "90", "1,5", "1.5", ";", "\t", ",", '"', "[", "]", "(", ")", "/",
         "#", "\0", "é", "\u2028", "9" * 400, "=", "radius", "Fr [N]", "dr", "series", "time [s]", "\r", "\n",
         " " * 50]  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
def test_no_file_breaks_the_reader(tmp_path, seed):
    """Hundreds of mutated files: each is fitted to finite numbers or refused with an error of ours."""
    rng = random.Random(seed)
    seeds = [*FORMS.values(), HEADER + PLAIN.split("\n", 1)[1], EXAMPLE.read_text(encoding="utf-8")[:1500]]
    outcomes = set()
    for _ in range(60):
        text = list(rng.choice(seeds))
        for _ in range(rng.choice([1, 1, 2, 5, 20])):
            place = rng.randrange(len(text) + 1)
            text[place : place + rng.choice([0, 1, 1, 4, 30])] = rng.choice(SPICE)
        file = tmp_path / "data.csv"
        file.write_bytes("".join(text).encode("utf-8"))
        try:
            found = softhand.identify(file, radius="10 mm")
        except SofthandError as error:
            outcomes.add("refused")
            assert len(str(error)) < 1500
        else:
            outcomes.add("fitted")
            told = [estimate for estimate in found.coefficients.values() if estimate.is_fitted]
            assert told and all(np.isfinite(estimate.value) for estimate in told)
            found.to_json()
    assert outcomes == {"refused", "fitted"}
