// The painter for a canvas without WebGL: whole solids, the farthest first.

class Sketch {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    if (!this.pen) throw new Error("the browser gives no canvas");
  }

  mesh(shape) { return shape; }

  segments(pairs) { return {pairs}; }

  release() {}

  clear(colour) {
    this.pen.fillStyle = css(colour);
    this.pen.fillRect(0, 0, this.canvas.width, this.canvas.height);
  }

  look([x, y, width, height], camera) {
    const aspect = width / height;
    Object.assign(this, {x, y, width, height, things: [], view: camera.matrix(aspect),
                         eye: camera.eye(aspect)});
    this.pen.save();
    this.pen.beginPath();
    this.pen.rect(x, this.canvas.height - y - height, width, height);
    this.pen.clip();
    this.pen.lineCap = "round";
  }

  // Paint everything drawn since `look`.
  finish() {
    this.things.sort((a, b) => b.far - a.far).forEach(thing => thing.paint());
    this.pen.restore();
  }

  // Place [px], depth, and pixels per metre there.
  project(p) {
    const v = this.view, row = r => v[r] * p[0] + v[4 + r] * p[1] + v[8 + r] * p[2] + v[12 + r];
    const depth = Math.max(row(3), 1e-3);
    return {x: this.x + (row(0) / depth + 1) / 2 * this.width, depth,
            y: this.canvas.height - this.y - (row(1) / depth + 1) / 2 * this.height,
            metre: this.height / 2 / Math.tan(FIELD / 2) / depth};
  }

  // Objects that nothing can hide are painted last.
  later(depth, far, paint) { this.things.push({far: depth ? far : -far, paint}); }

  draw(solids, kind, {depth = true} = {}) {
    if (kind === SHADOW) return;
    for (const solid of solids) {
      const {depth: far} = this.project(solid.centre);
      this.later(depth, far, () => {
        if (solid.mesh) this.fan(solid);
        else if (solid.size[0] > 0) this.box(solid);
        else this.rod(solid, kind);
      });
    }
  }

  at({centre, axes}, [x, y, z]) {
    return add(centre, [0, 1, 2].map(i => axes[i] * x + axes[3 + i] * y + axes[6 + i] * z));
  }

  rod(solid, kind) {
    const a = this.project(this.at(solid, [0, 0, -solid.size[2]]));
    const b = this.project(this.at(solid, [0, 0, solid.size[2]]));
    const r = solid.radius * (a.metre + b.metre) / 2, [red, green, blue, alpha] = solid.colour;
    if (kind === BUBBLE) return this.stroke(a, b, 2 * r, css([red, green, blue], 0.8 * alpha));
    const own = [red, green, blue];
    this.stroke(a, b, 2 * r, css(mixed(own, [0, 0, 0], 0.35)));
    this.stroke(a, b, 1.75 * r, css(mixed(own, [0, 0, 0], 0.1)), -0.08 * r);
    this.stroke(a, b, 0.8 * r, css(mixed(own, [1, 1, 1], 0.25)), -0.3 * r);
  }

  stroke(a, b, width, style, off = 0) {
    const {pen} = this;
    pen.beginPath();
    pen.moveTo(a.x + off, a.y + off);
    pen.lineTo(b.x + off + 1e-3, b.y + off);
    Object.assign(pen, {lineWidth: Math.max(width, 0.5), strokeStyle: style});
    pen.stroke();
  }

  fill(corners, style) {
    const {pen} = this;
    pen.beginPath();
    corners.forEach((p, i) => i ? pen.lineTo(p.x, p.y) : pen.moveTo(p.x, p.y));
    pen.fillStyle = style;
    pen.fill();
  }

  // The faces of a box that face the camera.
  box(solid) {
    const half = solid.size.map(s => s + solid.radius), [red, green, blue, alpha] = solid.colour;
    for (const i of [0, 1, 2]) for (const side of [-1, 1]) {
      const normal = scale(solid.axes.slice(3 * i, 3 * i + 3), side);
      const [j, k] = [(i + 1) % 3, (i + 2) % 3];
      const corner = (u, v) => {
        const p = [0, 0, 0];
        [p[i], p[j], p[k]] = [side * half[i], u * half[j], v * half[k]];
        return this.at(solid, p);
      };
      if (dot(normal, subtract(this.eye, corner(0, 0))) <= 0) continue;
      const dark = 0.45 - 0.4 * Math.max(dot(normal, SUN), 0);
      const corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
      this.fill(corners.map(p => this.project(p)),
                css(mixed([red, green, blue], [0, 0, 0], dark), alpha));
    }
  }

  // The triangles of a cone.
  fan(solid) {
    const {vertices, indices} = solid.mesh, [red, green, blue, alpha] = solid.colour;
    const at = n => this.project(this.at(solid, scale(triple(vertices, 2 * n), solid.radius)));
    for (let k = 0; k < indices.length; k += 3) {
      this.fill(indices.slice(k, k + 3).map(at), css([red, green, blue], 0.6 * alpha));
    }
  }

  line({pairs}, [red, green, blue, alpha], width,
       {dash = 0, depth = true, first = 0, last = Infinity, under = false} = {}) {
    const style = css([red, green, blue], alpha);
    let along = 0;
    for (const [a, b] of pairs.slice(first, Math.min(last, pairs.length))) {
      const shown = !dash || along / dash % 1 < 0.55;
      along += Math.hypot(...subtract(b, a));
      if (!shown) continue;
      const from = this.project(a), to = this.project(b);
      const paint = () => this.stroke(from, to, width, style);
      if (under) paint();
      else this.later(depth, (from.depth + to.depth) / 2, paint);
    }
  }
}

const css = (colour, alpha = 1) =>
  `rgba(${colour.slice(0, 3).map(c => Math.round(255 * c))},${alpha})`;
