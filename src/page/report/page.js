// The page: sections with a parted pair, a strip of maps that zoom with it, tables, switches and sweeps.
const DATA = JSON.parse(document.getElementById('data').textContent);
const GAIN = 4;

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
    else if (value !== false && value != null) element.setAttribute(key, value);
  }
  element.append(...children.filter(c => c != null));
  return element;
}
const figure = (v, digits = 3) => v == null ? '–' : Math.abs(v) >= 1e4 || (Math.abs(v) < 1e-2 && v !== 0) ? v.toExponential(digits - 1) : String(+v.toPrecision(digits));
const times = v => v == null ? '–' : v >= 100 ? String(Math.round(v)) : String(+v.toPrecision(2));

class SectionView {
  constructor(data) {
    Object.assign(this, { data, split: 0.5, zoom: 1, cx: data.width / 2, cy: data.height / 2, exposure: data.exposure, dots: false, pair: [...data.pair], surfaces: [], hover: null });
    this.pictures = new Map(data.shown.map(s => [s.name, new Picture(s, data.width, data.height)]));
    this.root = make('section', { id: data.id }, make('h2', {}, data.title), data.text ? make('p', {}, data.text) : null);
    new IntersectionObserver((seen, observer) => {
      if (seen.some(s => s.isIntersecting)) { observer.disconnect(); this.start(); }
    }, { rootMargin: '600px' }).observe(this.root);
    this.build();
  }
  get reference() { return this.pictures.get(this.data.reference); }

  build() {
    const { data } = this, names = data.shown.map(s => s.name);
    const choose = (side, label) => {
      const list = make('select', { 'aria-label': label, onchange: e => this.show(side, e.target.value) }, ...names.map(n => make('option', { value: n }, n)));
      list.value = this.pair[side];
      return list;
    };
    this.lists = [choose(0, 'left picture'), choose(1, 'right picture')];
    const exposure = make('input', { type: 'range', min: data.exposure - 6, max: data.exposure + 6, step: 0.25, 'aria-label': 'exposure', oninput: e => { this.exposure = +e.target.value; this.draw(); } });
    exposure.value = data.exposure;
    const dots = data.shown.some(s => s.locations) ? make('label', {}, make('input', { type: 'checkbox', class: 'dots', onchange: e => { this.dots = e.target.checked; this.draw(); } }), 'sample locations') : null;
    this.root.append(make('div', { class: 'bar' },
      make('label', {}, 'left', this.lists[0]), make('label', {}, 'right', this.lists[1]), make('label', {}, 'exposure', exposure), dots,
      make('span', {}, make('button', { title: 'zoom out', onclick: () => this.scaleBy(0.5) }, '−'), ' ', make('button', { title: 'zoom in', onclick: () => this.scaleBy(2) }, '+'), ' ',
        make('button', { title: 'whole picture', onclick: () => { this.zoom = 1; this.draw(); } }, 'fit'))));
    if (data.toggles.length) this.root.append(make('div', { class: 'bar' }, ...data.toggles.flatMap(t => [t.label + ':',
      ...[['off', t.off], ['on', t.on]].map(([word, name]) => make('button', { 'data-picture': name, 'aria-pressed': 'false', onclick: () => this.show(0, name) }, word))])));
    if (data.sweep) this.root.append(this.sweep());
    this.stage = this.surface('pair');
    // A tall picture must not be taller than the window.
    this.stage.style.maxWidth = `${82 * data.width / data.height}vh`;
    this.tags = ['left', 'right'].map(side => make('span', { class: 'tag ' + side }));
    this.divider = make('div', { class: 'divider', role: 'slider', tabindex: 0, 'aria-label': 'divider between the left and the right picture', 'aria-valuemin': 0, 'aria-valuemax': 100 });
    this.stage.append(...this.tags, this.divider);
    this.values = make('div', { class: 'values' });
    this.root.append(this.stage, this.values, make('div', { class: 'strip' }));
    this.listen();
    this.root.append(...this.tables());
    this.describe();
  }

  surface(kind) {
    const canvas = make('canvas', { role: 'img', 'aria-label': kind });
    const stage = make('div', { class: 'stage', style: `aspect-ratio:${this.data.width}/${this.data.height}` }, canvas);
    this.surfaces.push({ kind, canvas });
    this.panAndZoom(canvas);
    return stage;
  }

  panAndZoom(canvas) {
    const held = new Map();
    const spot = e => { const r = canvas.getBoundingClientRect(); return [(e.clientX - r.left) / r.width, (e.clientY - r.top) / r.height]; };
    canvas.addEventListener('wheel', e => { e.preventDefault(); this.scaleBy(2 ** (-e.deltaY / 240), spot(e)); }, { passive: false });
    canvas.addEventListener('pointerdown', e => { canvas.setPointerCapture(e.pointerId); held.set(e.pointerId, spot(e)); this.point(spot(e)); });
    canvas.addEventListener('pointermove', e => {
      const to = spot(e), from = held.get(e.pointerId);
      this.point(to);
      if (!from) return;
      held.set(e.pointerId, to);
      if (held.size === 1) {
        this.cx -= (to[0] - from[0]) * this.data.width / this.zoom;
        this.cy -= (to[1] - from[1]) * this.data.height / this.zoom;
      } else {
        const other = [...held].find(([id]) => id !== e.pointerId)[1], apart = p => Math.hypot(p[0] - other[0], p[1] - other[1]);
        this.zoom *= apart(to) / Math.max(apart(from), 1e-3);
      }
      this.draw();
    });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, e => held.delete(e.pointerId));
    canvas.addEventListener('pointerleave', () => { this.hover = null; this.tell(); });
  }

  listen() {
    const move = e => { const r = this.stage.getBoundingClientRect(); this.part((e.clientX - r.left) / r.width); };
    this.divider.addEventListener('pointerdown', e => { this.divider.setPointerCapture(e.pointerId); move(e); e.preventDefault(); this.divider.focus(); });
    this.divider.addEventListener('pointermove', e => { if (this.divider.hasPointerCapture(e.pointerId)) move(e); });
    this.divider.addEventListener('keydown', e => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[e.key];
      if (step) { this.part(this.split + step); e.preventDefault(); }
    });
    new ResizeObserver(() => this.draw()).observe(this.stage);
    this.part(0.5);
  }

  // A place of a canvas (0..1) in pixels of the picture.
  pixel([u, v]) { return [this.cx + (u - 0.5) * this.data.width / this.zoom, this.cy + (v - 0.5) * this.data.height / this.zoom]; }

  scaleBy(factor, spot = [0.5, 0.5]) {
    const [x, y] = this.pixel(spot);
    this.zoom = Math.min(Math.max(this.zoom * factor, 1), 64);
    this.cx = x - (spot[0] - 0.5) * this.data.width / this.zoom;
    this.cy = y - (spot[1] - 0.5) * this.data.height / this.zoom;
    this.draw();
  }

  part(share) {
    this.split = Math.min(Math.max(share, 0), 1);
    this.divider.style.left = 100 * this.split + '%';
    this.divider.setAttribute('aria-valuenow', Math.round(100 * this.split));
    this.draw();
  }

  show(side, name) {
    this.pair[side] = name;
    this.lists[side].value = name;
    this.describe();
    this.strip();
  }

  describe() {
    this.tags.forEach((tag, i) => { tag.textContent = this.pair[i]; });
    this.root.querySelectorAll('[data-picture]').forEach(b => b.setAttribute('aria-pressed', String(b.dataset.picture === this.pair[0])));
  }

  point(spot) {
    const [x, y] = this.pixel(spot).map(Math.floor);
    this.hover = x >= 0 && y >= 0 && x < this.data.width && y < this.data.height ? [x, y] : null;
    this.tell();
  }

  tell() {
    if (!this.hover || !this.loaded) { this.values.textContent = 'Point at a pixel for its values; wheel or pinch to zoom, drag to move.'; return; }
    const row = name => `${name}: ${this.pictures.get(name).at(...this.hover).map(v => figure(v, 3)).join('  ')}`;
    this.values.textContent = `pixel ${this.hover.join(', ')}\n` + [...new Set([...this.pair, ...(this.reference ? [this.data.reference] : [])])].map(row).join('    ');
  }

  async start() {
    this.loaded = true;
    this.tell();
    await this.strip();
    this.root.dataset.ready = 'true';
  }

  // The maps of the left picture against the reference.
  async strip() {
    if (!this.loaded) return;
    await Promise.all([...new Set([...this.pair, ...(this.reference ? [this.data.reference] : [])])].map(n => this.pictures.get(n).load()));
    const left = this.pictures.get(this.pair[0]), strip = this.root.querySelector('.strip');
    this.surfaces = this.surfaces.slice(0, 1);
    strip.replaceChildren();
    if (this.reference && left !== this.reference) {
      const kinds = [['signed', `${left.shown.name} − ${this.data.reference}, ${GAIN} ×: brighter orange, darker blue`], ['absolute', `|${left.shown.name} − ${this.data.reference}|, ${GAIN} ×`]];
      if (left.flip) kinds.push(['flip', `FLIP of ${left.shown.name}: black equal, yellow different`]);
      for (const [kind, caption] of kinds) strip.append(make('figure', {}, this.surface(kind), make('figcaption', {}, caption)));
    }
    this.draw();
  }

  draw() {
    if (!this.loaded || !this.pair.every(n => this.pictures.get(n).bits)) return;
    const { width, height } = this.data;
    this.zoom = Math.min(Math.max(this.zoom, 1), 64);
    const clamp = (c, size) => Math.min(Math.max(c, size / 2 / this.zoom), size - size / 2 / this.zoom);
    this.cx = clamp(this.cx, width); this.cy = clamp(this.cy, height);
    for (const { kind, canvas } of this.surfaces) {
      const density = window.devicePixelRatio || 1;
      canvas.width = Math.max(1, Math.round(canvas.clientWidth * density)); canvas.height = Math.max(1, Math.round(canvas.clientHeight * density));
      const context = canvas.getContext('2d'), scale = canvas.width / width * this.zoom;
      context.imageSmoothingEnabled = scale < 1;
      const put = image => context.drawImage(image, canvas.width / 2 - this.cx * scale, canvas.height / 2 - this.cy * scale, width * scale, height * scale);
      if (kind === 'pair') {
        this.pair.forEach((name, side) => {
          const picture = this.pictures.get(name), edge = this.split * canvas.width;
          context.save();
          context.beginPath();
          context.rect(side ? edge : 0, 0, side ? canvas.width - edge : edge, canvas.height);
          context.clip();
          put(picture.canvas('picture', this.exposure));
          if (this.dots && picture.locations) put(picture.canvas('locations'));
          context.restore();
        });
      } else {
        const left = this.pictures.get(this.pair[0]);
        if (kind !== 'flip' || left.flip) put(left.canvas(kind, this.exposure, this.reference, GAIN));
      }
    }
    this.tell();
  }

  tables() {
    const { data } = this, parts = [];
    const table = (head, rows) => make('div', { class: 'scroll' }, make('table', {}, make('thead', {}, make('tr', {}, ...head.map(h => make('th', {}, h)))), make('tbody', {}, ...rows.map(r => make('tr', {}, ...r.map(c => make('td', {}, String(c))))))));
    const judged = data.shown.filter(s => s.error);
    if (judged.length) {
      parts.push(table([`against ${data.reference}`, 'relMSE', 'without 0.1 % worst', '± (1 σ)', 'bias', 'FLIP'],
        judged.map(s => [s.name, figure(s.error.relmse), figure(s.error.relmse_trimmed), figure(s.error.relmse_trimmed_standard_error, 2), (s.error.bias >= 0 ? '+' : '−') + Math.abs(100 * s.error.bias).toFixed(2) + ' %', s.error.flip.toFixed(3)])));
      if (!judged[0].error.halves) parts.push(make('p', { class: 'small' }, 'The reference has no two halves: its own noise counts as error here.'));
    }
    if (data.reference_noise != null) {
      const noise = `Noise of ${data.reference} itself: relMSE ${figure(data.reference_noise, 2)}. ` +
        'Its two halves keep it out of relMSE, MSE and bias on average.';
      parts.push(make('p', { class: 'small noise' }, noise));
    }
    for (const doubt of data.doubts) parts.push(make('p', { class: 'small noise' }, doubt));
    const timed = data.shown.filter(s => s.cpu_seconds != null || s.wall_seconds != null);
    if (timed.length) {
      const keys = [...new Set(timed.flatMap(s => s.facts.map(f => f[0])))];
      const fact = (s, key) => { const f = s.facts.find(f => f[0] === key); return f ? key === 'peak_rss_bytes' ? Math.round(f[1] / 2 ** 20) + ' MiB' : (Number.isInteger(f[1]) ? f[1].toLocaleString('en') : figure(f[1], 3)) : '–'; };
      parts.push(table(['time', 'CPU s', 'wall s', ...keys.map(k => k.replace('_bytes', '').replaceAll('_', ' '))], timed.map(s => [s.name, figure(s.cpu_seconds), figure(s.wall_seconds), ...keys.map(k => fact(s, k))])));
    }
    if (data.ratio) {
      parts.push(make('p', { class: 'ratio' }, 'irradiance caching : ours : Monte Carlo = ', make('b', {}, `${times(data.ratio.cache_over_ours)} : 1 : ${times(data.ratio.monte_carlo_over_ours)}`), '; the course: 12 : 1 : 288.'),
        make('p', { class: 'small' }, `CPU seconds over those of ${data.ratio.ours}. Monte Carlo's are the ground truth's own, brought to the error of ${data.ratio.ours} by its noise falling as 1 / samples; ${data.ratio.cache} stands at its own error, in the table above.`));
    }
    return parts;
  }

  sweep() {
    const { label, values, pictures } = this.data.sweep, range = make('input', { type: 'range', class: 'sweep', min: 0, max: values.length - 1, step: 1, 'aria-label': label });
    const errors = pictures.map(n => this.data.shown.find(s => s.name === n)?.error?.relmse_trimmed), text = make('span', { class: 'sweep-value' });
    const known = errors.filter(e => e > 0), box = make('div', { class: 'bar' }, make('label', {}, label, range), text);
    const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
    if (known.length > 1) {
      const low = Math.log(Math.min(...known)), high = Math.log(Math.max(...known)) + 1e-6;
      const x = i => 50 + 340 * i / (values.length - 1), y = e => 130 - 100 * (Math.log(e) - low) / (high - low);
      svg.setAttribute('viewBox', '0 0 420 165'); svg.setAttribute('role', 'img'); svg.setAttribute('aria-label', 'error along ' + label);
      svg.innerHTML = `<path class="axis" d="M40 20V140H410" fill="none"/><text x="44" y="14">relMSE without 0.1 %: ${figure(Math.min(...known), 2)} to ${figure(Math.max(...known), 2)}, log</text>`
        + `<path class="curve" d="M${errors.map((e, i) => e > 0 ? `${x(i)} ${y(e)}` : null).filter(Boolean).join('L')}"/>`
        + errors.map((e, i) => e > 0 ? `<circle class="dot" r="3" cx="${x(i)}" cy="${y(e)}"/>` : '').join('') + values.map((v, i) => `<text x="${x(i)}" y="158" text-anchor="middle">${v}</text>`).join('') + '<circle class="now" r="7"/>';
      box.append(svg);
    }
    const pick = i => {
      text.textContent = `${label} = ${values[i]}` + (errors[i] ? `, relMSE ${figure(errors[i])}` : '');
      const now = svg.querySelector('.now');
      if (now && errors[i] > 0) { now.setAttribute('cx', svg.querySelectorAll('.dot')[errors.slice(0, i + 1).filter(e => e > 0).length - 1].getAttribute('cx')); now.setAttribute('cy', svg.querySelectorAll('.dot')[errors.slice(0, i + 1).filter(e => e > 0).length - 1].getAttribute('cy')); }
    };
    range.value = Math.max(0, pictures.indexOf(this.pair[0]));
    range.addEventListener('input', () => { pick(+range.value); this.show(0, pictures[+range.value]); });
    pick(+range.value);
    return box;
  }
}

document.querySelector('h1').textContent = DATA.title;
document.getElementById('lead').textContent = DATA.text;
const VIEWS = DATA.sections.map(s => new SectionView(s));
document.querySelector('main').append(...VIEWS.map(v => v.root));
if (VIEWS.length > 1) document.querySelector('nav').append(...DATA.sections.map(s => make('a', { href: '#' + s.id }, s.title)));
document.querySelector('footer').textContent = `nearfar ${DATA.version}. relMSE is the mean of (x−r)² / (r² + 0.01 m²), m the mean of the reference; pixel values are rounded to 9 significant bits, figures are not.`;
