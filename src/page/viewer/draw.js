// One buffer, one draw call: every element is a square strip of four vertices, cut to a disc where it is shaded.

// Bytes of an element: place 3 floats, normal 4 signed bytes, colour 4 bytes, radius a float.
const STRIDE = 24, NORMAL = 12, COLOUR = 16, RADIUS = 20;

const VERTEX = `#version 300 es
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 colour;
layout(location = 3) in float radius;
uniform mat4 clip_from_world;
uniform vec3 eye;
uniform vec2 half_pixels;
uniform float size, least;
uniform bool points, cull;
out vec2 at;
flat out vec3 shade;
flat out int id;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  shade = colour;
  id = gl_InstanceID;
  gl_Position = clip_from_world * vec4(place, 1.0);
  // Discs less than a pixel wide would be missed by the pixels' centres; a few small ones, by the eye.
  float up = length(vec3(clip_from_world[0].y, clip_from_world[1].y, clip_from_world[2].y));
  bool tiny = size * radius * up * half_pixels.y < least * gl_Position.w;
  bool hidden = !points && cull && dot(eye - place, normal) <= 0.0;
  if (points || tiny) {
    gl_Position.xy += at * (points ? size : least) / half_pixels * gl_Position.w;
  } else {
    vec3 n = normalize(normal), t = normalize(cross(abs(n.y) < 0.9 ? vec3(0, 1, 0) : vec3(1, 0, 0), n));
    gl_Position = clip_from_world * vec4(place + size * radius * (at.x * t + at.y * cross(n, t)), 1.0);
  }
  if (hidden) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
in vec2 at;
flat in vec3 shade;
flat in int id;
uniform int picked;
uniform bool ids;
out vec4 result;
void main() {
  float r2 = dot(at, at);
  if (r2 > 1.0) discard;
  result = vec4(shade, 1.0);
  if (ids) {
    uint n = uint(id + 1);
    result = vec4(uvec4(n, n >> 8, n >> 16, n >> 24) & 255u) / 255.0;
  } else if (id == picked && r2 > 0.5) {
    result.rgb = r2 > 0.75 ? vec3(1.0) : vec3(0.0);
  }
}`;

class Painter {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("this browser has no WebGL2");
    this.canvas = canvas;
    this.gl = gl;
    this.count = 0;
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    this.at = name => gl.getUniformLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    const inputs = [[3, gl.FLOAT, false, 0], [3, gl.BYTE, true, NORMAL], [3, gl.UNSIGNED_BYTE, true, COLOUR], [1, gl.FLOAT, false, RADIUS]];
    inputs.forEach(([n, type, unit, offset], i) => {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, n, type, unit, STRIDE, offset);
      gl.vertexAttribDivisor(i, 1);
    });
    gl.enable(gl.DEPTH_TEST);
    this.target = { frame: gl.createFramebuffer(), colour: gl.createRenderbuffer(), depth: gl.createRenderbuffer(), width: 0, height: 0 };
  }

  load(bytes) {
    this.gl.bufferData(this.gl.ARRAY_BUFFER, bytes, this.gl.STATIC_DRAW);
    this.count = bytes.byteLength / STRIDE;
  }

  resize() {
    const { canvas } = this, scale = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map(v => Math.max(1, Math.round(v * scale)));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  }

  aspect() {
    return this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
  }

  paint(camera, look, ids = false) {
    const { gl, canvas } = this, pixels = window.devicePixelRatio || 1;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(this.at("clip_from_world"), false, camera.matrix(this.aspect()));
    gl.uniform3fv(this.at("eye"), camera.eye());
    gl.uniform2f(this.at("half_pixels"), canvas.width / 2, canvas.height / 2);
    gl.uniform1f(this.at("size"), look.points ? 1.5 * pixels * look.size : look.size);
    gl.uniform1f(this.at("least"), this.count > 20000 ? 0.75 : 2 * pixels);
    gl.uniform1i(this.at("points"), look.points);
    gl.uniform1i(this.at("cull"), look.cull);
    gl.uniform1i(this.at("picked"), look.picked);
    gl.uniform1i(this.at("ids"), ids);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.count);
  }

  // Number of what is drawn nearest to a place of the canvas (CSS pixels), within a few pixels; −1 for none.
  pick(camera, look, x, y) {
    const { gl, canvas, target } = this, { width, height } = canvas;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    if (target.width !== width || target.height !== height) {
      for (const [buffer, format, point] of [[target.colour, gl.RGBA8, gl.COLOR_ATTACHMENT0], [target.depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
        gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
        gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, point, gl.RENDERBUFFER, buffer);
      }
      Object.assign(target, { width, height });
    }
    const pixels = window.devicePixelRatio || 1, reach = Math.round(4 * pixels), side = 2 * reach + 1;
    const [px, py] = [Math.floor(x * pixels) - reach, height - 1 - Math.floor(y * pixels) - reach];
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(px, py, side, side);
    this.paint(camera, look, true);
    const bytes = new Uint8Array(4 * side * side);
    gl.readPixels(px, py, side, side, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const found = new Uint32Array(bytes.buffer);
    let [best, id] = [Infinity, -1];
    found.forEach((n, i) => {
      const d = (i % side - reach) ** 2 + (Math.floor(i / side) - reach) ** 2;
      if (n && d < best) [best, id] = [d, n - 1];
    });
    return id;
  }
}
