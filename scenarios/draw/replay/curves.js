// Curves over time and the fate of each task, under one movable cursor.

const RIGHT = 8, TOP = 5, BELOW = 16, HEIGHT = 106, LANE = 15;
const DAMPED = 4;  // a range this many times the usual one is cut, as it would flatten the others

function element(name, attributes = {}, ...children) {
  const made = name === "svg" || element.svg.has(name) ?
    document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}
element.svg = new Set(["path", "line", "text", "rect", "g", "title"]);

const dashed = run => run.dash.length ? {"stroke-dasharray": run.dash.map(d => 1.3 * d).join()} : {};

// A run's line, for legends.
function sample(run) {
  return element("svg", {class: "sample", viewBox: "0 0 22 8", "aria-hidden": "true"},
    element("line", {x1: 0, x2: 22, y1: 4, y2: 4, stroke: run.colour, "stroke-width": 3.5,
                     ...dashed(run)}));
}

const KEY = [["met", "met-soft"], ["free", "free"], ["missed", "missed-soft"],
  ["unknown", "unknown"]];

// The legend of the lanes' colours.
function key(present, phrases) {
  return element("span", {class: "key"}, ...KEY.filter(([fate]) => present.has(fate))
    .map(([fate, colour]) => element("span", {},
      element("i", {style: `background: var(--${colour})`}), phrases[fate])));
}

class Curves {
  constructor(place, runs, data, seek) {
    Object.assign(this, {place, runs, seek, joints: data.joints, fates: data.fates,
                         phrases: data.phrases});
    [this.begin, this.end] = [0, Math.max(...runs.map(run => run.end)) || 1];
    new ResizeObserver(() => { if (place.clientWidth !== this.width) this.lay_out(); })
      .observe(place);
    this.lay_out();
  }

  x(t) {
    return this.left + (this.width - this.left - RIGHT) * (t - this.begin) / (this.end - this.begin);
  }

  lay_out() {
    this.width = this.place.clientWidth;
    this.cursors = [];
    this.outputs = [];
    const shown = this.runs.filter(run => run.visible && run.frames > 1);
    const names = [...new Set(shown.flatMap(run => run.series.map(one => one.name)))];
    this.left = Math.max(44, ...shown.flatMap(run => run.tasks).map(task => 6.2 * task.length + 10));
    this.left = Math.min(this.left, this.width / 3);
    this.place.replaceChildren(...(this.width > 100 ?
      [...shown.map((run, i) => this.lanes(run, shown.length > 1, i === 0)),
       ...names.map(name => this.plot(name, shown))] : []));
    if (this.now) this.follow(...this.now);
  }

  figure(heading, height, children) {
    const cursor = element("line", {class: "cursor", y1: 0, y2: height - BELOW + 2});
    const svg = element("svg", {height, viewBox: `0 0 ${this.width} ${height}`, role: "img"},
                        ...this.times(height), ...children, cursor);
    this.cursors.push(cursor);
    const put = event => {
      const box = svg.getBoundingClientRect();
      const share = (event.clientX - box.left - this.left) / (box.width - this.left - RIGHT);
      this.seek(this.begin + (this.end - this.begin) * Math.min(Math.max(share, 0), 1));
    };
    svg.addEventListener("pointerdown", event => {
      svg.setPointerCapture(event.pointerId);
      put(event);
    });
    svg.addEventListener("pointermove", event => { if (event.buttons) put(event); });
    return element("figure", {class: "curve"}, heading, svg);
  }

  times(height) {
    return ticks(this.begin, this.end, Math.max(3, Math.round(this.width / 90))).flatMap(t => [
      element("line", {class: "grid", x1: this.x(t), x2: this.x(t), y1: TOP, y2: height - BELOW}),
      element("text", {x: this.x(t), y: height - 3, "text-anchor": "middle"}, `${t} s`)]);
  }

  // The fate of each task of a run: one lane per task, with its place in the order.
  lanes(run, several, first) {
    const children = [], title = element("figcaption", {},
      element("b", {}, several ? `The stack: ${run.label}` : "The stack"), ...(first ? [key(this.present(), this.phrases)] : []));
    run.tasks.forEach((task, n) => {
      const y = TOP + n * LANE;
      children.push(element("text", {x: this.left - 5, y: y + 10, "text-anchor": "end"}, task));
      for (const {from, to, fate, rank} of this.spans(run, n)) {
        const x = this.x(from), wide = Math.max(this.x(to) - x, 0.6);
        children.push(element("rect", {class: fate, x, y: y + 1, width: wide, height: LANE - 3}));
        if (wide > 11) {
          children.push(element("text", {x: x + wide / 2, y: y + 10, "text-anchor": "middle"},
                                `${rank}`));
        }
      }
    });
    return this.figure(title, TOP + run.tasks.length * LANE + BELOW, children);
  }

  // The fates that occur in the visible runs.
  present() {
    const values = new Set(this.runs.filter(run => run.visible)
      .flatMap(run => [...new Set(run.fate.values)]));
    return new Set(Object.keys(this.fates).filter(name => values.has(this.fates[name])));
  }

  spans(run, task) {
    const spans = [], times = run.t.values, named = Object.entries(this.fates);
    for (let f = 0; f < run.frames; f++) {
      const value = run.fate.values[f * run.tasks.length + task];
      const rank = run.order_at(f).indexOf(run.tasks[task]) + 1;
      const fate = named.find(([, other]) => other === value)[0];
      const open = spans[spans.length - 1], to = times[Math.min(f + 1, run.frames - 1)];
      if (open && open.fate === fate && open.rank === rank) open.to = to;
      else spans.push({from: times[f], to, fate, rank});
    }
    return spans.filter(span => span.fate !== "absent");
  }

  plot(name, shown) {
    const drawn = shown.map(run => ({run, one: run.series.find(one => one.name === name)}))
      .filter(({one}) => one).flatMap(({run, one}) => this.channels(run, one, shown.length > 1));
    const marks = new Map(drawn.flatMap(({one}) => one.marks).map(mark => [mark.join(), mark]));
    const one = {...drawn[0].one, marks: [...marks.values()]}, scale = new Scale(drawn, one), children = [];
    for (const value of scale.ticks()) {
      const y = scale.y(value);
      children.push(element("line", {class: "grid", x1: this.left, x2: this.width - RIGHT, y1: y, y2: y}),
                    element("text", {x: this.left - 5, y: y + 3, "text-anchor": "end"}, short(value)));
    }
    for (const [symbol, value] of one.marks) {
      const y = scale.y(value);
      if (y < TOP || y > HEIGHT - BELOW) continue;
      children.push(element("line", {class: "mark", x1: this.left, x2: this.width - RIGHT, y1: y, y2: y}),
                    element("text", {x: this.width - RIGHT, y: y - 2, "text-anchor": "end"}, symbol));
    }
    for (const channel of [...drawn].reverse()) {
      children.push(element("path", {class: "line", stroke: channel.colour,
                                     ...(shown.length > 1 ? dashed(channel.run) : {}), d: this.path(channel, scale)}));
    }
    const output = element("output"), largest = drawn.some(channel => channel.largest);
    this.outputs.push({output, drawn});
    const heading = element("figcaption", {}, element("b", {}, largest ? `${name}, largest` : name),
                            element("small", {}, `[${one.unit}]`), output);
    return this.figure(heading, HEIGHT, children);
  }

  // One curve per column; when runs are compared, the largest of all columns.
  channels(run, one, several) {
    const {values, width, rows} = one.value, low = one.low.values, high = one.high.values;
    if (width === 1) return [{run, one, colour: run.colour, value: values, low, high}];
    if (several) {
      const largest = (...of) => Float32Array.from({length: rows}, (_, f) => {
        let most = 0;
        for (const side of of) for (let c = 0; c < width; c++) {
          most = Math.max(most, Math.abs(side[f * width + c]));
        }
        return most;
      });
      const most = largest(values);
      return [{run, one, colour: run.colour, value: most, low: most, high: largest(low, high),
               largest: true}];
    }
    const column = (all, c) => Float32Array.from({length: rows}, (_, f) => all[f * width + c]);
    return Array.from({length: width}, (_, c) => ({
      run, one, colour: this.joints[c % this.joints.length], label: one.labels[c],
      value: column(values, c), low: column(low, c), high: column(high, c)}));
  }

  path({run, value, low, high}, scale) {
    const times = run.t.values, parts = [];
    let pen = "M", before = 0;
    for (let f = 0; f < value.length; f++) {
      if (!Number.isFinite(value[f])) { pen = "M"; continue; }
      const x = this.x(times[f]).toFixed(1), top = scale.y(high[f]), bottom = scale.y(low[f]);
      const y = scale.y(value[f]), ys = [];
      if (pen === "M") before = y;
      if (top < Math.min(before, y) - 1.5) ys.push(top);  // a peak between two frames
      if (bottom > Math.max(before, y) + 1.5) ys.push(bottom);
      for (const at of [...ys, y]) { parts.push(`${pen}${x} ${at.toFixed(1)}`); pen = "L"; }
      before = y;
    }
    return parts.join("");
  }

  follow(t, moved) {
    this.now = [t, moved];
    for (const cursor of this.cursors) {
      cursor.setAttribute("x1", this.x(t));
      cursor.setAttribute("x2", this.x(t));
    }
    if (!moved) return;
    for (const {output, drawn} of this.outputs) {
      const now = ({run, value}) => value[run.at(t).frame];
      const most = drawn.reduce((a, b) => Math.abs(now(b)) > Math.abs(now(a)) ? b : a);
      output.replaceChildren(...(most.label ? [most] : drawn).map(channel => element("span",
        {style: drawn.length > 1 ? `color: ${channel.colour}` : ""},
        `${channel.label ? `${channel.label}: ` : ""}${short(now(channel))}`)));
    }
  }
}

class Scale {
  constructor(drawn, one) {
    const finite = values => Array.from(values).filter(Number.isFinite);
    this.logarithmic = one.logarithmic;
    const ranges = drawn.map(({low, high}) => [finite(low), finite(high)])
      .filter(([low]) => low.length).map(([low, high]) => [
        low.reduce((a, b) => Math.min(a, b)), high.reduce((a, b) => Math.max(a, b))]);
    if (drawn[0].label) {  // of a single run: nothing is cut
      ranges.splice(0, ranges.length, [Math.min(...ranges.map(range => range[0])),
                                       Math.max(...ranges.map(range => range[1]))]);
    }
    const widths = ranges.map(([low, high]) => high - low).sort((a, b) => a - b);
    const usual = DAMPED * (widths[Math.floor((widths.length - 1) / 2)] || Infinity);
    const kept = ranges.filter(([low, high]) => this.logarithmic || high - low <= usual);
    this.low = Math.min(...kept.map(range => range[0]), ...one.marks.map(mark => mark[1]));
    this.high = Math.max(...kept.map(range => range[1]), ...one.marks.map(mark => mark[1]));
    if (!Number.isFinite(this.high - this.low)) [this.low, this.high] = [0, 1];
    if (this.logarithmic) {
      this.low = Math.max(this.low, this.high * 1e-7, 1e-9);
      [this.low, this.high] = [Math.log10(this.low), Math.log10(Math.max(this.high, 1e-9))];
    } else if (this.low > 0 && this.low < 0.6 * this.high) this.low = 0;
    const margin = 0.05 * (this.high - this.low) || 0.5;
    this.high += margin;
    if (this.low !== 0) this.low -= margin;
  }

  y(value) {
    const at = this.logarithmic ? Math.log10(Math.max(value, 1e-9)) : value;
    const y = TOP + (HEIGHT - TOP - BELOW) * (this.high - at) / (this.high - this.low);
    return Math.min(Math.max(y, -HEIGHT), 2 * HEIGHT);
  }

  ticks() {
    if (!this.logarithmic) return ticks(this.low, this.high, 3);
    const first = Math.ceil(this.low), last = Math.floor(this.high);
    const step = Math.max(1, Math.ceil((last - first) / 3)), found = [];
    for (let power = first; power <= last; power += step) found.push(10 ** power);
    return found;
  }
}

function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(factor => factor * power >= 0.8 * rough), found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(+(k * step).toPrecision(6));
  return found;
}

function short(value) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size < 1e-9) return "0";
  if (size < 1e-3 || size >= 1e5) return (+value.toPrecision(2)).toExponential();
  return `${+value.toPrecision(3)}`;
}
