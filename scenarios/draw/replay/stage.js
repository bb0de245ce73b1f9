// Draws the runs at one time: arms, obstacles, areas, paths, cone, link, floor.

const UPRIGHT = [1, 0, 0, 0, 1, 0, 0, 0, 1];
const DOT = 0.011, CONE_LENGTH = 0.3, AXIS_LENGTH = 0.34, CELL = 0.25;  // m

const ball = (centre, radius, colour) => ({centre, axes: UPRIGHT, size: [0, 0, 0], radius, colour});

function capsule(a, b, radius, colour) {
  const way = subtract(b, a), length = Math.hypot(...way);
  return {centre: scale(add(a, b), 0.5), axes: length > 1e-9 ? axes_along(way) : UPRIGHT,
          size: [0, 0, length / 2], radius, colour};
}

// The base of an arm.
const plate = ([x, y, top], radius, floor, colour) => ({
  centre: [x, y, (floor + top) / 2], axes: UPRIGHT, colour, radius: 0.3 * radius,
  size: [0.95 * radius, 0.95 * radius, Math.max((top - floor) / 2 - 0.3 * radius, 0)]});

// An obstacle grown by `more`; its rotation is given row by row.
function thing({shape, size, rotation: r}, centre, more, colour) {
  const axes = [r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]];
  if (shape === "capsule") {
    return {centre, axes, size: [0, 0, size[1]], radius: size[0] + more, colour};
  }
  if (shape === "box") {
    const edge = more || 0.06 * Math.min(...size);  // drawn with edges that catch the light
    return {centre, axes, size: more ? size : size.map(s => s - edge), radius: edge, colour};
  }
  return {centre, axes, size: [0, 0, 0], radius: (shape === "sphere" ? size[0] : more ? 0 : 0.014)
          + more, colour};
}

const rgb = text => [1, 3, 5].map(i => parseInt(text.slice(i, i + 2), 16) / 255);
const mixed = (a, b, share) => a.map((value, i) => value + share * (b[i] - value));

function palette() {
  const style = getComputedStyle(document.documentElement);
  const named = name => rgb(style.getPropertyValue(`--${name}`).trim());
  const dark = named("ground")[0] < 0.5;
  return {sky: named("sky"), ink: named("ink"), alert: named("alert"), quiet: named("quiet"),
          accent: named("accent"), met: named("met"), missed: named("missed"),
          link: dark ? [0.72, 0.75, 0.79] : [0.86, 0.88, 0.9],
          joint: dark ? [0.36, 0.4, 0.46] : [0.4, 0.44, 0.5], dark};
}

class Stage {
  constructor(canvas, runs) {
    this.canvas = canvas;
    this.runs = runs;
    this.camera = new Camera(...bounds(runs), runs[0].azimuth);
    this.floor = Math.min(...runs.map(run => run.floor));
    this.prepare();
  }

  prepare() {
    const webgl = {antialias: true, stencil: true, alpha: false};
    this.flat = !this.canvas.getContext("webgl", webgl);
    this.painter = this.flat ? new Sketch(this.canvas) : new Painter(this.canvas);
    this.paths = new Map(this.runs.map(run => [run, this.shapes(run)]));
    this.grid = this.painter.segments(grid(this.camera, this.floor));
  }

  shapes(run) {
    const wanted = run.ahead || [run.desired, ...run.paths.map(path => path.wanted)];
    return {
      traced: [[run.points, run.points.width - 3], ...run.paths.map(path => [path.actual, 0])]
        .map(([points, first]) => this.painter.segments(joined(points, first))),
      desired: wanted.filter(points => points)
        .map(points => this.painter.segments(joined(points, 0))),
      cone: run.wanted && this.painter.mesh(cone(run.halfAngle))};
  }

  forget(run) {
    const {traced = [], desired = [], cone: own} = this.paths.get(run) || {};
    this.painter.release(...traced, ...desired, ...(own ? [own] : []));
    this.paths.delete(run);
  }

  // Draw the visible runs side by side or overlaid; return the area of each.
  draw(t, beside) {
    const shown = this.runs.filter(run => run.visible), colours = palette();
    const areas = beside ? split(shown.length, this.canvas) :
      [[0, 0, this.canvas.width, this.canvas.height]];
    this.painter.clear(colours.sky);
    areas.forEach((area, i) => this.picture(area, beside ? [shown[i]] : shown, t, colours));
    return beside ? areas.map((area, i) => ({run: shown[i], area})) : [];
  }

  picture(area, runs, t, colours) {
    const painter = this.painter;
    const moments = runs.map((run, i) => this.moment(run, t, colours,
      runs.slice(0, i).every(other => other.surroundings !== run.surroundings)));
    const all = name => moments.flatMap(moment => moment[name]);
    const ratio = this.canvas.width / (this.canvas.clientWidth || 1);
    painter.look(area, this.camera, this.floor);
    painter.line(this.grid, [...colours.quiet, colours.dark ? 0.3 : 0.22], ratio, {under: true});
    painter.draw([...all("arm"), ...all("obstacles")], SHADOW);
    moments.forEach((moment, i) => painter.draw(moment.arm, LIT, {behind: i}));
    painter.draw(all("obstacles"), LIT);
    moments.forEach(moment => this.lines(moment, colours, ratio));
    painter.draw(all("cones"), FLAT);
    painter.draw(all("areas"), BUBBLE);
    painter.draw(all("dots"), LIT, {depth: false, write: false});
    painter.finish();
  }

  moment(run, t, colours, surrounded) {
    const at = run.at(t), several = this.runs.filter(one => one.visible).length > 1;
    const links = run.between("links", at), points = run.between("points", at);
    const tint = several ? mixed(rgb(run.colour), [1, 1, 1], 0.1 + run.paler) : colours.link;
    const joint = several ? mixed(rgb(run.colour), [0, 0, 0], 0.35) : colours.joint;
    const last = run.points.width / 3 - 1, tip = triple(points, last);
    const moment = {run, at, tip, points, arm: [], obstacles: [], areas: [], cones: [], dots: [],
                    axis: run.between("axis", at)};
    run.radii.forEach((radius, c) => {
      const a = triple(links, 2 * c), b = triple(links, 2 * c + 1);
      const stands = Math.abs(a[2] - run.floor) < 1e-6 && b[2] > a[2] + radius;
      if (stands) a[2] += radius;
      moment.arm.push(capsule(a, b, radius, [...tint, 1]), stands ?
        plate(a, radius, run.floor, [...joint, 1]) : ball(a, 1.085 * radius, [...joint, 1]));
    });
    if (surrounded) this.obstacles(moment, colours);
    const active = run.active.values[at.frame];
    for (let k = run.obstacles.length ? 0 : last; k <= last; k++) {
      const colour = k === active ? colours.alert : k === last ? rgb(run.colour) : colours.ink;
      moment.dots.push(ball(triple(points, k), k === active ? 1.6 * DOT : DOT, [...colour, 1]));
    }
    for (const place of run.handles || []) moment.dots.push(ball(place, 1.4 * DOT, [...colours.accent, 1]));
    if (run.wanted) {
      const inside = dot(unit(run.wanted), moment.axis) >= Math.cos(run.halfAngle);
      const state = several ? rgb(run.colour) : inside ? colours.met : colours.missed;
      moment.cones.push({mesh: this.paths.get(run).cone, centre: tip, size: [0, 0, 0],
                         axes: axes_along(run.wanted), radius: CONE_LENGTH, colour: [...state, 0.3]});
    }
    return moment;
  }

  obstacles({run, at, obstacles, areas}, colours) {
    const centres = run.between("centres", at);
    run.obstacles.forEach((obstacle, h) => {
      const centre = triple(centres, h);
      obstacles.push(thing(obstacle, centre, 0, [...colours.alert, 1]));
      for (const [, radius] of run.areas) {
        areas.push(thing(obstacle, centre, radius, [...colours.alert, 0.16]));
      }
    });
  }

  lines({run, at, tip, points, axis}, colours, ratio) {
    const painter = this.painter, {traced, desired} = this.paths.get(run), own = rgb(run.colour);
    for (const path of traced) painter.line(path, [...own, 0.22], 2 * ratio);
    for (const path of desired) {
      painter.line(path, [...colours.ink, 0.75], 1.2 * ratio, {dash: 0.02});
    }
    for (const path of traced) for (const {first, last, colour} of run.stretches) {
      painter.line(path, [...rgb(colour), 1], 2.6 * ratio, {first, last: Math.min(last, at.frame)});
    }
    const passing = (pairs, colour, width, options) =>
      painter.line(painter.segments(pairs, false), colour, width * ratio, options);
    if (run.wanted) {
      passing([[tip, add(tip, scale(axis, AXIS_LENGTH))]], [...own, 1], 2.4);
      passing([[tip, add(tip, scale(run.wanted, AXIS_LENGTH))]], [...colours.ink, 0.6], 1.2,
              {dash: 0.02});
    }
    const pushes = [["table", [...colours.ink, 0.35], 1], ["support", [...own, 1], 2], ["cone", [...colours.ink, 0.35], 0.8],
                    ["centre", [...colours.ink, 1], 2], ["force", [...colours.alert, 1], 3],
                    ["push", [...colours.accent, 1], 4]];
    for (const [name, colour, width] of pushes) {
      if (run[name]) passing(existing(run.row(name, at.frame)), colour, width, {depth: false});
    }
    const linked = run.linked.values[at.frame];
    const from = triple(points, linked), to = run.between("nearest", at);
    if (Number.isFinite(to[0])) {
      const held = run.active.values[at.frame] === linked;
      passing([[from, to]], held ? [...colours.alert, 1] : [...colours.ink, 0.45],
              held ? 2.4 : 1.2, {depth: false});
    }
  }
}

// Pairs of points out of six numbers each, without those that are not finite.
function existing(values) {
  const pairs = Array.from({length: values.length / 6}, (_, k) =>
    [triple(values, 2 * k), triple(values, 2 * k + 1)]);
  return pairs.filter(pair => pair.flat().every(Number.isFinite));
}

// The bounding box of everything drawn.
function bounds(runs) {
  const low = [Infinity, Infinity, Infinity], high = low.map(value => -value);
  const take = (values, k, more) => triple(values, k).forEach((value, i) => {
    if (!Number.isFinite(value)) return;
    low[i] = Math.min(low[i], value - more);
    high[i] = Math.max(high[i], value + more);
  });
  for (const run of runs) {
    const radius = Math.max(...run.radii, 0), wanted = run.paths.map(path => path.wanted);
    for (const all of [run.links, run.points, run.desired, run.centres, ...wanted,
                       ...run.ahead || []]) {
      for (let k = 0; all && k < all.values.length / 3; k++) take(all.values, k, radius);
    }
  }
  return [low, high];
}

function joined({values, width, rows}, first) {
  const at = row => [0, 1, 2].map(i => values[row * width + first + i]);
  return Array.from({length: Math.max(rows - 1, 0)}, (_, row) => [at(row), at(row + 1)]);
}

function grid(camera, floor) {
  const cells = Math.ceil(1.25 * camera.reach / CELL), far = cells * CELL, pairs = [];
  const [x, y] = camera.centre.map(value => Math.round(value / CELL) * CELL);
  for (let i = -cells; i <= cells; i++) {
    pairs.push([[x + i * CELL, y - far, floor], [x + i * CELL, y + far, floor]],
               [[x - far, y + i * CELL, floor], [x + far, y + i * CELL, floor]]);
  }
  return pairs;
}

// Areas [px, from below] of `count` pictures, as square as possible.
function split(count, {width, height}) {
  let columns = 1;
  while (columns < count && width / columns > 1.3 * height / Math.ceil(count / columns)) columns++;
  const rows = Math.ceil(count / columns), w = Math.floor(width / columns);
  const h = Math.floor(height / rows);
  return Array.from({length: count}, (_, i) =>
    [(i % columns) * w, (rows - 1 - Math.floor(i / columns)) * h, w, h]);
}
