'use strict';
// A picture: linear colours as half floats, decoded once, drawn at an exposure into a canvas of its own size.

// Value of every half float.
const HALF = new Float32Array(65536);
for (let i = 0; i < 65536; i++) {
  const exponent = (i >> 10) & 31, mantissa = i & 1023, sign = i & 32768 ? -1 : 1;
  HALF[i] = exponent === 31 ? (mantissa ? NaN : sign * Infinity) : sign * (exponent ? 2 ** (exponent - 15) * (1 + mantissa / 1024) : 2 ** -24 * mantissa);
}
const srgb = v => Math.round(255 * (v <= 0.0031308 ? 12.92 * Math.max(v, 0) : 1.055 * Math.min(v, 1) ** (1 / 2.4) - 0.055));

async function decode(base64) {
  const image = new Image();
  image.src = 'data:image/png;base64,' + base64;
  await image.decode();
  const canvas = document.createElement('canvas');
  canvas.width = image.width; canvas.height = image.height;
  const context = canvas.getContext('2d', { willReadFrequently: true, colorSpace: 'srgb' });
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, image.width, image.height).data;
}

// false colour from 0 to 1: black, violet, red, orange, pale yellow
const STOPS = [[0, 0, 4], [81, 18, 124], [183, 55, 121], [252, 137, 97], [252, 253, 191]];
function heat(t) {
  const x = Math.min(Math.max(t, 0), 1) * (STOPS.length - 1), i = Math.min(Math.floor(x), STOPS.length - 2), f = x - i;
  return STOPS[i].map((a, c) => a + (STOPS[i + 1][c] - a) * f);
}

class Picture {
  constructor(shown, width, height) {
    Object.assign(this, { shown, width, height, drawn: new Map() });
  }
  async load() {
    if (this.bits) return this;
    const bytes = await decode(this.shown.colors), n = this.width * this.height;
    this.bits = new Uint16Array(3 * n);
    for (let i = 0; i < n; i++) for (let c = 0; c < 3; c++) this.bits[3 * i + c] = bytes[4 * i + c] << 8 | bytes[4 * (n + i) + c];
    for (const name of ['flip', 'locations']) if (this.shown[name]) this[name] = (await decode(this.shown[name])).filter((_, i) => i % 4 === 0);
    return this;
  }
  at(x, y) {
    const i = 3 * (y * this.width + x);
    return [0, 1, 2].map(c => HALF[this.bits[i + c]]);
  }
  // A canvas of one kind: 'picture', 'signed', 'absolute' (against `reference`, `gain` times), 'flip', 'locations'.
  canvas(kind, exposure, reference, gain) {
    const key = [kind, exposure, gain].join();
    if (this.drawn.has(key)) return this.drawn.get(key);
    if (this.drawn.size > 8) this.drawn.clear();
    const canvas = document.createElement('canvas');
    canvas.width = this.width; canvas.height = this.height;
    const context = canvas.getContext('2d'), image = context.createImageData(this.width, this.height), out = image.data;
    const n = this.width * this.height, scale = 2 ** exposure;
    const table = new Uint8Array(65536);
    if (kind === 'picture' || kind === 'absolute') for (let i = 0; i < 65536; i++) table[i] = srgb(HALF[i] * scale);
    for (let i = 0; i < n; i++) {
      let color;
      if (kind === 'picture') {
        color = [0, 1, 2].map(c => table[this.bits[3 * i + c]]);
        if ([0, 1, 2].some(c => Number.isNaN(HALF[this.bits[3 * i + c]]))) color = [255, 0, 255];
      } else if (kind === 'absolute') {
        color = [0, 1, 2].map(c => srgb(gain * scale * Math.abs(HALF[this.bits[3 * i + c]] - HALF[reference.bits[3 * i + c]])));
      } else if (kind === 'signed') {
        let d = 0;
        for (let c = 0; c < 3; c++) d += [0.2126, 0.7152, 0.0722][c] * (HALF[this.bits[3 * i + c]] - HALF[reference.bits[3 * i + c]]);
        const v = srgb(gain * scale * Math.abs(d));
        color = d > 0 ? [v, v * 0.35, 0] : [0, v * 0.45, v];
      } else if (kind === 'flip') {
        color = heat(this.flip[i] / 255);
      } else {
        color = [255, 220, 40];
        out[4 * i + 3] = this.locations[i] ? 255 : 0;
      }
      out.set(color, 4 * i);
      if (kind !== 'locations') out[4 * i + 3] = 255;
    }
    context.putImageData(image, 0, 0);
    this.drawn.set(key, canvas);
    return canvas;
  }
}
