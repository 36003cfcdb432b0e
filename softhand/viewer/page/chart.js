// A small chart over time: drawn once, with a cursor that moves above it.
"use strict";

const INK = "#1f2933", FAINT = "#e3e8ed", WARN = "#A50026";
const DASHES = [[], [7, 2, 1.5, 2], [3, 2], [1.5, 2]];
const MARGIN = { left: 38, right: 8, top: 5, bottom: 16 };

/** Three to five round numbers between two others. */
function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((m) => m * power).find((s) => s >= rough * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return { found, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (/2\.5/.test((step / power).toString()) ? 1 : 0)) };
}

function short(value) {
  if (!Number.isFinite(value)) return value === Infinity ? "∞" : "–";
  const size = Math.abs(value);
  return value.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3).replace(/^-(0\.?0*)$/, "$1").replace("-", "\u2212");
}

class Chart {
  /**
   * panel: {title, unit, least, floor, top, limit, marks, down}; curves: [{time, values, color, dash, width, label, run, marks, bars}];
   * runs: [{label, color}], each with a row of values of its own; none where there is but one.
   */
  constructor(panel, curves, stops, end, seek, runs = []) {
    Object.assign(this, { panel, curves, stops, end });
    this.barred = curves.filter((curve) => curve.bars && curve.bars.length);
    this.element = document.createElement("figure");
    this.element.className = "chart";
    this.element.innerHTML =
      '<figcaption><b></b><span class="unit"></span><span class="note"></span><span class="values"></span></figcaption>' +
      '<div class="area"><canvas></canvas><div class="cursor"></div><div class="tip" hidden></div></div>';
    const part = (name) => this.element.querySelector(name);
    [this.area, this.canvas, this.cursor, this.tip, this.values] = [".area", "canvas", ".cursor", ".tip", ".values"].map(part);
    part("b").textContent = panel.title;
    part(".unit").textContent = `[${panel.unit}]`;
    part(".note").textContent = panel.note || "";
    this.rows = runs.map(({ label, color }) => {
      const row = document.createElement("div"), name = document.createElement("b"), values = document.createElement("span");
      row.className = "row";
      row.style.setProperty("--run", color);
      values.style.display = "contents";
      name.textContent = label;
      row.append(name, values);
      this.area.before(row);
      return values;
    });
    this.area.addEventListener("pointerdown", (event) => {
      this.area.setPointerCapture(event.pointerId);
      seek(this.timeAt(event));
    });
    this.area.addEventListener("pointermove", (event) => {
      if (event.buttons) seek(this.timeAt(event));
      this.hover(event);
    });
    this.area.addEventListener("pointerleave", () => (this.tip.hidden = true));
  }

  range() {
    let low = Infinity, high = -Infinity;
    for (const curve of this.curves) for (const value of curve.values) {
      if (!Number.isFinite(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    const { least, floor, top, limit } = this.panel;
    if (low > high) [low, high] = [0, 1];
    if (limit != null) high = Math.max(high, (this.barred.length ? 1.5 : 1.1) * limit);
    const lack = least - (high - low);
    if (lack > 0) [low, high] = [low - lack / 2, high + lack / 2];
    const air = 0.06 * (high - low);
    [low, high] = [low - air, high + air];
    if (floor != null) low = floor;
    if (top != null) high = Math.min(high, top);
    return [low, high];
  }

  draw() {
    const width = this.area.clientWidth, height = this.area.clientHeight, sharp = window.devicePixelRatio || 1;
    if (!width || !height) return;
    this.width = width - MARGIN.left - MARGIN.right;
    this.canvas.width = width * sharp;
    this.canvas.height = height * sharp;
    const pen = this.canvas.getContext("2d", { willReadFrequently: true });
    pen.scale(sharp, sharp);
    const inner = height - MARGIN.top - MARGIN.bottom, [low, high] = this.range();
    const x = (time) => MARGIN.left + (time / this.end) * this.width;
    const share = (value) => (value - low) / (high - low);
    const y = (value) => MARGIN.top + inner * (this.panel.down ? share(value) : 1 - share(value));
    this.x = x;
    const line = (points, color, thick, dash = []) => {
      pen.strokeStyle = color;
      pen.lineWidth = thick;
      pen.setLineDash(dash);
      pen.beginPath();
      for (const [a, b] of points) pen.lineTo(a, b);
      pen.stroke();
    };
    pen.font = "10px system-ui, sans-serif";
    pen.fillStyle = "#52606d";
    const wanted = inner > 60 ? 4 : inner > 36 ? 3 : 2, few = ticks(low, high, wanted);
    const across = few.found.length > 1 ? few : ticks(low, high, wanted + 2), along = ticks(0, this.end, 4);
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const value of across.found) {
      line([[MARGIN.left, y(value)], [width - MARGIN.right, y(value)]], FAINT, 1);
      pen.fillText(value.toFixed(across.digits).replace("-", "\u2212"), MARGIN.left - 4, y(value));
    }
    pen.textBaseline = "top";
    for (const time of along.found) {
      line([[x(time), MARGIN.top], [x(time), MARGIN.top + inner]], FAINT, 1);
      const label = time === 0 ? "0" : time.toFixed(along.digits), last = time === along.found.at(-1);
      pen.textAlign = last && x(time) > width - 20 ? "right" : "center";
      pen.fillText(last ? `${label} s` : label, Math.min(x(time), width - 2), height - MARGIN.bottom + 3);
    }
    pen.save();
    pen.beginPath();
    pen.rect(MARGIN.left, MARGIN.top - 1, this.width + 1, inner + 2);
    pen.clip();
    if (this.panel.limit != null) line([[x(0), y(this.panel.limit)], [x(this.end), y(this.panel.limit)]], INK, 1, [4, 2]);
    for (const stop of this.stops) line([[x(stop), MARGIN.top], [x(stop), MARGIN.top + inner]], WARN, 1, [4, 2]);
    for (const curve of this.curves) this.trace(pen, curve, x, y, [low, high]);
    const row = Math.min(4, (0.25 * inner) / this.barred.length);
    this.barred.forEach((curve, k) => this.bar(pen, curve, x, MARGIN.top + k * row, row - 1));
    pen.restore();
    line([[MARGIN.left, MARGIN.top], [MARGIN.left, MARGIN.top + inner], [width - MARGIN.right, MARGIN.top + inner]], "#9aa5b1", 1);
  }

  trace(pen, curve, x, y, [low, high]) {
    const far = 2 * (high - low);  // infinite values leave the panel
    pen.strokeStyle = curve.color;
    pen.lineWidth = curve.width;
    pen.lineJoin = "round";
    pen.setLineDash(curve.dash);
    pen.beginPath();
    let broken = true;
    curve.values.forEach((value, k) => {
      if (Number.isNaN(value)) return void (broken = true);
      const at = y(Math.max(low - far, Math.min(high + far, value)));
      if (broken) pen.moveTo(x(curve.time[k]), at); else pen.lineTo(x(curve.time[k]), at);
      broken = false;
    });
    pen.stroke();
    pen.fillStyle = WARN;
    for (const k of curve.marks || []) pen.fillRect(x(curve.time[k]) - 1, y(curve.values[k]) - 1, 2.5, 2.5);
  }

  /** Bars over the times of some samples, each back to the sample before, at the top of the panel. */
  bar(pen, curve, x, top, height) {
    pen.fillStyle = curve.color;
    for (const k of curve.bars) {
      const begin = x(curve.time[Math.max(k - 1, 0)]);
      pen.fillRect(begin, top, Math.max(x(curve.time[k]) - begin, 2), height);
    }
  }

  timeAt(event) {
    const across = event.clientX - this.area.getBoundingClientRect().left;
    return Math.max(0, Math.min(this.end, ((across - MARGIN.left) / this.width) * this.end));
  }

  /** Values of the curves at a time, as pieces of HTML made of numbers alone. */
  at(time, labelled) {
    return this.curves.map((curve) => {
      const last = curve.time.length - 1;
      let low = 0, high = last;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (curve.time[middle] <= time) low = middle; else high = middle;
      }
      const value = curve.values[time - curve.time[low] < curve.time[high] - time ? low : high];
      const piece = document.createElement("span");
      piece.style.color = curve.ink || curve.color;
      piece.textContent = (labelled ? `${curve.label}  ` : "") + short(value);
      return piece;
    });
  }

  hover(event) {
    const time = this.timeAt(event), head = document.createElement("span");
    head.textContent = `${time.toFixed(3)} s`;
    this.tip.replaceChildren(head, ...this.at(time, true));
    this.tip.hidden = false;
    const right = this.x(time) > this.area.clientWidth / 2;
    this.tip.style.left = right ? "auto" : `${this.x(time) + 8}px`;
    this.tip.style.right = right ? `${this.area.clientWidth - this.x(time) + 8}px` : "auto";
  }

  setTime(time) {
    this.cursor.style.transform = `translateX(${this.x ? this.x(time) : 0}px)`;
    const pieces = this.at(time, false);
    if (!this.rows.length) this.values.replaceChildren(...pieces);
    this.rows.forEach((row, run) => row.replaceChildren(...pieces.filter((_, k) => this.curves[k].run === run)));
  }
}
