// Vectors, matrices (column by column) and the camera.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                         a[0] * b[1] - a[1] * b[0]];
const unit = a => scale(a, 1 / (Math.hypot(...a) || 1));
const triple = (values, k) => [values[3 * k], values[3 * k + 1], values[3 * k + 2]];

function multiply(A, B) {
  const C = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) {
    for (let k = 0; k < 4; k++) C[4 * c + r] += A[4 * k + r] * B[4 * c + k];
  }
  return C;
}

// Axes with z along the given direction.
function axes_along(direction) {
  const z = unit(direction);
  const x = unit(cross(Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], z));
  return [...x, ...cross(z, x), ...z];
}

const FIELD = 0.6;  // rad, vertical field of view

class Camera {
  constructor(low, high, azimuth) {
    this.from = azimuth;
    this.centre = scale(add(low, high), 0.5);
    this.reach = Math.hypot(...subtract(high, low)) / 2 || 1;
    this.reset();
  }

  reset() {
    [this.azimuth, this.elevation, this.zoom] = [this.from, 0.4, 1];
    this.target = this.centre.slice();
  }

  get direction() {
    const c = Math.cos(this.elevation);
    return [Math.cos(this.azimuth) * c, Math.sin(this.azimuth) * c, Math.sin(this.elevation)];
  }

  distance(aspect) {
    const half = Math.tan(FIELD / 2) * Math.min(1, aspect);
    return (aspect < 0.8 ? 0.95 : 0.88) * this.reach / Math.sin(Math.atan(half)) / this.zoom;
  }

  eye(aspect) { return add(this.target, scale(this.direction, this.distance(aspect))); }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.min(Math.max(this.elevation + up, -1.5), 1.5);
  }

  move(right, up, aspect) {
    const side = unit(cross([0, 0, 1], this.direction)), above = cross(this.direction, side);
    const step = this.distance(aspect) * 2 * Math.tan(FIELD / 2);
    this.target = subtract(this.target, add(scale(side, right * step), scale(above, up * step)));
  }

  closer(factor) { this.zoom = Math.min(Math.max(this.zoom * factor, 0.3), 12); }

  matrix(aspect) {
    const z = this.direction, x = unit(cross([0, 0, 1], z)), y = cross(z, x);
    const e = this.eye(aspect), far = this.distance(aspect) + 6 * this.reach, near = far / 400;
    const view = [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0,
                  -dot(x, e), -dot(y, e), -dot(z, e), 1];
    const f = 1 / Math.tan(FIELD / 2), d = near - far;
    const projection = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / d, -1,
                        0, 0, 2 * far * near / d, 0];
    return multiply(projection, view);
  }
}
