"""Reports: one file, no network; film, cursors and scrub bar on one clock, in a real Chromium."""

import base64
import dataclasses
import errno
import io
import json
import re
import zlib
from pathlib import Path

import numpy as np
import pytest
from chromium import needs_chromium, open_coarse
from commands import run_command
from PIL import Image

import softhand
from softhand import Recording, RecordingError, load_scenario, simulate, write_report
from softhand.recording.events import find_events
from softhand.viewer.report.curves import samples_of
from softhand.viewer.report.packing import frames_of
from softhand.viewer.report.report import report_page
from softhand.viewer.scene.recorded import RecordedScene
from softhand.viewer.scene.scales import shared_scales

MOST_BYTES = 8_000_000
NUMBERS = {"f4": "<f4", "i4": "<i4", "i2": "<i2", "u1": "|u1"}
PANELS = 9 + 4 + 5 + 3
RATE = 15.0  # frames a second in the pages that a browser opens: a quarter of those of a report
FEW = {"most": 2}  # frames, where the curves alone are looked at


@pytest.fixture(scope="module")
def run() -> Recording:
    return simulate(load_scenario("target-a"))


@pytest.fixture(scope="module")
def other() -> Recording:
    return simulate(load_scenario("target-b"))


def cut(recording: Recording, samples: int, **changes) -> Recording:
    """The beginning of a recording."""
    variables = {name: array[:samples] for name, array in recording.variables.items()}
    return dataclasses.replace(recording, variables=variables, **changes)


@pytest.fixture(scope="module")
def stopped(run) -> Recording:
    reason = "finger_2_tip rolls over its <apex>"
    return cut(run, 801, complete=False, reason=reason, stop_time=0.8)


@pytest.fixture(scope="module")
def brief(run) -> Recording:
    """Eleven samples, for claims that need no more."""
    return cut(run, 11, stop_time=0.01)


def replaced(recording: Recording, **arrays) -> Recording:
    """The recording with other arrays."""
    return dataclasses.replace(recording, variables={**recording.variables, **arrays})


def slipping(recording: Recording) -> Recording:
    """The recording with a slip of 3 ms of its second tip at 0.508 s, and one of 1 ms at 1.2 s."""
    slips = np.zeros_like(recording.is_slipping)
    slips[508:511, 1] = slips[1200, 1] = 1
    return replaced(recording, is_slipping=slips)


@pytest.fixture(scope="module")
def files(run, stopped, tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("a folder, with blanks & umläuts")
    shown = {"one": (run,), "stopped": (stopped,), "slipped": (slipping(run),), "both": (slipping(run), stopped)}
    for name, recordings in shown.items():
        (folder / f"{name}.html").write_text(report_page(recordings, RATE), "utf-8")
    return {name: folder / f"{name}.html" for name in shown}


@pytest.fixture(scope="module")
def pages(browser, files):
    """The page of each report that a test has opened before, closed after the last."""
    opened: dict = {}
    yield opened
    for page in opened.values():
        page.close()


RESET = """(() => {
  document.querySelectorAll('.layers input').forEach((box) => box.checked || box.click());
  document.querySelectorAll('.film .views button:first-child').forEach((button) => button.click());
  softhand.setTime(0);
})()"""


@pytest.fixture
def visit(browser, files, pages):
    """Function that shows a report from its start, all layers on, from the usual side."""

    def show(name: str):
        if name not in pages:
            pages[name] = open_coarse(browser, 1400, 900)
            open_page(pages[name], files[name])
        pages[name].evaluate(RESET)
        return pages[name]

    return show


def open_page(page, file: Path, hash: str = "") -> None:
    page.open(file.as_uri() + hash)
    page.evaluate("softhand.ready.then(() => true)")


def film(page, number=0) -> np.ndarray:
    """Pixels of a film, shape (height, width, 3)."""
    script = f"document.querySelectorAll('.film canvas')[{number}].toDataURL('image/png')"
    data = base64.b64decode(page.evaluate(script).partition(",")[2])
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


def films(page) -> list[np.ndarray]:
    return [film(page, number) for number in range(2)]


def colours(picture: np.ndarray) -> int:
    """How many different ones there are."""
    return len(np.unique(picture @ [65536, 256, 1]))


def differs(one, two) -> float:
    """Share of the pixels that differ visibly."""
    return float(np.mean(np.abs(one - two).max(axis=2) > 24))


def box_of(page, script: str) -> dict:
    return page.evaluate(f"{script}.getBoundingClientRect().toJSON()")


def click(page, x, y):
    for kind in ("mousePressed", "mouseReleased"):
        page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)


def drag(page, start, end):
    page.call("Input.dispatchMouseEvent", type="mousePressed", x=start[0], y=start[1], button="left", clickCount=1)
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=end[0], y=end[1], button="left", buttons=1)
    page.call("Input.dispatchMouseEvent", type="mouseReleased", x=end[0], y=end[1], button="left")


def data_of(html: str) -> dict:
    """What a page is told, its arrays inflated."""
    data = json.loads(re.search(r'id="data">(.*?)</script>', html, re.DOTALL)[1])
    return {**data, "arrays": zlib.decompress(base64.b64decode(data["arrays"]))}


def array_of(data: dict, place: dict) -> np.ndarray:
    return np.frombuffer(data["arrays"], NUMBERS[place["type"]], place["count"], place["start"])


def panel_of(data: dict, title: str) -> dict:
    (panel,) = [panel for block in data["blocks"] for panel in block["panels"] if panel["title"] == title]
    return panel


# --------------------------------------------------------------------------------------------------- in Chromium


@needs_chromium
@pytest.mark.parametrize("name", ["one", "both", "stopped"])
def test_it_opens_from_disk_without_an_error_and_asks_for_nothing(visit, files, name):
    """The only address asked for is the file itself; the console has no error."""
    page = visit(name)
    page.evaluate("softhand.setTime(0.3)")
    assert page.requests == [files[name].as_uri()] and page.console_errors == []


@needs_chromium
def test_the_film_shows_something_that_moves(visit):
    """The canvas has many colours, and another picture at another time."""
    page = visit("one")
    start = film(page)
    assert colours(start) > 200
    page.evaluate("softhand.setTime(1.5)")
    assert differs(start, film(page)) > 0.01
    page.evaluate("softhand.setTime(0.0)")
    assert differs(start, film(page)) == 0.0


@needs_chromium
def test_the_scrub_bar_moves_film_and_cursors_together(visit):
    """A click at three quarters of the bar: clock, cursor of each curve and film go there."""
    page = visit("one")
    start = film(page)
    box = box_of(page, "document.querySelector('.scrub')")
    click(page, box["x"] + 0.75 * box["width"], box["y"] + 0.5 * box["height"])
    assert page.evaluate("softhand.time()") == pytest.approx(1.5, abs=0.05)
    places = page.evaluate(
        "[...document.querySelectorAll('.chart')].map((c) => {"
        "const a = c.querySelector('.area').getBoundingClientRect(), b = c.querySelector('.cursor');"
        "return (b.getBoundingClientRect().x - a.x - 38) / (a.width - 46)})"
    )
    assert len(places) == PANELS
    assert np.allclose(places, page.evaluate("softhand.time()") / 2.0, atol=0.02)
    assert differs(start, film(page)) > 0.01


@needs_chromium
def test_a_click_on_a_curve_goes_to_its_time(visit):
    """The middle of a panel is the middle of the run; the scrub bar goes along."""
    page = visit("one")
    box = box_of(page, "document.querySelector('.area')")
    click(page, box["x"] + 38 + 0.5 * (box["width"] - 46), box["y"] + 20)
    assert page.evaluate("softhand.time()") == pytest.approx(1.0, abs=0.02)
    assert float(page.evaluate("document.querySelector('.scrub').value")) == pytest.approx(1.0, abs=0.02)


@needs_chromium
def test_the_readout_is_the_value_at_the_cursor(visit, run):
    """Normal forces at 0.8 s as in the recording, to the digits shown."""
    page = visit("one")
    page.evaluate("softhand.setTime(0.8)")
    shown = page.evaluate(
        "[...[...document.querySelectorAll('.chart')].find((c) => c.querySelector('b').textContent === 'normal force')"
        ".querySelectorAll('.values span')].map((s) => s.textContent)"
    )
    expected = run.contact_force[np.searchsorted(run.time, 0.8), :, 2]
    assert np.allclose(list(map(float, shown)), expected, rtol=6e-3)


@needs_chromium
@pytest.mark.parametrize(("hash", "time"), [("#t=1.2", 1.2), ("#t=99", 2.0), ("#t=noon", 0.0)])
def test_an_address_leads_to_a_time(coarse_page, files, hash, time):
    """report.html#t=1.2 opens at 1.2 s; a time beyond the end is the end; nonsense is the start."""
    page = coarse_page(500, 300)
    open_page(page, files["one"], hash)
    assert page.evaluate("softhand.time()") == time


PLAY = """(() => {
  let now = 1000, next = null;
  const clock = [performance.now, window.requestAnimationFrame];
  performance.now = () => now;
  window.requestAnimationFrame = (draw) => (next = draw);
  const button = document.querySelector('.play'), speed = document.querySelector('.speed'), seen = [];
  const note = () => seen.push([softhand.time(), button.classList.contains('on')]);
  softhand.setTime(1.0);
  speed.value = '0.5';
  speed.dispatchEvent(new Event('change'));
  button.click();
  for (const wait of [0, 400, 800, 700, 500]) {
    now += wait;
    const draw = next;
    next = null;
    if (draw) draw(now);
    note();
  }
  [performance.now, window.requestAnimationFrame] = clock;
  speed.value = '1';
  speed.dispatchEvent(new Event('change'));
  return seen;
})()"""


@needs_chromium
def test_it_plays_at_the_speed_asked_for_and_stops_at_the_end(visit):
    """Half as fast: 0.4 s of the clock are 0.2 s of the run; at the end the button shows play again."""
    seen = visit("one").evaluate(PLAY)
    assert [time for time, _ in seen] == pytest.approx([1.0, 1.2, 1.6, 1.95, 2.0])
    assert [is_playing for _, is_playing in seen] == [True, True, True, True, False]


@needs_chromium
def test_a_layer_can_be_hidden(visit):
    """Without links the picture differs, and with them again it is the same."""
    page = visit("one")
    switch = "[...document.querySelectorAll('.layers label')].find((l) => l.textContent === 'Links').click()"
    before = film(page)
    page.evaluate(switch)
    assert differs(before, film(page)) > 0.02
    page.evaluate(switch)
    assert differs(before, film(page)) == 0.0


ROWS = "[...document.querySelectorAll('.events button')]"


@needs_chromium
def test_a_click_on_an_event_leads_to_it(visit, run):
    """All events are listed with time, kind, finger and figures; the film shows the slip at its first instant."""
    page = visit("slipped")
    rows = page.evaluate(f"{ROWS}.map((row) => [...row.children].map((cell) => cell.textContent))")
    expected = find_events(slipping(run))
    assert [row[1] for row in rows] == [event.kind for event in expected]
    k = next(k for k, event in enumerate(expected) if event.kind == "slip")
    assert rows[k] == ["0.508 s", "slip", "finger 2 tip", expected[k].text]
    start = film(page)
    box = box_of(page, f"{ROWS}[{k}]")
    click(page, box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    assert page.evaluate("softhand.time()") == pytest.approx(0.508)
    assert page.evaluate("document.querySelector('.film .slip').textContent") == "slipping: finger 2"
    assert differs(start, film(page)) > 0.01
    assert page.evaluate(f"{ROWS}.findIndex((row) => row.hasAttribute('aria-current'))") == k


@needs_chromium
def test_the_mark_of_a_slip_appears_with_it_and_goes(visit):
    """Not before the slip, and no longer than a tenth of a second after; no mark if its layer is hidden."""
    page = visit("slipped")
    said = page.evaluate(
        "[0.45, 0.508, 0.55, 0.6, 0.65, 1.1, 1.2, 1.28, 1.35].map((time) => { softhand.setTime(time);"
        "return document.querySelector('.film .slip').textContent; })"
    )
    assert said == ["", *["slipping: finger 2"] * 3, "", "", *["slipping: finger 2"] * 2, ""]
    page.evaluate("softhand.setTime(0.55)")
    with_mark = film(page)
    page.evaluate("[...document.querySelectorAll('.layers label')].find((l) => l.textContent === 'Slip').click()")
    assert differs(with_mark, film(page)) > 0.0005
    assert page.evaluate("document.querySelector('.film .slip').textContent") == ""


@needs_chromium
def test_keys_go_through_the_events(visit):
    """Down and up take the film along, End is the last event; space goes to the event and plays nothing."""
    page = visit("slipped")

    def press(key, text=""):
        for kind in ("keyDown", "keyUp"):
            page.call("Input.dispatchKeyEvent", type=kind, key=key, code=key if text == "" else "Space", text=text)

    times = page.evaluate("data.runs[0].events.map((event) => event.time)")
    page.evaluate(f"{ROWS}[0].focus()")
    assert page.evaluate(f"{ROWS}.map((row) => row.tabIndex)") == [0] + [-1] * (len(times) - 1)
    for key, k in (("ArrowDown", 1), ("ArrowDown", 2), ("ArrowUp", 1), ("End", -1), ("Home", 0)):
        press(key)
        assert page.evaluate("softhand.time()") == pytest.approx(times[k])
        assert page.evaluate("document.activeElement.tabIndex") == 0
    page.evaluate("softhand.setTime(1.0)")
    press(" ", " ")
    assert page.evaluate("softhand.time()") == pytest.approx(times[0])
    assert not page.evaluate("document.querySelector('.play').classList.contains('on')")
    press("ArrowRight")
    assert page.evaluate("softhand.time()") == pytest.approx(times[0] + 1 / 60)


@needs_chromium
def test_events_of_several_runs_are_one_list(visit):
    """In the order of time, each with the letter of its run; the legend says what any run shows."""
    page = visit("both")
    rows = page.evaluate(f"{ROWS}.map((row) => [row.children[0].textContent, parseFloat(row.children[1].textContent)])")
    assert {label for label, _ in rows} == {"A", "B"} and [time for _, time in rows] == sorted(time for _, time in rows)
    legend = page.evaluate("document.querySelector('.facts .legend').innerText")
    assert "Slipping, now or in the last" in legend and "a real tip would slip" in legend
    page.evaluate("softhand.setTime(0.55)")
    said = page.evaluate("[...document.querySelectorAll('.film .slip')].map((mark) => mark.textContent)")
    assert said == ["slipping: finger 2", ""]


@needs_chromium
def test_without_events_there_is_no_list(visit, run):
    """A run in which nothing happens, and no word of events or slip."""
    assert find_events(run) == []
    page = visit("one")
    assert page.evaluate("document.querySelector('.events').hidden")
    assert "Events" not in page.evaluate("document.body.innerText")
    assert "lipping" not in page.evaluate("document.body.innerText")


@needs_chromium
def test_a_long_list_scrolls(coarse_page, run, tmp_path):
    """Sixty slips do not push the numbers off the page."""
    slips = np.zeros_like(run.is_slipping)
    slips[20::33, 0] = 1
    html = report_page([replaced(run, is_slipping=slips)], most=2)
    (tmp_path / "long.html").write_text(html, "utf-8")
    page = coarse_page(1400, 900)
    open_page(page, tmp_path / "long.html")
    inner, shown, bottom = page.evaluate(
        "(() => { const list = document.querySelector('.events ol'), facts = document.querySelector('.facts');"
        "return [list.scrollHeight, list.clientHeight, facts.getBoundingClientRect().bottom] })()"
    )
    assert inner > 5 * shown and bottom <= 900


@needs_chromium
def test_two_runs_share_clock_and_camera(visit):
    """Setting the time moves both films; turning the second turns the first."""
    page = visit("both")
    before = films(page)
    page.evaluate("softhand.setTime(1.0)")
    later = films(page)
    assert min(map(differs, before, later)) > 0.005
    box = box_of(page, "document.querySelectorAll('.film canvas')[1]")
    drag(page, (box["x"] + 80, box["y"] + 150), (box["x"] + 180, box["y"] + 150))
    assert min(map(differs, later, films(page))) > 0.02


@needs_chromium
@pytest.mark.parametrize("size", [(1440, 900), (1024, 768)])
def test_two_runs_have_room_on_any_screen(coarse_page, files, size):
    """The table of numbers is there, no curve is a sliver, no panel leaves its card, nothing is wider than the page."""
    page = coarse_page(*size)
    open_page(page, files["both"])
    table, areas, beyond, width = page.evaluate(
        "(() => { const height = (e) => e.getBoundingClientRect().height;"
        "const bottom = (e) => e.getBoundingClientRect().bottom;"
        "const cards = [...document.querySelectorAll('.block')];"
        "return [height(document.querySelector('.facts')), [...document.querySelectorAll('.area')].map(height),"
        "cards.map((c) => bottom(c.lastElementChild) - bottom(c)), document.documentElement.scrollWidth] })()"
    )
    assert table > 150 and len(areas) == 21 and min(areas) > 75
    assert max(beyond) <= 0 and width <= size[0]


@needs_chromium
def test_each_run_has_its_row_of_values(coarse_page, run, other, tmp_path):
    """At the cursor, in every panel, beside the name of the run."""
    (tmp_path / "two.html").write_text(report_page((run, other), **FEW), "utf-8")
    page = coarse_page(1400, 900)
    open_page(page, tmp_path / "two.html", "#t=0.8")
    rows = page.evaluate(
        "[...document.querySelectorAll('.chart')].map((c) => [c.querySelector('figcaption b').textContent,"
        "[...c.querySelectorAll('.row')].map((r) => [...r.querySelectorAll('b, span span')]"
        ".map((s) => s.textContent))])"
    )
    assert all([row[0] for row in of_panel] == ["A", "B"] for _, of_panel in rows)
    for row, recording in zip(dict(rows)["normal force"], (run, other), strict=True):
        expected = recording.contact_force[np.searchsorted(recording.time, 0.8), :, 2]
        assert np.allclose(list(map(float, row[1:])), expected, rtol=6e-3)


@needs_chromium
def test_no_curve_of_one_run_looks_like_that_of_another(visit):
    """Neither by its colour nor by its dashes; and no badge has the colour of another."""
    page = visit("both")
    looks = page.evaluate(
        "clock.charts.map((chart) => chart.curves.filter((c) => !c.desired)"
        ".map((c) => [c.run, c.color, String(c.dash)]))"
    )
    for curves in looks:
        first, second = ({tuple(look) for run, *look in curves if run == k} for k in (0, 1))
        assert not {color for color, _ in first} & {color for color, _ in second}
        assert not {dash for _, dash in first} & {dash for _, dash in second}
    badges = page.evaluate(
        "[...document.querySelectorAll('.badge')].map((b) => [b.textContent, getComputedStyle(b).backgroundColor])"
    )
    assert len({tuple(badge) for badge in badges}) == len({color for _, color in badges}) == 2


@needs_chromium
def test_an_incomplete_run_says_so_and_plays_as_far_as_it_goes(visit):
    """Where and why it stopped is on the page; the clock ends there."""
    page = visit("stopped")
    page.evaluate("softhand.setTime(1.5)")
    text = page.evaluate("document.body.innerText")
    assert "Incomplete, stopped at 0.8 s: finger_2_tip rolls over its <apex>" in text
    assert page.evaluate("softhand.time()") == pytest.approx(0.8)


@needs_chromium
def test_a_shorter_run_waits_for_the_longer(visit):
    """After its end the film of the shorter run stands still, that of the longer goes on."""
    page = visit("both")
    page.evaluate("softhand.setTime(0.8)")
    before = films(page)
    page.evaluate("softhand.setTime(1.0)")
    assert differs(before[0], film(page, 0)) > 0.0
    assert differs(before[1], film(page, 1)) == 0.0


@needs_chromium
def test_without_3d_graphics_the_curves_stay(new_page, files):
    """Where WebGL is off, the page says so and the rest works."""
    page = new_page()
    page.call(
        "Page.addScriptToEvaluateOnNewDocument",
        source="const real = HTMLCanvasElement.prototype.getContext; HTMLCanvasElement.prototype.getContext ="
        "function (kind, ...rest) { return /webgl/.test(kind) ? null : real.call(this, kind, ...rest); };",
    )
    page.open(files["one"].as_uri() + "#t=0.5")
    assert page.evaluate("softhand.ready.then(() => softhand.time())") == 0.5
    assert "shows no 3-D graphics" in page.evaluate("document.body.innerText")
    assert page.evaluate("document.querySelectorAll('.chart').length") == PANELS


@needs_chromium
def test_it_shows_in_a_frame(new_page, files):
    """As in a notebook: a frame around the file shows film and curves, without an error."""
    around = files["one"].with_name("notebook.html")
    around.write_text(f"<iframe src='{files['one'].name}' width=1000 height=700></iframe>")
    page = new_page(1100, 800)
    page.open(around.as_uri())
    for _ in range(50):
        picture = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))[100:500, 100:900]
        if colours(picture.astype(int)) > 200:
            break
    assert colours(picture.astype(int)) > 200 and page.console_errors == []


@needs_chromium
def test_words_of_a_scenario_are_words(coarse_page, brief, tmp_path):
    """A description with markup is shown, not run."""
    words = '</script><script>window.broken = 1</script><img src=x onerror="window.broken = 1">'
    hostile = dataclasses.replace(brief, scenario=f"description = '{words}'\n" + brief.scenario.split("\n", 1)[1])
    (tmp_path / "hostile.html").write_text(report_page([hostile]), "utf-8")
    page = coarse_page()
    open_page(page, tmp_path / "hostile.html")
    assert page.evaluate("document.querySelector('h1').textContent") == words
    assert page.evaluate("window.broken === undefined") and page.console_errors == []


# ------------------------------------------------------------------------------------------------------ the file


@pytest.fixture(scope="module")
def written(run, other, tmp_path_factory) -> tuple[Path, list[float]]:
    """The report of two runs as `write_report` writes it, and the progress that it told."""
    file, told = tmp_path_factory.mktemp("written") / "report.html", []
    write_report(file, run, other, progress=told.append)
    return file, told


@pytest.fixture(scope="module")
def two(written) -> dict:
    """The data in the report of two runs."""
    return data_of(written[0].read_text("utf-8"))


def test_it_is_small(written):
    """Twice two seconds of a hand with three fingers take less than 8 MB."""
    assert written[0].stat().st_size < MOST_BYTES


def test_the_curves_are_those_of_the_recording(two, run):
    """Each curve of position and torsion, in the unit that its panel names."""
    time = array_of(two, two["runs"][0]["times"])
    rows = np.searchsorted(run.time, time - 1e-6)
    assert time[-1] == pytest.approx(run.time[-1])

    def curves(title: str) -> list[np.ndarray]:
        return [array_of(two, curve["values"]) for curve in panel_of(two, title)["curves"] if curve["run"] == 0]

    x, desired = curves("x")
    assert panel_of(two, "x")["unit"] == "mm" and np.allclose(x, 1e3 * run.object_position[rows, 0], rtol=1e-6)
    assert np.allclose(desired, 1e3 * run.object_position_desired[rows, 0], rtol=1e-6)
    latitude, torsion = np.transpose(curves("latitude Φ")), np.transpose(curves("torsion"))
    assert np.allclose(latitude, np.degrees(run.contact_angles[rows, :, 1]), rtol=1e-6)
    assert np.allclose(torsion, 1e3 * run.contact_force[rows, :, 3], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("number", [0, 1])
def test_the_film_is_that_of_the_recording(two, run, other, number):
    """Pose of the object and shape of a soft fingertip in the page are those of the scene, to a micrometre."""
    recording = (run, other)[number]
    scene = RecordedScene(recording, shared_scales([run, other]))
    film = two["runs"][number]["film"]
    times = array_of(two, film["times"])
    k = len(times) // 3
    updates = scene.frame(int(np.argmin(np.abs(recording.time - times[k]))))
    compared = {"poses": 0, "shapes": 0}
    for item, update in zip(film["items"], updates, strict=True):
        if "poses" in item:
            poses = array_of(two, item["poses"]).reshape(-1, 3, 4)
            assert np.allclose(poses[k if len(poses) > 1 else 0], update.pose[:3], atol=1e-6)
            compared["poses"] += len(poses) > 1
        if "shapes" in item and item["layer"] == "tips":
            steps = array_of(two, item["shapes"]).reshape(-1, len(times))
            vertices = array_of(two, item["vertices"]) + item["scale"] * steps[:, : k + 1].sum(axis=1)
            assert np.allclose(vertices, np.reshape(update.vertices, -1), atol=2e-6)
            compared["shapes"] += 1
    assert compared["poses"] > 10 and compared["shapes"] >= 3


def test_two_runs_have_one_scale(two, run, other):
    """Equal forces look equal: the same legend, and arrows in one proportion to their forces."""
    films = [shown["film"] for shown in two["runs"]]
    assert films[0]["legend"] == films[1]["legend"]
    scale = []
    for film, recording in zip(films, (run, other), strict=True):
        items = {item["name"]: item for item in film["items"]}
        last = {}
        for part in ("shaft", "head"):
            poses = array_of(two, items[f"forces/finger_1_tip_{part}"]["poses"]).reshape(-1, 3, 4)
            last[part] = np.linalg.norm(poses[-1, :, 2])
        scale.append(sum(last.values()) / np.linalg.norm(recording.contact_force[-1, 0, :3]))
    assert scale[0] == pytest.approx(scale[1], rel=1e-5)


def test_a_frame_is_the_nearest_sample(run):
    """60 frames a second of 2 s, first and last among them; at most as many as allowed."""
    frames = frames_of(run, 60.0, 600)
    assert len(frames) == 121 and (frames[0], frames[-1]) == (0, len(run) - 1)
    assert np.allclose(run.time[frames], np.arange(121) / 60.0, atol=0.5e-3 + 1e-9)
    assert len(frames_of(run, 60.0, 50)) == 50
    assert frames_of(cut(run, 1), 60.0, 600).tolist() == [0]


def test_a_report_has_sixty_frames_a_second(two):
    """Of each run."""
    assert [array_of(two, shown["film"]["times"]).size for shown in two["runs"]] == [121, 121]


def test_the_numbers_and_versions_are_there(two, run, other):
    """Figures of the summary, scenario and version of each run."""
    assert two["version"] == softhand.__version__
    for shown, recording in zip(two["runs"], (run, other), strict=True):
        rows = softhand.summarize(recording).rows()
        assert [tuple(fact) for fact in shown["facts"][1:]] == rows
        assert shown["scenario"] == recording.scenario and shown["version"] == recording.version


def test_notes_are_on_the_page(run):
    """Friction use above 1 is told in words, and its panel is marked."""
    use = run.friction_use.copy()
    use[900, 1] = 1.7
    data = data_of(report_page([replaced(run, friction_use=use)], **FEW))
    panel = panel_of(data, "friction use")
    assert "1.7" in data["runs"][0]["notes"][0] and panel["note"] == "above 1" and panel["limit"] == 1.0


def test_one_sample_is_enough(run):
    """A run that was interrupted at once still gives a page."""
    assert data_of(report_page([cut(run, 1, complete=False, reason="interrupted", stop_time=0.0)]))["end"] > 0.0


@pytest.mark.parametrize(("count", "words"), [(0, "1 to 4 runs, not 0"), (5, "1 to 4 runs, not 5")])
def test_the_number_of_runs_is_limited(run, tmp_path, count, words):
    """No run, or more than lines can tell apart."""
    with pytest.raises(RecordingError, match=words):
        write_report(tmp_path / "report.html", *[run] * count)


def test_an_empty_recording_is_refused(run, tmp_path):
    """Without a sample there is nothing to show."""
    with pytest.raises(RecordingError, match="at least one sample"):
        write_report(tmp_path / "report.html", cut(run, 0))


def test_a_recording_without_its_urdfs_is_refused(run, tmp_path):
    """A file of an older version is told apart in one line; nothing is written."""
    with pytest.raises(RecordingError, match="URDF"):
        write_report(tmp_path / "report.html", dataclasses.replace(run, hand_urdf="", object_urdf=""))
    assert not list(tmp_path.iterdir())


def test_a_full_disk_leaves_the_older_report(brief, tmp_path, monkeypatch):
    """The older file stays as it was, and no half of a new one."""

    def fail(path: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    (tmp_path / "report.html").write_bytes(b"older")
    monkeypatch.setattr(Path, "write_bytes", fail)
    with pytest.raises(RecordingError, match="No space left on device"):
        write_report(tmp_path / "report.html", brief)
    assert [file.read_bytes() for file in tmp_path.iterdir()] == [b"older"]


def test_a_folder_that_is_missing_is_told_first(run, tmp_path):
    """Before the work, not after."""
    told = []
    with pytest.raises(RecordingError, match="choose a folder that exists"):
        write_report(tmp_path / "nowhere" / "report.html", run, progress=told.append)
    assert told == []


def test_a_recording_writes_its_report(brief, tmp_path):
    """`recording.to_html` is `write_report`, for one run or several."""
    later = replaced(brief, object_position=brief.object_position + 1e-3)
    brief.to_html(tmp_path / "one.html", later)
    write_report(tmp_path / "two.html", brief, later)
    assert (tmp_path / "one.html").read_bytes() == (tmp_path / "two.html").read_bytes()


def test_progress_rises_to_the_end(written):
    """From 0 to 1 over all runs."""
    _, told = written
    assert told == sorted(told) and told[0] > 0.0 and told[-1] == 1.0


def test_slip_is_marked_on_the_use_of_the_limit():
    """Where a tip slips, at the samples shown, its curve has bars; the panel says what they are."""
    recording = simulate(load_scenario("target-a", {"fingertip.contact": "coulomb", "duration": 0.8}))
    panel = panel_of(data_of(report_page([recording], **FEW)), "limit-surface use")
    slipping = recording.is_slipping[samples_of(recording)]
    assert slipping.any() and panel["note"] == "slip"
    assert [curve["bars"] for curve in panel["curves"]] == [np.flatnonzero(tip).tolist() for tip in slipping.T]


def test_no_slip_falls_between_the_samples_of_a_curve(run):
    """A run of more samples than a curve shows: slips of one sample still have their bar, and nothing else has."""
    long = {name: np.concatenate([array] * 3) for name, array in run.variables.items()}
    long["time"] = np.arange(len(long["time"])) * 1e-3
    long["is_slipping"] = np.zeros_like(long["is_slipping"])
    long["is_slipping"][[0, 100, 4001], [0, 1, 2]] = 1
    scenario = run.scenario.replace('contact = "rolling"', 'contact = "coulomb"')
    recording = dataclasses.replace(run, variables=long, scenario=scenario, stop_time=float(long["time"][-1]))
    panel = panel_of(data_of(report_page([recording], **FEW)), "limit-surface use")
    samples = samples_of(recording)
    assert len(samples) < len(recording) / 2
    first_after = [int(np.searchsorted(samples, k)) for k in (0, 100, 4001)]
    assert [curve["bars"] for curve in panel["curves"]] == [[k] for k in first_after]


def test_films_have_a_frame_where_a_slip_begins(run):
    """The first instant of each mark, though it lies between two frames."""
    data = data_of(report_page([slipping(run)], RATE))
    times = array_of(data, data["runs"][0]["film"]["times"])
    assert len(times) == 31 + 1 and np.isclose(times, 0.508, atol=1e-6).sum() == 1  # 1.2 s is a frame anyway


# --------------------------------------------------------------------------------------------------- the command


def test_the_command_writes_beside_the_recording(brief, tmp_path):
    """`softhand report` of one run and of two."""
    brief.save(tmp_path / "a.nc")
    brief.save(tmp_path / "b.nc")
    assert run_command("report", "a.nc", folder=tmp_path).returncode == 0
    assert run_command("report", "a.nc", "b.nc", "--out", "both.html", folder=tmp_path).returncode == 0
    assert len(data_of((tmp_path / "report.html").read_text("utf-8"))["runs"]) == 1
    assert len(data_of((tmp_path / "both.html").read_text("utf-8"))["runs"]) == 2


def test_the_command_says_that_a_run_is_incomplete(brief, tmp_path):
    """One line with time and reason; nothing if quiet."""
    reason = "finger_2_tip rolls over its <apex>"
    dataclasses.replace(brief, complete=False, reason=reason).save(tmp_path / "a.nc")
    said = run_command("report", "a.nc", folder=tmp_path).stdout
    assert f"incomplete recording, goes to 0.01 s: {reason}" in said
    assert run_command("report", "a.nc", "--quiet", folder=tmp_path).stdout == ""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.nc"], "no such file"),
        (["text.nc"], "cannot be read as a recording"),
        (["a.nc", "--out", "nowhere/report.html"], "make it or choose another"),
        (["a.nc", "--out", "report.pdf"], "unknown ending '.pdf'; choose .html"),
    ],
)
def test_a_mistake_is_one_line(brief, tmp_path, arguments, words):
    """Not a recording, no folder: one message, no traceback, exit code 1."""
    brief.save(tmp_path / "a.nc")
    (tmp_path / "text.nc").write_text("no recording")
    result = run_command("report", *arguments, folder=tmp_path)
    assert result.returncode == 1 and result.stderr.lstrip().startswith("error:") and "Traceback" not in result.stderr
    assert words in result.stderr
