// Columns of the file and what they look like.

const TYPES = { u1: Uint8Array, i1: Int8Array, u2: Uint16Array, i2: Int16Array, u4: Uint32Array, i4: Int32Array, f4: Float32Array, f8: Float64Array };

// Text of a column → typed array: base64, DEFLATE, planes of equal weight.
async function decodeColumn(text, type) {
  const packed = Uint8Array.fromBase64 ? Uint8Array.fromBase64(text) : Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const Type = TYPES[type], size = Type.BYTES_PER_ELEMENT, count = planes.length / size;
  if (size === 1) return new Type(planes.buffer);
  const bytes = new Uint8Array(planes.length);
  for (let k = 0; k < size; k++) for (let i = 0, from = k * count, to = k; i < count; i++, to += size) bytes[to] = planes[from + i];
  return new Type(bytes.buffer);
}

// Reads all columns; each text is let go once it is decoded.
async function readData(meta) {
  const texts = [...document.querySelectorAll("script.column")];
  const read = async list => {
    const columns = new Map();
    for (const { name, type } of list) {
      const element = texts.shift();
      columns.set(name, await decodeColumn(element.textContent, type));
      element.remove();
    }
    return columns;
  };
  const columns = await read(meta.columns), nodes = await read(meta.nodes);
  const order = columns.get("");
  columns.delete("");
  return { count: meta.count, columns, nodes, order };
}

// What a menu of channels offers: colours first, then single numbers.
function listChannels(columns) {
  const channels = [], has = name => columns.has(name);
  for (const name of columns.keys()) {
    const base = name.endsWith("_r") && name.slice(0, -2);
    if (base && has(base + "_g") && has(base + "_b")) channels.push({ name: base, kind: "colour", parts: ["_r", "_g", "_b"].map(s => columns.get(base + s)) });
  }
  if (["red", "green", "blue"].every(has)) channels.push({ name: "red green blue", kind: "bytes", parts: ["red", "green", "blue"].map(n => columns.get(n)) });
  if (["nx", "ny", "nz"].every(has)) channels.push({ name: "normal", kind: "vector", parts: ["nx", "ny", "nz"].map(n => columns.get(n)) });
  for (const [name, column] of columns) channels.push({ name, kind: "scalar", parts: [column] });
  return channels;
}

// Index into `parts` of what is drawn: elements themselves, or area-weighted means over nodes.
function channelValues(channel, shown, weights) {
  const { groups, first, count } = shown;
  if (!groups) return channel.parts;
  return channel.parts.map(part => {
    const means = new Float32Array(groups.length);
    groups.forEach((g, k) => {
      let sum = 0, weight = 0;
      for (let i = first[g], end = first[g] + count[g]; i < end; i++) {
        const w = weights ? weights[i] : 1;
        sum += w * part[i];
        weight += w;
      }
      means[k] = sum / weight;
    });
    return means;
  });
}

// Stops that bring the mean of a colour to middle grey, as the `red green blue` of the files have it.
function autoScale(parts) {
  let sum = 0, n = 0;
  for (const part of parts) for (let i = 0; i < part.length; i++) if (Number.isFinite(part[i])) { sum += part[i]; n++; }
  return sum > 0 ? 0.2 * n / sum : 1;
}

// Range that holds all but the outermost hundredths.
function fitRange(values) {
  const step = Math.max(1, Math.floor(values.length / 100000)), sample = [];
  for (let i = 0; i < values.length; i += step) if (Number.isFinite(values[i])) sample.push(values[i]);
  if (!sample.length) return [0, 1];
  sample.sort((a, b) => a - b);
  const at = t => sample[Math.round(t * (sample.length - 1))];
  let low = at(0.01), high = at(0.99);
  if (low === high) [low, high] = [sample[0], sample.at(-1)];
  return low === high ? [low - 0.5, high + 0.5] : [low, high];
}

// Black-blue over green to yellow, even in lightness: nine colours, linear between them.
const MAP = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121], [144, 215, 67], [253, 231, 37]];
function mapColour(t) {
  const x = Math.min(Math.max(t, 0), 1) * (MAP.length - 1), i = Math.min(Math.floor(x), MAP.length - 2), f = x - i;
  return MAP[i].map((a, c) => a + (MAP[i + 1][c] - a) * f);
}

const encode = v => v <= 0.0031308 ? 12.92 * v : 1.055 * Math.pow(v, 1 / 2.4) - 0.055;
const SRGB = Uint8Array.from({ length: 4097 }, (_, i) => Math.round(255 * encode(i / 4096)));
const GREY = 0x80;

// Writes a colour of 8 bits a channel for everything that is drawn, at bytes `offset + k·stride`.
function writeColours(channel, values, look, bytes, offset, stride) {
  const n = values[0].length, ok = Number.isFinite;
  if (channel.kind === "scalar") {
    const table = Uint8Array.from({ length: 768 }, (_, i) => mapColour(Math.floor(i / 3) / 255)[i % 3]);
    const span = look.high - look.low, v = values[0];
    for (let k = 0, o = offset; k < n; k++, o += stride) {
      const t = span ? (v[k] - look.low) / span : 0.5, at = 3 * Math.round(255 * Math.min(Math.max(t, 0), 1));
      for (let c = 0; c < 3; c++) bytes[o + c] = ok(v[k]) ? table[at + c] : GREY;
    }
    return;
  }
  const scale = channel.kind === "colour" ? look.scale : 1;
  for (let c = 0; c < 3; c++) {
    const v = values[c];
    for (let k = 0, o = offset + c; k < n; k++, o += stride) {
      if (!ok(v[k])) bytes[o] = GREY;
      else if (channel.kind === "bytes") bytes[o] = Math.round(v[k]);
      else if (channel.kind === "vector") bytes[o] = Math.round(127.5 + 127.5 * v[k]);
      else bytes[o] = SRGB[Math.round(4096 * Math.min(Math.max(v[k] * scale, 0), 1))];
    }
  }
}

// The shortest decimal that is the same float.
function shortest(value, type) {
  if (!(type instanceof Float32Array)) return String(value);
  for (let digits = 1; digits < 10; digits++) {
    const text = value.toPrecision(digits);
    if (Math.fround(Number(text)) === value) return String(Number(text));
  }
  return String(value);
}
