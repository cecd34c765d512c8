// Where the eye is: on a sphere around a target; y stays up.

class Camera {
  constructor(low, high) {
    this.home = { low, high };
    this.reset();
  }
  reset() {
    const { low, high } = this.home;
    this.target = low.map((v, i) => (v + high[i]) / 2);
    this.size = Math.hypot(...low.map((v, i) => high[i] - v)) || 1;
    this.distance = 1.5 * this.size;
    this.yaw = 0.5;
    this.pitch = 0.35;
  }
  // Unit vectors: right, up, towards the eye.
  axes() {
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    return { right: [cy, 0, -sy], up: [-sy * sp, cp, -cy * sp], back: [sy * cp, sp, cy * cp] };
  }
  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.min(Math.max(this.pitch + dy, -1.5), 1.5);
  }
  // By shares of the view's height.
  move(dx, dy) {
    const { right, up } = this.axes(), step = 2 * this.distance * FOCAL;
    this.target = this.target.map((v, i) => v + step * (dy * up[i] - dx * right[i]));
  }
  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 1e-4 * this.size), 20 * this.size);
  }
  // World → clip, columns first.
  matrix(aspect) {
    const { right, up, back } = this.axes(), eye = this.target.map((v, i) => v + this.distance * back[i]);
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const far = this.distance + 2 * this.size, near = Math.max(this.distance * 1e-2, far * 1e-5);
    // A narrow view keeps its width.
    const f = 1 / FOCAL * Math.min(1, aspect), depth = [(far + near) / (near - far), 2 * far * near / (near - far)];
    const rows = [[right, f / aspect], [up, f]].map(([axis, s]) => [...axis.map(v => v * s), -dot(axis, eye) * s]);
    const z = -dot(back, eye);
    rows.push([...back.map(v => v * depth[0]), z * depth[0] + depth[1]], [...back.map(v => -v), -z]);
    return Float32Array.from({ length: 16 }, (_, i) => rows[i % 4][Math.floor(i / 4)]);
  }
  eye() {
    const { back } = this.axes();
    return this.target.map((v, i) => v + this.distance * back[i]);
  }
}

// Tangent of half the angle of view.
const FOCAL = Math.tan(Math.PI / 8);
