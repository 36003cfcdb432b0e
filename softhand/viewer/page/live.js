// The live page: draws each frame that the server sends, then asks for the next.
"use strict";

const NUMBERS = 16; // of an item in a frame: three rows of its pose, colour, visible
const part = (id) => document.getElementById(id);

function element(tag, className, text) {
  const made = document.createElement(tag);
  made.className = className || "";
  made.textContent = text || "";
  return made;
}

/** Put a frame, little-endian float32, into the bodies of a stage; returns its time [s] and its readings. */
function apply(frame, stage, items) {
  let vertices = 1 + NUMBERS * items.length;
  items.forEach((item, k) => {
    const body = stage.bodies[k], row = frame.subarray(1 + NUMBERS * k, 1 + NUMBERS * (k + 1));
    body.object.matrix.set(...row.subarray(0, 12), 0, 0, 0, 1);
    body.object.matrixWorldNeedsUpdate = true;
    body.object.material.color.setRGB(row[12], row[13], row[14]).convertSRGBToLinear();
    body.shown = row[15] > 0;
    if (item.soft) {
      const size = body.vertices.array.length;
      body.vertices.array.set(frame.subarray(vertices, vertices + size));
      body.vertices.needsUpdate = true;
      if (body.object.isMesh) body.object.geometry.computeVertexNormals();
      vertices += size;
    }
  });
  stage.draw();
  return { time: frame[0], numbers: frame.subarray(vertices) };
}

function fillViews(stage) {
  for (const name of Object.keys(Orbit.VIEWS)) {
    const button = element("button", "", name);
    button.type = "button";
    button.onclick = () => stage.orbit.view(name);
    part("views").append(button);
  }
}

function fillLayers(film, stage) {
  for (const layer of film.layers) {
    const box = element("div", "layer"), label = element("label"), check = element("input");
    check.type = "checkbox";
    check.checked = layer.shown;
    check.dataset.layer = layer.key;
    check.onchange = () => stage.setLayer(layer.key, check.checked);
    label.append(check, element("span", "", layer.title));
    box.append(label, ...film.legend.filter((entry) => entry.layer === layer.key).map(legendEntry));
    part("layers").append(box);
  }
}

/** How a swatch looks beside its colour, so that it is told from others without it. */
const SWATCHES = { trails: "line", desired: "frame", internal: "line", tips: "pale" };

function legendEntry(entry) {
  const row = element("div", "entry"), swatch = element("i", entry.ring ? "ring" : `swatch ${SWATCHES[entry.layer] || ""}`);
  swatch.style.background = entry.colors.length > 1 || entry.ring ? "none" : entry.colors[0];
  if (SWATCHES[entry.layer] === "frame") swatch.style.borderColor = entry.colors[0];
  row.append(swatch, element("span", "", entry.text));
  if (entry.colors.length > 1) {
    const ramp = element("div", "ramp"), bar = element("i");
    bar.style.background = `linear-gradient(to right, ${entry.colors.join(", ")})`;
    ramp.append(element("span", "", entry.ends[0]), bar, element("span", "", entry.ends[1]));
    row.append(ramp);
  }
  return row;
}

/** The curves: of a replay all from the start, of a run as far as it has come. */
class Curves {
  static MOST = 4000; // samples; of more every other is dropped
  static PAUSE = 200; // [ms] between two drawings of a run

  constructor(film, seek) {
    const fingers = film.fingers.map(({ text, color }) => ({ label: text, color }));
    this.times = [];
    this.rows = [...fingers, ...fingers, { label: "position", color: "#0072B2" }, { label: "orientation", color: "#0072B2" }].map((curve, k) => ({
      ...curve, time: this.times, values: [], dash: [], width: 1.1 + 1.2 * 0.6 ** (k % fingers.length), run: 0,
    }));
    this.due = 0;
    if (film.curves) {
      const [times, numbers] = film.curves.map(unpack);
      times.forEach((time, k) => this.add(time, numbers.subarray(k * this.rows.length, (k + 1) * this.rows.length)));
    }
    const count = fingers.length, end = film.duration || 0.5, parent = part("curves");
    const panels = [
      [{ title: "normal force", unit: "N", least: 0.5 }, this.rows.slice(0, count)],
      [{ title: "friction use", unit: "-", least: 0.5, floor: 0, top: 3, limit: 1 }, this.rows.slice(count, 2 * count)],
      [{ title: "position error", unit: "mm", least: 0.1, floor: 0 }, [this.rows[2 * count]]],
      [{ title: "orientation error", unit: "deg", least: 0.1, floor: 0 }, [this.rows[2 * count + 1]]],
    ];
    const keys = element("div");
    keys.id = "keys";
    for (const finger of fingers) {
      const key = element("span"), line = element("i");
      line.style.background = finger.color;
      key.append(line, finger.label);
      keys.append(key);
    }
    parent.append(keys);
    this.charts = panels.map(([panel, curves]) => {
      const chart = new Chart(panel, curves, [], end, seek);
      parent.append(chart.element);
      new ResizeObserver(() => this.draw(chart)).observe(chart.area);
      return chart;
    });
    this.isWhole = film.duration !== null;
  }

  add(time, numbers) {
    if (time < this.times.at(-1)) for (const list of [this.times, ...this.rows.map((row) => row.values)]) list.length = 0; // it began anew
    if (time === this.times.at(-1)) return;
    this.times.push(time);
    this.rows.forEach((row, k) => row.values.push(numbers[k]));
    if (this.times.length > Curves.MOST) {
      for (const list of [this.times, ...this.rows.map((row) => row.values)]) list.splice(0, list.length, ...list.filter((_, k) => k % 2 === 0));
    }
  }

  draw(chart) {
    if (!this.times.length) return;
    chart.draw();
    chart.setTime(this.time ?? this.times[0]);
  }

  show(time, numbers) {
    this.time = time;
    if (!this.isWhole) {
      this.add(time, numbers);
      for (const chart of this.charts) chart.end = Math.max(time, 0.5);
      if (performance.now() < this.due) return;
      this.due = performance.now() + Curves.PAUSE;
      for (const chart of this.charts) this.draw(chart);
    } else for (const chart of this.charts) chart.setTime(time);
  }
}

/** The bar below the picture: a replay is stopped, wound and sped up; of a run the picture is held while it goes on. */
class Player {
  static STEP = 1 / 60; // [s] of the arrows

  constructor(film, send, hold) {
    this.duration = film.duration;
    this.isReplay = film.duration !== null;
    this.playing = true;
    this.time = 0;
    this.send = send;
    this.hold = hold;
    part("wind").hidden = part("pace").hidden = !this.isReplay;
    part("play").title = this.isReplay ? "play or pause (space)" : "hold the picture; the run goes on (space)";
    part("wind").max = film.duration ?? 1;
    part("play").onclick = () => this.toggle();
    part("wind").oninput = () => this.seek(Number(part("wind").value));
    const speeds = [...new Set([0.05, 0.1, 0.25, 0.5, 1, 2, film.speed])].sort((one, other) => one - other);
    for (const speed of speeds) part("speed").append(new Option(speed < 1 && Number.isInteger(1 / speed) ? `1/${1 / speed}` : speed, speed, false, speed === film.speed));
    part("speed").onchange = (event) => this.send(JSON.stringify({ speed: Number(event.target.value) }));
    window.addEventListener("keydown", (event) => this.press(event));
    this.label();
  }

  press(event) {
    if (/SELECT/.test(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey) return;
    const moves = { ArrowLeft: this.time - Player.STEP, ArrowRight: this.time + Player.STEP, Home: 0, End: this.duration };
    if (event.key === " ") this.toggle(); else if (this.isReplay && event.key in moves) this.seek(moves[event.key]); else return;
    event.preventDefault();
  }

  toggle() {
    this.set({ playing: !this.playing });
  }

  seek(time) {
    if (!this.isReplay) return;
    this.time = Math.max(0, Math.min(this.duration, time));
    this.set({ playing: false, time: this.time });
  }

  set(command) {
    this.playing = command.playing;
    if (command.time !== undefined) part("wind").value = command.time;
    if (this.isReplay) this.send(JSON.stringify(command)); else this.hold(!this.playing);
    this.label();
  }

  label() {
    part("play").textContent = this.playing ? "❚❚" : "▶";
  }

  show(time) {
    this.measure(time);
    if (this.playing) [this.time, part("wind").value] = [time, time];
    part("time").textContent = this.isReplay ? `${time.toFixed(3)} / ${this.duration.toFixed(2)} s` : `${time.toFixed(3)} s`;
  }

  /** How fast a run goes, over the last second. */
  measure(time) {
    if (this.isReplay) return;
    const now = performance.now();
    this.begin ??= [now, time];
    if (now - this.begin[0] < 1000) return;
    part("measured").textContent = `${((1000 * (time - this.begin[1])) / (now - this.begin[0])).toFixed(2)} × real time`;
    this.begin = [now, time];
  }
}

async function start() {
  const film = await (await fetch("scene.json")).json();
  document.body.classList.toggle("replay", film.duration !== null);
  document.title = part("title").textContent = film.title;
  part("subtitle").textContent = film.subtitle;
  part("message").textContent = film.message;
  const stage = new Stage(part("stage"), film);
  stage.overlay = new Overlay(stage, part("view"), film);
  stage.orbit.changed = () => stage.draw();
  stage.drawn = () => (part("slip").textContent = stage.slipping());
  const canvas = part("stage"), fit = () => stage.resize(canvas.clientWidth, canvas.clientHeight);
  window.addEventListener("resize", fit);
  fillViews(stage);
  fillLayers(film, stage);
  stage.orbit.view("grasp");
  fit();
  const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/stream`);
  socket.binaryType = "arraybuffer";
  const ask = () => requestAnimationFrame(() => socket.readyState === 1 && socket.send("next"));
  let held = false;
  const player = new Player(film, (text) => socket.readyState === 1 && socket.send(text), (hold) => {
    held = hold;
    if (!held) ask();
  });
  const curves = new Curves(film, (time) => player.seek(time));
  window.softhand = { stage, player, curves, wind: (time) => player.seek(time) }; // for scripts that make pictures
  socket.onopen = () => socket.send("next");
  socket.onclose = () => {
    part("message").textContent ||= "The viewer has ended.";
    curves.due = 0;
    if (!curves.isWhole) for (const chart of curves.charts) curves.draw(chart);
  };
  socket.onmessage = (message) => {
    if (typeof message.data === "string") {
      part("message").textContent = JSON.parse(message.data).message;
      return;
    }
    const { time, numbers } = apply(new Float32Array(message.data), stage, film.items);
    document.body.dataset.time = time;
    player.show(time);
    curves.show(time, numbers);
    if (!held) ask();
  };
}

start().catch((error) => {
  part("message").textContent = String(error);
  throw error;
});
