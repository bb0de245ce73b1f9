// WebGL: one solid, a box of any size rounded by any radius, and lines of any width.

const SOLID = `
attribute vec3 normal, corner;
uniform mat4 view;
uniform mat3 axes;
uniform vec3 centre, size, sun;
uniform float radius, ground, kind;
varying vec3 facing, place;
void main() {
  vec3 p = centre + axes * (corner * size + normal * radius);
  facing = axes * normal;
  place = p;
  if (kind > 2.5) p = vec3(p.xy - sun.xy * (p.z - ground) / sun.z, ground);
  gl_Position = view * vec4(p, 1.0);
}`;
// kind: 0 lit, 1 a bubble with a visible rim, 2 flat, 3 shadow on the ground
const SOLID_COLOUR = `
precision highp float;
uniform vec3 eye, sun;
uniform vec4 colour;
uniform float kind;
varying vec3 facing, place;
void main() {
  if (kind > 1.5) { gl_FragColor = colour; return; }
  vec3 n = normalize(facing), v = normalize(eye - place);
  if (kind > 0.5) {
    float rim = pow(1.0 - abs(dot(n, v)), 2.0);
    gl_FragColor = vec4(colour.rgb, colour.a * (0.35 + 1.3 * rim));
    return;
  }
  float light = 0.42 + 0.2 * (0.5 + 0.5 * n.z) + 0.46 * max(dot(n, sun), 0.0);
  float shine = 0.2 * pow(max(dot(reflect(-sun, n), v), 0.0), 30.0);
  gl_FragColor = vec4(colour.rgb * light + shine, colour.a);
}`;
const LINE = `
attribute vec3 from, to;
attribute vec3 at;
uniform mat4 view;
uniform vec2 pixels;
uniform float width;
varying float along;
void main() {
  vec4 a = view * vec4(from, 1.0), b = view * vec4(to, 1.0);
  vec2 way = (b.xy / b.w - a.xy / a.w) * pixels;
  way = length(way) > 1e-4 ? normalize(way) : vec2(1.0, 0.0);
  vec4 p = at.x > 0.5 ? b : a;
  vec2 off = vec2(-way.y, way.x) * at.y + way * (at.x - 0.5) * 0.8;
  p.xy += off * width / pixels * p.w;
  along = at.z;
  gl_Position = p;
}`;
const LINE_COLOUR = `
precision highp float;
uniform vec4 colour;
uniform float dash;
varying float along;
void main() {
  if (dash > 0.0 && fract(along / dash) > 0.55) discard;
  gl_FragColor = colour;
}`;

const SUN = unit([0.25, 0.35, 0.9]);
const LIT = 0, BUBBLE = 1, FLAT = 2, SHADOW = 3;
const QUARTER = 14;  // steps of a quarter circle

// The octants of a sphere, separate, so that moving them apart by `corner` makes a rounded box.
function rounded_box() {
  const vertices = [], indices = [], rows = [], columns = [];
  for (const s of [-1, 1]) for (let i = 0; i <= QUARTER; i++) {
    rows.push([(i / QUARTER - (s < 0 ? 1 : 0)) * Math.PI / 2, s]);
  }
  for (let q = 0; q < 5; q++) for (let i = 0; i <= (q < 4 ? QUARTER : 0); i++) {
    columns.push([(q + i / QUARTER) * Math.PI / 2, q % 4 < 1 || q % 4 > 2 ? 1 : -1,
                  q % 4 < 2 ? 1 : -1]);
  }
  for (const [b, sz] of rows) for (const [a, sx, sy] of columns) {
    vertices.push(Math.cos(b) * Math.cos(a), Math.cos(b) * Math.sin(a), Math.sin(b), sx, sy, sz);
  }
  const across = columns.length;
  for (let r = 0; r + 1 < rows.length; r++) for (let c = 0; c + 1 < across; c++) {
    const k = r * across + c;
    indices.push(k, k + 1, k + across, k + 1, k + across + 1, k + across);
  }
  for (const [s, ring] of [[-1, 0], [1, (rows.length - 1) * across]]) {
    const middle = vertices.length / 6;
    vertices.push(0, 0, s, 0, 0, s);
    for (let c = 0; c + 1 < across; c++) {
      indices.push(middle, ring + c + (s < 0 ? 1 : 0), ring + c + (s < 0 ? 0 : 1));
    }
  }
  return {vertices, indices};
}

// The surface of a cone about z, of length 1 along its side.
function cone(half_angle) {
  const vertices = [0, 0, 0, 0, 0, 0], indices = [], n = 48;
  for (let i = 0; i <= n; i++) {
    const a = 2 * Math.PI * i / n, s = Math.sin(half_angle);
    vertices.push(s * Math.cos(a), s * Math.sin(a), Math.cos(half_angle), 0, 0, 0);
    if (i) indices.push(0, i, i + 1);
  }
  return {vertices, indices};
}

class Painter {
  constructor(canvas) {
    const gl = this.gl = canvas.getContext("webgl");  // with the attributes that the stage requested
    this.canvas = canvas;
    this.solids = this.program(SOLID, SOLID_COLOUR, ["normal", "corner"]);
    this.lines = this.program(LINE, LINE_COLOUR, ["from", "to", "at"]);
    this.box = this.mesh(rounded_box());
    this.passing = gl.createBuffer();
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  program(vertex, fragment, attributes) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    attributes.forEach((name, i) => gl.bindAttribLocation(program, i, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`shader: ${gl.getProgramInfoLog(program)}`);
    }
    const uniforms = {};
    for (let i = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; i >= 0; i--) {
      const {name} = gl.getActiveUniform(program, i);
      uniforms[name] = gl.getUniformLocation(program, name);
    }
    return {program, uniforms};
  }

  mesh({vertices, indices}) {
    const gl = this.gl, mesh = {vertices: gl.createBuffer(), indices: gl.createBuffer(),
                                count: indices.length};
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(vertices), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(indices), gl.STATIC_DRAW);
    return mesh;
  }

  clear(colour) {
    const gl = this.gl;
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(...colour, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
  }

  // Draw the camera's view into x, y, width, height [px], y counted from below.
  look([x, y, width, height], camera, ground) {
    const gl = this.gl, aspect = width / height, view = camera.matrix(aspect);
    gl.viewport(x, y, width, height);
    gl.scissor(x, y, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.useProgram(this.lines.program);
    gl.uniformMatrix4fv(this.lines.uniforms.view, false, view);
    gl.uniform2f(this.lines.uniforms.pixels, width, height);
    gl.useProgram(this.solids.program);
    gl.uniformMatrix4fv(this.solids.uniforms.view, false, view);
    gl.uniform3fv(this.solids.uniforms.eye, camera.eye(aspect));
    gl.uniform3fv(this.solids.uniforms.sun, SUN);
    gl.uniform1f(this.solids.uniforms.ground, ground + 0.001);
  }

  // Draw solids {mesh, centre, axes, size, radius, colour} in turn; of coincident surfaces the one
  // with the smallest `behind` is visible.
  draw(solids, kind, {depth = true, write = kind === LIT, behind = 0} = {}) {
    const gl = this.gl, {program, uniforms} = this.solids;
    gl.useProgram(program);
    this.state(depth, write, kind !== FLAT && kind !== SHADOW);
    if (kind === SHADOW) {  // each pixel once, however many shadows cover it
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    }
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(2 * behind, 8 * behind);
    gl.uniform1f(uniforms.kind, kind);
    for (const solid of solids) {
      this.bind(solid.mesh || this.box, [[0, 3, 0], [1, 3, 12]], 24);
      gl.uniformMatrix3fv(uniforms.axes, false, solid.axes);
      gl.uniform3fv(uniforms.centre, solid.centre);
      gl.uniform3fv(uniforms.size, solid.size);
      gl.uniform1f(uniforms.radius, solid.radius);
      gl.uniform4fv(uniforms.colour, kind === SHADOW ? [0, 0, 0, 0.13] : solid.colour);
      gl.drawElements(gl.TRIANGLES, (solid.mesh || this.box).count, gl.UNSIGNED_SHORT, 0);
    }
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.disable(gl.STENCIL_TEST);
  }

  finish() {}

  // Give the memory of meshes and segments back.
  release(...shapes) {
    for (const {vertices, indices} of shapes) {
      this.gl.deleteBuffer(vertices);
      if (indices) this.gl.deleteBuffer(indices);
    }
  }

  bind(mesh, attributes, stride) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
    if (mesh.indices) gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
    for (let i = 0; i < 3; i++) gl.disableVertexAttribArray(i);
    for (const [i, n, offset] of attributes) {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, n, gl.FLOAT, false, stride, offset);
    }
  }

  state(depth, write, cull) {
    const gl = this.gl;
    (depth ? gl.enable : gl.disable).call(gl, gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.depthMask(write);
    (cull ? gl.enable : gl.disable).call(gl, gl.CULL_FACE);
  }

  // Pairs of points [[a, b], ...] in the form that `line` draws.
  segments(pairs, keep = true) {
    const gl = this.gl, numbers = [];
    let along = 0;
    for (const [a, b] of pairs) {
      const next = along + Math.hypot(...subtract(b, a));
      for (const [end, side] of [[0, -1], [1, -1], [0, 1], [0, 1], [1, -1], [1, 1]]) {
        numbers.push(...a, ...b, end, side, end ? next : along);
      }
      along = next;
    }
    const vertices = keep ? gl.createBuffer() : this.passing;
    gl.bindBuffer(gl.ARRAY_BUFFER, vertices);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers),
                  keep ? gl.STATIC_DRAW : gl.DYNAMIC_DRAW);
    return {vertices, count: 6 * pairs.length};
  }

  line(segments, colour, width, {dash = 0, depth = true, first = 0, last = Infinity} = {}) {
    const gl = this.gl, {program, uniforms} = this.lines;
    const count = Math.min(segments.count, 6 * last) - 6 * first;
    if (count <= 0) return;
    gl.useProgram(program);
    this.state(depth, false, false);
    this.bind(segments, [[0, 3, 0], [1, 3, 12], [2, 3, 24]], 36);
    gl.uniform4fv(uniforms.colour, colour);
    gl.uniform1f(uniforms.width, width);
    gl.uniform1f(uniforms.dash, dash);
    gl.drawArrays(gl.TRIANGLES, 6 * first, count);
  }
}
