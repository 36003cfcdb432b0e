// The page: one clock moves films, cursors and the scrub bar.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const find = (name) => document.querySelector(name);
const many = data.runs.length > 1;
const RUN_COLORS = ["#0b8aa8", "#7b3fb5", "#8a6500", "#b3245f"]; // none of a finger

function make(tag, name = "", text = "", parent = null) {
  const element = document.createElement(tag);
  if (name) element.className = name;
  if (text) element.textContent = text;
  if (parent) parent.append(element);
  return element;
}

/** A sample of a line as a legend shows it. */
function sample(color, dash, width, parent) {
  const picture = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  picture.setAttribute("width", 26);
  picture.setAttribute("height", 3);
  const stroke = document.createElementNS("http://www.w3.org/2000/svg", "line");
  const values = { x1: 0, x2: 26, y1: 1.5, y2: 1.5, stroke: color, "stroke-width": width, "stroke-dasharray": dash.join(" ") };
  for (const [key, value] of Object.entries(values)) stroke.setAttribute(key, value);
  picture.append(stroke);
  parent.prepend(picture);
}

/** The badge of a run, and its colour for all that stands with it. */
function badge(run, parent) {
  const element = make("span", "badge", run.label);
  parent.style.setProperty("--run", RUN_COLORS[data.runs.indexOf(run)]);
  parent.prepend(element);
}

/** The colour of a curve in a run: the hue tells the finger, how dark it is tells the run. */
function shade(color, run) {
  if (!run) return color;
  const [toward, share] = [null, [255, 0.42], [0, 0.42], [255, 0.62]][run];
  const part = (k) => parseInt(color.slice(1 + 2 * k, 3 + 2 * k), 16);
  return rgb([0, 1, 2].map((k) => ((1 - share) * part(k) + share * toward) / 255));
}

const rgb = (color) => `rgb(${color.map((part) => Math.round(255 * part)).join(",")})`;

function showHeads() {
  document.title = data.runs.map((run) => run.title).join(" | ");
  for (const run of data.runs) {
    const head = make("div", "head", "", find(".heads"));
    const title = make("h1", "", run.title, head);
    title.title = run.title;
    if (many) badge(run, title);
    make("p", "", run.subtitle, head);
    if (run.stop) make("p", "stop", run.stop, head);
  }
  find(".made").append("made with ", make("b", "", `softhand ${data.version}`));
}

function showEntry(entry, legend) {
  const line = make("span", "", "", legend), swatch = make("i");
  line.dataset.layer = entry.layer;
  if (entry.colors.length > 1) {
    swatch.className = "ramp";
    swatch.style.background = `linear-gradient(90deg, ${entry.colors.map(rgb)})`;
    line.append(`${entry.text} ${entry.ends[0]}`, swatch, entry.ends[1]);
  } else {
    if (entry.ring) swatch.className = "ring"; else swatch.style.background = rgb(entry.colors[0]);
    line.append(swatch, entry.text);
  }
}

/** Runs side by side have the same scales, and so one legend; it says what any of them shows. */
function showLegend(runs, parent) {
  const legend = make("div", "legend", "", parent), entries = runs.flatMap((run) => run.film.legend);
  for (const entry of new Map(entries.map((entry) => [entry.text, entry])).values()) showEntry(entry, legend);
}

function showFilm(run) {
  const film = make("div", "film", "", find(".films")), screen = make("div", "screen", "", film);
  const canvas = make("canvas", "", "", screen);
  const name = make("div", "over name", data.filmOnly ? run.title : "", screen);
  if (many) {
    badge(run, name);
    film.style.setProperty("--run", RUN_COLORS[data.runs.indexOf(run)]);
  }
  if (run.stop && data.filmOnly) make("div", "stop", run.stop, name);
  make("div", "over time", "", screen);
  const slip = make("div", "slip", "", name);
  if (!many) showLegend([run], film);
  try {
    const stage = new Stage(canvas, run.film);
    stage.element = screen;
    stage.overlay = new Overlay(stage, screen, run.film);
    stage.drawn = () => (slip.textContent = stage.slipping());
    const views = make("div", "views", "", screen);
    for (const view of Object.keys(Orbit.VIEWS)) make("button", "", view, views).onclick = () => stage.orbit.view(view);
    return stage;
  } catch (error) {
    canvas.remove();
    make("div", "empty", "This browser shows no 3-D graphics (WebGL). The curves work without.", screen);
    return null;
  }
}

/** All films are seen from the same side, and turning one turns all. */
function tie(stages) {
  for (const stage of stages) {
    stage.orbit.bounds.azimuth = stages[0].orbit.bounds.azimuth;
    stage.orbit.view("3-D");
    stage.orbit.changed = () => {
      stage.draw();
      for (const other of stages) {
        if (other === stage) continue;
        const { azimuth, elevation, distance } = stage.orbit;
        Object.assign(other.orbit, { azimuth, elevation, distance });
        other.orbit.place();
        other.draw();
      }
    };
    const fit = () => stage.resize(stage.element.clientWidth, stage.element.clientHeight);
    fit();
    new ResizeObserver(fit).observe(stage.element);
  }
}

function showLayers(stages) {
  const layers = new Map();
  for (const run of data.runs) for (const layer of run.film.layers) layers.set(layer.key, layer);
  for (const layer of layers.values()) {
    const label = make("label", "", "", find(".layers")), box = make("input");
    box.type = "checkbox";
    box.checked = layer.shown;
    const explain = () =>
      document.querySelectorAll(`.legend [data-layer="${layer.key}"]`).forEach((entry) => (entry.hidden = !box.checked));
    box.onchange = () => {
      stages.forEach((stage) => stage.setLayer(layer.key, box.checked));
      explain();
    };
    label.append(box, layer.title);
    explain();
  }
}

/** What happened, as buttons that lead there; the list is one stop of the Tab key, up and down go through it. */
function showEvents(seek) {
  const events = data.runs.flatMap((run) => run.events.map((event) => ({ ...event, run })));
  events.sort((one, other) => one.time - other.time);
  find(".events").hidden = !events.length;
  const list = find(".events ol");
  const buttons = events.map((event, k) => {
    const button = make("button", "", "", make("li", "", "", list));
    if (many) badge(event.run, make("span", "", "", button));
    for (const text of [`${event.time.toFixed(3)} s`, event.kind, event.finger.replaceAll("_", " "), event.text]) make("span", "", text, button);
    button.tabIndex = k ? -1 : 0;
    button.onfocus = () => buttons.forEach((other) => (other.tabIndex = other === button ? 0 : -1));
    button.onclick = () => seek(event.time);
    return button;
  });
  list.addEventListener("keydown", (event) => {
    const at = buttons.indexOf(event.target), last = buttons.length - 1;
    const moves = { ArrowUp: Math.max(at - 1, 0), ArrowDown: Math.min(at + 1, last), Home: 0, End: last };
    if (event.key in moves) {
      buttons[moves[event.key]].focus();
      buttons[moves[event.key]].click();
      event.preventDefault();
    }
    if (event.key in moves || event.key === " ") event.stopPropagation(); // not for the clock
  });
  return (time) => {
    const now = events.findLastIndex((event) => event.time <= time + 5e-4);
    buttons.forEach((button, k) => (k === now ? button.setAttribute("aria-current", "time") : button.removeAttribute("aria-current")));
  };
}

function showFacts() {
  const facts = find(".facts"), table = make("table", "", "", facts);
  if (many) {
    const row = make("tr", "", "", make("thead", "", "", table));
    make("th", "", "", row);
    for (const run of data.runs) badge(run, make("th", "", "", row));
  }
  const body = make("tbody", "", "", table), names = new Set(data.runs.flatMap((run) => run.facts.map(([name]) => name)));
  for (const name of names) {
    const row = make("tr", "", "", body);
    make("th", "", name, row);
    for (const run of data.runs) make("td", "", (run.facts.find(([other]) => other === name) || ["", "–"])[1], row);
  }
  for (const run of data.runs) {
    for (const note of run.notes) {
      const line = make("p", "", note, facts);
      if (many) badge(run, line);
    }
  }
  if (many) showLegend(data.runs, facts);
  for (const run of data.runs) {
    const details = make("details", "", "", facts);
    make("summary", "", `Scenario${many ? ` ${run.label}` : ""} (computed with softhand ${run.version})`, details);
    make("pre", "", run.scenario, details);
  }
}

function showKeys() {
  const keys = make("div", "keys", "", find(".plots"));
  const key = (text, color, dash, width) => sample(color, dash, width, make("span", "", text, keys));
  for (const finger of data.fingers) key(finger.text, finger.color, [], 3);
  key("desired", "#000000", [], 1);
  if (many) data.runs.forEach((run, k) => {
    const line = make("span", "", "", keys);
    badge(run, line);
    const colors = [RUN_COLORS[k], ...data.fingers.slice(0, 3).map((finger) => shade(finger.color, k))];
    for (const color of colors.reverse()) sample(color, DASHES[k], 2, line);
    line.prepend(line.querySelector(".badge"));
  });
}

function showPlots(seek) {
  showKeys();
  const grid = make("div", "grid", "", find(".plots"));
  const times = data.runs.map((run) => unpack(run.times));
  const stops = data.runs.filter((run) => run.stop).map((run) => run.end);
  return data.blocks.flatMap((block) => {
    const card = make("section", "block", "", grid);
    make("h2", "", block.title, card);
    return block.panels.map((panel) => {
      const above = Array(data.runs.length).fill(0); // a narrower curve leaves an equal one below it in sight
      const curves = panel.curves.map((curve) => ({
        ...curve,
        ink: curve.of_run && many ? RUN_COLORS[curve.run] : curve.color, // of its value: pale letters are hard to read
        color: curve.desired || !many ? curve.color : curve.of_run ? RUN_COLORS[curve.run] : shade(curve.color, curve.run),
        time: times[curve.run],
        values: unpack(curve.values),
        dash: curve.desired ? [] : DASHES[curve.run],
        width: curve.desired ? 0.9 : 1.1 + 1.2 * 0.6 ** above[curve.run]++,
        label: (many ? `${data.runs[curve.run].label} ` : "") + curve.label,
      }));
      const chart = new Chart(panel, curves, stops, data.end, seek, many ? data.runs.map((run, k) => ({ label: run.label, color: RUN_COLORS[k] })) : []);
      card.append(chart.element);
      new ResizeObserver(() => {
        chart.draw();
        chart.setTime(clock.time);
      }).observe(chart.area);
      return chart;
    });
  });
}

const clock = {
  time: 0,
  speed: 1,
  playing: false,
  stages: [],
  charts: [],
  tell: () => {}, // the events

  set(time) {
    this.time = Math.max(0, Math.min(data.end, time));
    for (const stage of this.stages) stage.setTime(this.time);
    for (const chart of this.charts) chart.setTime(this.time);
    this.tell(this.time);
    find(".scrub").value = this.time;
    find(".now").textContent = `${this.time.toFixed(3)} / ${data.end.toFixed(2)} s`;
    document.querySelectorAll(".film .time").forEach((label, k) => {
      const phase = data.runs[k].phases.findLast(([, begin]) => begin <= this.time);
      label.textContent = `${phase ? `${phase[0]}, ` : ""}${this.time.toFixed(2)} s`;
    });
  },

  /** By hand: playing stops, and the address leads back to this time. */
  seek(time) {
    this.pause();
    this.set(time);
    this.keep();
  },

  keep() {
    try { history.replaceState(null, "", `#t=${this.time.toFixed(3)}`); } catch { /* not allowed in some frames */ }
  },

  play() {
    if (this.time >= data.end) this.set(0);
    this.playing = true;
    find(".play").classList.add("on");
    let last = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      this.set(this.time + (this.speed * (now - last)) / 1000);
      last = now;
      if (this.time >= data.end) this.pause(); else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  },

  pause() {
    this.playing = false;
    find(".play").classList.remove("on");
  },

  toggle() {
    if (this.playing) { this.pause(); this.keep(); } else this.play();
  },
};

function listen() {
  find(".play").onclick = () => clock.toggle();
  find(".scrub").max = data.end;
  find(".scrub").oninput = (event) => clock.seek(Number(event.target.value));
  find(".speed").onchange = (event) => (clock.speed = Number(event.target.value));
  window.addEventListener("hashchange", () => fromAddress());
  window.addEventListener("keydown", (event) => {
    if (/SELECT|SUMMARY/.test(event.target.tagName)) return;
    const moves = { ArrowLeft: clock.time - 1 / 60, ArrowRight: clock.time + 1 / 60, Home: 0, End: data.end };
    if (event.key === " ") clock.toggle(); else if (event.key in moves) clock.seek(moves[event.key]); else return;
    event.preventDefault();
  });
}

/** Go to the time in the address, `#t=1.2`; returns whether there is one. */
function fromAddress() {
  const asked = new URLSearchParams(location.hash.slice(1)).get("t");
  const found = asked !== null && Number.isFinite(Number(asked));
  if (found) clock.set(Number(asked));
  return found;
}

async function start() {
  document.body.classList.toggle("many", many);
  document.body.style.setProperty("--runs", data.runs.length);
  document.body.classList.toggle("film-only", data.filmOnly);
  showHeads();
  await inflate(data.arrays);
  clock.stages = data.runs.map(showFilm).filter(Boolean);
  showLayers(clock.stages);
  showFacts();
  if (many && data.filmOnly) showLegend(data.runs, find("main"));
  clock.tell = showEvents((time) => clock.seek(time));
  clock.charts = showPlots((time) => clock.seek(time));
  tie(clock.stages);
  listen();
  if (!fromAddress()) clock.set(0);
}

/** For other programs: wait for `ready`, then set the time or read it. */
window.softhand = {
  ready: start().catch((error) => {
    make("p", "failed", `This page cannot be shown here: ${error.message}. Try a newer browser.`, document.body);
    throw error;
  }),
  duration: data.end,
  setTime: (time) => clock.seek(time),
  time: () => clock.time,
};
