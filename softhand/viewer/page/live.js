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

/** Put a frame, little-endian float32, into the bodies of a stage; returns its time [s]. */
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
  return frame[0];
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

function legendEntry(entry) {
  const row = element("div", "entry"), swatch = element("i", entry.ring ? "ring" : "swatch");
  swatch.style.background = entry.colors.length > 1 || entry.ring ? "none" : entry.colors[0];
  row.append(swatch, element("span", "", entry.text));
  if (entry.colors.length > 1) {
    const ramp = element("div", "ramp"), bar = element("i");
    bar.style.background = `linear-gradient(to right, ${entry.colors.join(", ")})`;
    ramp.append(element("span", "", entry.ends[0]), bar, element("span", "", entry.ends[1]));
    row.append(ramp);
  }
  return row;
}

/** Buttons of a replay. */
class Player {
  constructor(duration, send) {
    this.duration = duration;
    this.playing = true;
    part("player").hidden = false;
    part("wind").max = duration;
    part("play").onclick = () => this.set({ playing: !this.playing });
    part("wind").oninput = () => this.set({ playing: false, time: Number(part("wind").value) });
    this.send = send;
    this.label();
  }

  set(command) {
    this.playing = command.playing;
    if (command.time !== undefined) part("wind").value = command.time;
    this.send(JSON.stringify(command));
    this.label();
  }

  label() {
    part("play").textContent = this.playing ? "❚❚" : "▶";
  }

  show(time) {
    if (this.playing) part("wind").value = time;
    part("wound").textContent = `${time.toFixed(2)} / ${this.duration.toFixed(2)} s`;
  }
}

async function start() {
  const film = await (await fetch("scene.json")).json();
  document.body.classList.toggle("replay", film.duration !== null);
  const stage = new Stage(part("stage"), film);
  stage.orbit.changed = () => stage.draw();
  stage.drawn = () => (part("slip").textContent = stage.slipping());
  const canvas = part("stage"), fit = () => stage.resize(canvas.clientWidth, canvas.clientHeight);
  window.addEventListener("resize", fit);
  fit();
  fillViews(stage);
  fillLayers(film, stage);
  part("message").textContent = film.title;
  const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/stream`);
  socket.binaryType = "arraybuffer";
  const player = film.duration === null ? null : new Player(film.duration, (text) => socket.send(text));
  window.softhand = { stage, wind: (time) => player.set({ playing: false, time }) }; // for scripts that make pictures
  socket.onopen = () => socket.send("next");
  socket.onclose = () => (part("message").textContent ||= "The viewer has ended.");
  socket.onmessage = (message) => {
    if (typeof message.data === "string") {
      part("message").textContent = JSON.parse(message.data).message;
      return;
    }
    const time = apply(new Float32Array(message.data), stage, film.items);
    part("time").textContent = `${time.toFixed(2)} s`;
    document.body.dataset.time = time;
    if (player) player.show(time);
    requestAnimationFrame(() => socket.readyState === 1 && socket.send("next"));
  };
}

start().catch((error) => {
  part("message").textContent = String(error);
  throw error;
});
