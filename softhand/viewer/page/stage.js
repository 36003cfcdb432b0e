// The 3-D film of one run: items of the scene, moved to a time.
"use strict";

const THREE = MeshCat.THREE;

let arrays = null;  // the bytes of all arrays

/** Inflate the arrays, which Python packed behind each other. */
async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  arrays = await new Response(stream).arrayBuffer();
}

/** An array, of those inflated or with base64 of its own. */
function unpack({ type, start, count, data }) {
  const types = { f4: Float32Array, i4: Int32Array, i2: Int16Array, u1: Uint8Array };
  if (data === undefined) return new types[type](arrays, start, count);
  return new types[type](Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0)).buffer);
}

/** Coordinates over time, packed as steps from frame to frame, as one shape after the other. */
function unpackShapes(packed, frames) {
  const steps = unpack(packed), size = steps.length / frames, shapes = new Int16Array(steps.length);
  for (let k = 0; k < size; k++) {
    let at = 0;
    for (let frame = 0; frame < frames; frame++) shapes[size * frame + k] = at += steps[frames * k + frame];
  }
  return shapes;
}

/** One item: `at(place)` moves it to a place between frames, 0 to the number of frames less one. */
class Body {
  constructor(item, frames) {
    this.name = item.name;
    this.layer = item.layer;
    this.frames = frames;
    this.rest = unpack(item.vertices);
    const faces = unpack(item.faces);
    this.poses = item.poses && unpack(item.poses);
    this.shapes = item.shapes && unpackShapes(item.shapes, frames);
    this.scale = item.scale;
    this.colors = item.colors && unpack(item.colors);
    this.visible = item.visible && unpack(item.visible);
    const geometry = new THREE.BufferGeometry();
    this.vertices = new THREE.BufferAttribute(new Float32Array(this.rest), 3);
    geometry.setAttribute("position", this.vertices);
    geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(faces), 1));
    const look = { color: new THREE.Color(...item.color).convertSRGBToLinear() };
    if (item.on_top) Object.assign(look, { transparent: true, depthTest: false }); // drawn last
    if (item.opacity < 1) Object.assign(look, { transparent: true, opacity: item.opacity, depthWrite: false });
    if (item.kind === "lines") {
      this.object = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial(look));
    } else {
      look.side = THREE.DoubleSide; // lit by vertex: where there is no graphics card a light a pixel takes twice as long
      this.object = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial(look));
      geometry.computeVertexNormals();
    }
    if (item.on_top) this.object.renderOrder = 1;
    this.object.frustumCulled = false;
    this.object.matrixAutoUpdate = false;
  }

  at(place) {
    const first = Math.min(Math.floor(place), this.frames - 1);
    const next = Math.min(first + 1, this.frames - 1);
    const share = place - first;
    const nearest = share < 0.5 ? first : next;
    if (this.visible) this.shown = this.visible[nearest] > 0;
    else this.shown = true;
    if (this.poses) this.pose(first, next, share);
    if (this.shapes) this.shape(first, next, share);
    if (this.colors) {
      const [r, g, b] = this.colors.subarray(3 * nearest, 3 * nearest + 3);
      this.object.material.color.setRGB(r / 255, g / 255, b / 255).convertSRGBToLinear();
    }
  }

  pose(first, next, share) {
    const fixed = this.poses.length === 12;
    const a = fixed ? 0 : 12 * first, b = fixed ? 0 : 12 * next, p = this.poses;
    const m = Array.from({ length: 12 }, (_, k) => p[a + k] + share * (p[b + k] - p[a + k]));
    this.object.matrix.set(...m, 0, 0, 0, 1);
    this.object.matrixWorldNeedsUpdate = true;
  }

  shape(first, next, share) {
    const size = this.rest.length, moved = this.vertices.array, s = this.shapes;
    for (let k = 0; k < size; k++) {
      const now = s[size * first + k];
      moved[k] = this.rest[k] + this.scale * (now + share * (s[size * next + k] - now));
    }
    this.vertices.needsUpdate = true;
    if (this.object.isMesh) this.object.geometry.computeVertexNormals();
  }
}

/** A camera that looks at a point: drag turns, drag with the right button or with shift moves, the wheel zooms. */
class Orbit {
  static VIEWS = { "3-D": [-0.9, 0.42], grasp: [-0.9, 0.42], front: [-Math.PI / 2, 0.0], side: [0.0, 0.0], top: [-Math.PI / 2, 1.5607] };

  constructor(bounds) {
    this.camera = new THREE.PerspectiveCamera(28, 1, 0.01 * bounds.radius, 60 * bounds.radius);
    this.camera.up.set(0, 0, 1);
    this.bounds = bounds;
    const [a, b, c, d, e, f, g, h, i] = bounds.upright;
    this.upright = new THREE.Matrix4().set(a, b, c, 0, d, e, f, 0, g, h, i, 0, 0, 0, 0, 1);
    this.changed = () => {};
    this.view("3-D");
  }

  view(name) {
    [this.azimuth, this.elevation] = Orbit.VIEWS[name];
    const close = name === "grasp", sphere = close ? this.bounds.grasp : this.bounds;
    if (close || name === "3-D") this.azimuth = this.bounds.azimuth;
    this.target = new THREE.Vector3(...sphere.center).applyMatrix4(this.upright);
    this.distance = sphere.radius / this.bounds.radius;
    this.move();
  }

  /** Follow what a hand has changed. */
  move() {
    this.place();
    this.changed();
  }

  place() {
    const half = Math.tan((this.camera.fov * Math.PI) / 360) * Math.min(1, this.camera.aspect);
    const far = (this.distance * this.bounds.radius) / half;
    const flat = far * Math.cos(this.elevation);
    this.camera.position.set(
      this.target.x + flat * Math.cos(this.azimuth),
      this.target.y + flat * Math.sin(this.azimuth),
      this.target.z + far * Math.sin(this.elevation),
    );
    this.camera.lookAt(this.target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  listen(canvas) {
    let last = null;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      last = [event.clientX, event.clientY];
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!last || !event.buttons) return;
      const across = event.clientX - last[0], down = event.clientY - last[1];
      last = [event.clientX, event.clientY];
      if (event.shiftKey || event.buttons > 1) this.pan(across, down, canvas.clientHeight);
      else {
        this.azimuth -= 0.008 * across;
        this.elevation = Math.max(-1.56, Math.min(1.56, this.elevation + 0.008 * down));
      }
      this.move();
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", () => this.view("3-D"));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.distance = Math.max(0.05, Math.min(12, this.distance * Math.exp(0.0012 * event.deltaY)));
      this.move();
    }, { passive: false });
  }

  pan(across, down, height) {
    const length = (2 * this.distance * this.bounds.radius) / height;
    const [right, up] = [0, 1].map((axis) => new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, axis));
    this.target.addScaledVector(right, -length * across).addScaledVector(up, length * down);
  }
}

/** What stands above the picture: the names of the fingers, and in a corner the axes of the world and gravity. */
class Overlay {
  static AXES = [["x", "#c0392b", [1, 0, 0]], ["y", "#1e8449", [0, 1, 0]], ["z", "#1f5fbf", [0, 0, 1]]];

  constructor(stage, parent, film) {
    Object.assign(this, { stage, parent, gravity: film.gravity, middle: new THREE.Vector3() });
    this.triad = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.triad.setAttribute("class", "triad");
    this.triad.setAttribute("viewBox", "-42 -42 84 84");
    this.triad.setAttribute("role", "img");
    this.triad.setAttribute("aria-label", film.gravity ? "axes of the world, and gravity g" : "axes of the world");
    parent.append(this.triad);
    this.names = film.fingers.map(({ tip, text }) => {
      const label = document.createElement("span");
      label.className = "finger";
      label.textContent = text;
      parent.append(label);
      return { label, body: stage.bodies.find((body) => body.name === `tips/${tip}`) };
    });
  }

  draw() {
    const { camera, upright } = this.stage.orbit, [width, height] = this.stage.size;
    for (const { label, body } of this.names) {
      label.hidden = !body || !body.object.visible;
      if (label.hidden) continue;
      const points = body.vertices.array, count = points.length / 3;
      this.middle.set(0, 0, 0);
      for (let k = 0; k < points.length; k += 3) this.middle.x += points[k], this.middle.y += points[k + 1], this.middle.z += points[k + 2];
      this.middle.divideScalar(count).applyMatrix4(body.object.matrix).applyMatrix4(upright).project(camera);
      const x = 0.5 * width * (1 + this.middle.x), y = 0.5 * height * (1 - this.middle.y);
      label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -38px)`;
    }
    this.drawAxes(camera, upright);
  }

  /** Arrows as they stand before the camera, the nearest last. */
  drawAxes(camera, upright) {
    const back = camera.quaternion.clone().invert();
    const arrows = Overlay.AXES.map(([name, color, way]) => [name, color, 25, new THREE.Vector3(...way).applyMatrix4(upright)]);
    if (this.gravity) arrows.push(["g", "#1f2933", 34, new THREE.Vector3(0, 0, -1)]);
    for (const arrow of arrows) arrow[3].applyQuaternion(back);
    arrows.sort((one, other) => one[3].z - other[3].z);
    this.triad.innerHTML = arrows.map(([name, color, length, { x, y }]) => {
      const flat = Math.hypot(x, y) || 1, [a, b] = [x / flat, -y / flat], [u, v] = [length * x, -length * y];
      const sides = [-1, 1].map((side) => `M${u} ${v}L${u - 6 * a - 3.5 * side * b} ${v - 6 * b + 3.5 * side * a}`);
      const off = name === "g" ? [8, -2] : [8 * a, 8 * b], dash = name === "g" ? ' stroke-dasharray="4 2"' : "";
      return `<g stroke="${color}" stroke-width="2.2" fill="none"><path d="M0 0L${u} ${v}"${dash}/><path d="${sides.join("")}"/></g>` +
        `<text x="${u + off[0]}" y="${v + off[1]}" fill="${color}">${name}</text>`;
    }).join("");
  }
}

/** A canvas that shows one run. */
class Stage {
  constructor(canvas, film) {
    this.times = unpack(film.times);
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.outputEncoding = THREE.sRGBEncoding;
    this.renderer.setClearColor(0xf4f6f8, 1);
    this.scene = new THREE.Scene();
    this.orbit = new Orbit(film.bounds);
    this.orbit.listen(canvas);
    const sun = new THREE.DirectionalLight(0xffffff, 0.75), fill = new THREE.DirectionalLight(0xffffff, 0.25);
    sun.position.set(-0.7, 1.0, 1.0); // both go with the camera: no side of the hand lies in the dark
    fill.position.set(1.0, 0.2, 0.6);
    this.orbit.camera.add(sun, sun.target, fill, fill.target);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xb9c2cc, 0.62), this.orbit.camera);
    this.layers = Object.fromEntries(film.layers.map((layer) => [layer.key, layer.shown]));
    this.bodies = film.items.map((item) => new Body(item, this.times.length));
    const world = new THREE.Group(); // gravity points down in the picture, whatever it does in the base frame
    world.applyMatrix4(this.orbit.upright);
    world.add(...this.bodies.map((body) => body.object));
    this.scene.add(world);
    this.drawn = () => {};
    this.setTime(this.times[0]);
  }

  /** Move to a time; before the first and after the last frame that frame stays. */
  setTime(time) {
    const times = this.times, last = times.length - 1;
    let low = 0, high = last;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    const span = times[high] - times[low];
    const share = span > 0 ? Math.max(0, Math.min(1, (time - times[low]) / span)) : 0;
    for (const body of this.bodies) body.at(low + share);
    this.draw();
  }

  /** Marks of slip in the picture, in words. */
  slipping() {
    const marks = this.bodies.filter((body) => body.layer === "slip" && body.object.visible);
    const names = marks.map((body) => body.name.slice("slip/".length).replace(/_tip$/, "").replaceAll("_", " "));
    return names.length ? `slipping: ${names.join(", ")}` : "";
  }

  setLayer(key, shown) {
    this.layers[key] = shown;
    this.draw();
  }

  resize(width, height) {
    if (!width || !height || (this.size && this.size[0] === width && this.size[1] === height)) return;
    this.size = [width, height];
    this.renderer.setPixelRatio(window.devicePixelRatio);
    this.renderer.setSize(width, height, false);
    this.orbit.camera.aspect = width / height;
    this.orbit.place();
    this.draw();
  }

  draw() {
    if (!this.size) return;
    for (const body of this.bodies) body.object.visible = body.shown && this.layers[body.layer];
    this.drawn(this);
    if (this.overlay) this.overlay.draw();
    this.renderer.render(this.scene, this.orbit.camera);
  }
}
