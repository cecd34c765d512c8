// The controls.

const $ = id => document.getElementById(id);

class Viewer {
  constructor(meta, data) {
    this.meta = meta;
    this.data = data;
    this.channels = listChannels(data.columns);
    this.painter = new Painter($("view"));
    this.look = { points: false, cull: false, size: 1, picked: -1, scale: 1, low: 0, high: 1 };
    const [x, y, z] = ["x", "y", "z"].map(n => data.columns.get(n));
    const low = [Infinity, Infinity, Infinity], high = low.map(v => -v);
    [x, y, z].forEach((column, c) => column.forEach(v => { low[c] = Math.min(low[c], v); high[c] = Math.max(high[c], v); }));
    // Places on the graphics card are relative to the middle: floats are finest there.
    this.origin = low.map((v, c) => (v + high[c]) / 2);
    this.camera = new Camera(low.map((v, c) => v - this.origin[c]), high.map((v, c) => v - this.origin[c]));
    this.weights = this.areas();
    this.deepest = data.nodes.get("depth").reduce((most, d) => Math.max(most, d >> 1), 0);
    this.setUp();
    this.listen();
    this.setLevel(this.deepest + 1);
  }

  // Areas of elements; none when the file has no sizes.
  areas() {
    const get = n => this.data.columns.get(n), area = get("_area"), radius = get("radius"), [along, across] = [get("radius_along"), get("radius_across")];
    if (area) return area;
    if (radius) return Float32Array.from(radius, r => Math.PI * r * r);
    if (along && across) return Float32Array.from(along, (r, i) => Math.PI * r * across[i]);
    return null;
  }

  setUp() {
    const { meta, look } = this, groups = [["colour", "Colours"], ["bytes", "Colours"], ["vector", "Colours"], ["scalar", "Numbers"]];
    const heads = new Map();
    this.channels.forEach((channel, i) => {
      const label = groups.find(g => g[0] === channel.kind)[1];
      if (!heads.has(label)) heads.set(label, $("channel").appendChild(Object.assign(document.createElement("optgroup"), { label })));
      heads.get(label).append(new Option(channel.name, i));
    });
    $("summary").textContent = `${meta.count.toLocaleString("en")} element${meta.count === 1 ? "" : "s"}`;
    $("comments").textContent = meta.comments.join("\n") || "It says nothing about itself.";
    look.points = !(meta.oriented && meta.sized);
    $("disc").disabled = $("cull").disabled = look.points;
    $(look.points ? "point" : "disc").checked = true;
    // A closed room is looked into through the walls nearest to the eye.
    $("cull").checked = look.cull = meta.oriented && this.facesInwards();
    Object.assign($("level"), { max: this.deepest + 1, value: this.deepest + 1 });
    const context = $("legend").getContext("2d");
    for (let i = 0; i < 256; i++) {
      context.fillStyle = `rgb(${mapColour(i / 255).map(Math.round)})`;
      context.fillRect(i, 0, 1, 1);
    }
  }

  facesInwards() {
    const get = n => this.data.columns.get(n), names = ["x", "y", "z"];
    let sum = 0;
    for (let i = 0; i < this.data.count; i++) {
      for (let c = 0; c < 3; c++) sum += (this.weights ? this.weights[i] : 1) * get("n" + names[c])[i] * (this.origin[c] - get(names[c])[i]);
    }
    return sum > 0;
  }

  // Elements for a level past the deepest, else nodes of that depth and leaves above it.
  setLevel(level) {
    const { data, deepest } = this, depth = data.nodes.get("depth");
    this.level = level;
    this.shown = { groups: null, first: data.nodes.get("first"), count: data.nodes.get("count") };
    if (level <= deepest) {
      const groups = [];
      depth.forEach((d, i) => { if (d >> 1 === level || (d & 1 && d >> 1 < level)) groups.push(i); });
      this.shown.groups = groups;
    }
    const { groups } = this.shown, n = groups ? groups.length : data.count;
    this.bytes = new ArrayBuffer(n * STRIDE);
    const floats = new Float32Array(this.bytes), signed = new Int8Array(this.bytes), source = groups ? data.nodes : data.columns;
    const places = ["x", "y", "z"].map(c => source.get(c)), normals = ["nx", "ny", "nz"].map(c => source.get(c));
    const areas = groups ? data.nodes.get("area") : this.weights;
    for (let k = 0; k < n; k++) {
      const i = groups ? groups[k] : k, at = k * STRIDE;
      for (let c = 0; c < 3; c++) floats[at / 4 + c] = places[c][i] - this.origin[c];
      const normal = normals[0] ? normals.map(v => v[i]) : [0, 0, 0], length = Math.hypot(...normal);
      normal.forEach((v, c) => { signed[at + NORMAL + c] = length > 0 ? Math.round(127 * v / length) : c === 1 ? 127 : 0; });
      floats[(at + RADIUS) / 4] = areas ? Math.sqrt(areas[i] / Math.PI) : 0;
    }
    const elements = level > deepest;
    $("level-value").textContent = elements ? "elements" : `${level}: ${n.toLocaleString("en")} node${n === 1 ? "" : "s"}`;
    $("level").setAttribute("aria-valuetext", $("level-value").textContent);
    this.forget();
    this.setChannel();
  }

  setChannel(fit = true) {
    this.channel = this.channels[$("channel").value];
    this.values = channelValues(this.channel, this.shown, this.weights);
    $("colour-controls").hidden = this.channel.kind !== "colour";
    $("scalar-controls").hidden = this.channel.kind !== "scalar";
    // Of the elements: the same brightness and range at every level.
    if (fit && this.fitted !== this.channel) {
      this.fitted = this.channel;
      if (this.channel.kind === "colour") this.automatic = autoScale(this.channel.parts);
      if (this.channel.kind === "scalar") this.fit();
    }
    this.recolour();
  }

  fit() {
    const [low, high] = fitRange(this.channel.parts[0]);
    $("low").value = shortest(Math.fround(low), new Float32Array());
    $("high").value = shortest(Math.fround(high), new Float32Array());
  }

  recolour() {
    const { look } = this, stops = Number($("exposure").value);
    look.scale = (this.automatic || 1) * 2 ** stops;
    [look.low, look.high] = [Number($("low").value), Number($("high").value)];
    $("exposure-value").textContent = `${stops > 0 ? "+" : ""}${stops} stops`;
    writeColours(this.channel, this.values, look, new Uint8Array(this.bytes), COLOUR, STRIDE);
    this.painter.load(this.bytes);
    this.draw();
  }

  draw() {
    if (this.asked) return;
    this.asked = requestAnimationFrame(() => {
      this.asked = 0;
      this.painter.resize();
      this.painter.paint(this.camera, this.look);
    });
  }

  pick(x, y) {
    this.painter.resize();
    const k = this.painter.pick(this.camera, this.look, x, y);
    if (k < 0) return this.forget();
    this.look.picked = k;
    $("unpick").disabled = false;
    const { groups } = this.shown;
    this.tell(groups ? `Node ${groups[k]}` : `Element ${this.data.order[k]}`, groups ? this.ofNode(k, groups[k]) : this.ofElement(k));
    this.draw();
  }

  ofElement(k) {
    return [...this.data.columns].map(([name, column]) => [name, shortest(column[k], column)]);
  }

  ofNode(k, g) {
    const rows = [...this.data.nodes].filter(([name]) => !["first", "depth"].includes(name)).map(([name, column]) => [name === "count" ? "elements" : name, shortest(column[g], column)]);
    const names = this.channel.parts.length === 3 ? (this.channel.kind === "colour" ? [" r", " g", " b"] : [" 1", " 2", " 3"]) : [""];
    return [["level", String(this.data.nodes.get("depth")[g] >> 1)], ...rows, ...names.map((n, c) => [`mean ${this.channel.name}${n}`, shortest(this.values[c][k], this.values[c])])];
  }

  forget() {
    this.look.picked = -1;
    $("unpick").disabled = true;
    this.tell("Nothing picked", []);
    this.draw();
  }

  tell(title, rows) {
    $("picked-title").textContent = title;
    $("picked").tBodies[0].replaceChildren(...rows.map(([name, value]) => {
      const row = document.createElement("tr"), head = document.createElement("th");
      head.scope = "row";
      head.textContent = name;
      row.append(head);
      row.insertCell().textContent = value;
      return row;
    }));
  }

  // Place on the canvas, CSS pixels, of something that is drawn.
  project(k) {
    const m = this.camera.matrix(this.painter.aspect()), p = [...new Float32Array(this.bytes, k * STRIDE, 3), 1], canvas = $("view");
    const [x, y, , w] = [0, 1, 2, 3].map(r => p.reduce((sum, v, c) => sum + m[4 * c + r] * v, 0));
    return [(x / w + 1) / 2 * canvas.clientWidth, (1 - y / w) / 2 * canvas.clientHeight];
  }

  listen() {
    const on = (id, event, act) => $(id).addEventListener(event, act), { look, camera } = this, canvas = $("view");
    on("channel", "change", () => this.setChannel());
    on("exposure", "input", () => this.recolour());
    on("low", "change", () => this.recolour());
    on("high", "change", () => this.recolour());
    on("fit", "click", () => { this.fit(); this.recolour(); });
    on("level", "input", () => this.setLevel(Number($("level").value)));
    on("reset", "click", () => { camera.reset(); this.draw(); });
    on("unpick", "click", () => this.forget());
    on("cull", "change", () => { look.cull = $("cull").checked; this.draw(); });
    const size = () => {
      look.size = 2 ** Number($("size").value);
      $("size-value").textContent = `× ${look.size.toPrecision(2)}`;
      this.draw();
    };
    on("size", "input", size);
    size();
    for (const radio of document.getElementsByName("shape")) radio.addEventListener("change", () => { look.points = $("point").checked; this.draw(); });
    new ResizeObserver(() => this.draw()).observe(canvas);
    this.point(canvas);
    canvas.addEventListener("wheel", e => { e.preventDefault(); camera.zoom(Math.exp(e.deltaY * (e.deltaMode ? 0.05 : 0.0015))); this.draw(); }, { passive: false });
    canvas.addEventListener("contextmenu", e => e.preventDefault());
    canvas.addEventListener("keydown", e => {
      const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
      if (e.ctrlKey || e.metaKey || e.altKey) return;
      if (arrows) e.shiftKey ? camera.move(-0.05 * arrows[0], -0.05 * arrows[1]) : camera.turn(-0.1 * arrows[0], 0.1 * -arrows[1]);
      else if (e.key === "+" || e.key === "=") camera.zoom(0.9);
      else if (e.key === "-") camera.zoom(1 / 0.9);
      else if (e.key === "0") camera.reset();
      else if (e.key === "Enter") this.pick(canvas.clientWidth / 2, canvas.clientHeight / 2);
      else if (e.key === "Escape") this.forget();
      else return;
      e.preventDefault();
      this.draw();
    });
  }

  // Mouse, pen and fingers: one turns, two (or the right button, or shift) move and pinch, a tap picks.
  point(canvas) {
    const down = new Map(), { camera } = this;
    let moved = 0;
    const two = () => {
      const [a, b] = [...down.values()];
      return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.max(1, Math.hypot(a.x - b.x, a.y - b.y)) };
    };
    canvas.addEventListener("pointerdown", e => {
      canvas.setPointerCapture(e.pointerId);
      if (!down.size) moved = 0;
      down.set(e.pointerId, { x: e.offsetX, y: e.offsetY });
      if (down.size > 1) moved = Infinity;
    });
    canvas.addEventListener("pointermove", e => {
      const last = down.get(e.pointerId);
      if (!last) return;
      const height = canvas.clientHeight, before = down.size > 1 && two(), [dx, dy] = [e.offsetX - last.x, e.offsetY - last.y];
      down.set(e.pointerId, { x: e.offsetX, y: e.offsetY });
      moved += Math.abs(dx) + Math.abs(dy);
      if (before) {
        const after = two();
        camera.move((after.x - before.x) / height, (after.y - before.y) / height);
        camera.zoom(before.apart / after.apart);
      } else if (e.buttons & 2 || e.shiftKey) camera.move(dx / height, dy / height);
      else camera.turn(dx / height * 4, dy / height * 4);
      this.draw();
    });
    const up = (e, tap) => {
      if (!down.delete(e.pointerId) || down.size) return;
      if (tap && e.button === 0 && moved < (e.pointerType === "mouse" ? 4 : 12)) this.pick(e.offsetX, e.offsetY);
    };
    canvas.addEventListener("pointerup", e => up(e, true));
    canvas.addEventListener("pointercancel", e => up(e, false));
  }
}

(async () => {
  try {
    const meta = JSON.parse($("meta").textContent);
    window.viewer = new Viewer(meta, await readData(meta));
    $("message").hidden = true;
  } catch (error) {
    $("message").textContent = `This page cannot be shown: ${error.message}`;
    console.error(error);
  }
})();
