// A run that goes on: the page asks for its next frame, and for changes.

const KEPT = 600;      // frames
const PERIOD = 33;     // ms between two frames
const ROLLS = 0.25;    // s of the run between two drawings of its curves
const NEAR = 26;       // px within which a handle is grasped

class LiveRun extends Run {
  constructor(data) {
    super(data);
    this.ahead = data.ahead.map(unpack);
    this.visit((name, part, of) => { of[name] = {...part, values: Float32Array.from(part.values)}; });
  }

  // Call with name, array and owner of each array that has a row for each frame.
  visit(call) {
    for (const of of [this, ...this.series, ...this.paths]) {
      for (const [name, part] of Object.entries(of)) {
        if (part && part.rows !== undefined && name !== "switches") call(name, part, of);
      }
    }
  }

  // Take the frame of another run, and forget the first of too many.
  append(next) {
    const over = Math.max(this.frames + 1 - KEPT, 0), added = [];
    next.visit((name, part) => added.push(part));
    const order = next.orders[next.order.values[0]].join();
    let index = this.orders.findIndex(one => one.join() === order);
    if (index < 0) index = this.orders.push(next.orders[next.order.values[0]]) - 1;
    this.visit((name, part, of) => {
      const values = new Float32Array((part.rows + 1 - over) * part.width);
      values.set(part.values.subarray(over * part.width));
      values.set(added.shift().values, (part.rows - over) * part.width);
      of[name] = {values, width: part.width, rows: part.rows + 1 - over};
    });
    this.series.forEach((one, n) => { one.marks = next.series[n].marks; });
    this.frames += 1 - over;
    this.order.values[this.frames - 1] = index;
    this.end = this.t.values[this.frames - 1];
    this.stretch(over, next.colour);
    for (const name of ["label", "colour", "dash", "fault", "goals", "missed", "areas", "halfAngle", "wanted",
                        "ahead", "handles"]) this[name] = next[name];
  }

  // The path has the colour that the resolver of each part has.
  stretch(over, colour) {
    for (const one of this.stretches) [one.first, one.last] = [Math.max(one.first - over, 0), one.last - over];
    this.stretches = this.stretches.filter(one => one.last > 0);
    const now = this.stretches[this.stretches.length - 1];
    if (now.colour === colour) return;
    now.last = this.frames - 1;
    this.stretches.push({first: this.frames - 1, last: Infinity, colour});
  }

  // What of a run must be the same for its frames to go on with those of another.
  get shape() {
    return JSON.stringify([this.tasks, this.series.map(one => one.labels), this.paths.length]);
  }
}

class LivePlayer extends Player {
  run(data) { return new LiveRun(data); }

  make_controls(data) {
    const {play, speed} = this.parts, {fates, phrases, joints} = data;
    Object.assign(this, {asked: {}, begun: data.begun, refused: data.refused[0], held: null,
                         words: {fates, phrases, joints}});
    play.addEventListener("click", () => this.toggle());
    speed.value = `${data.speed}`;
    speed.addEventListener("change", () => this.ask("speed", +speed.value));
    document.addEventListener("keydown", event => this.key(event, speed));
    this.make_panel(data);
    this.show_controls(data);
    this.poll();
  }

  make_panel({resolvers, settings}) {
    const restart = element("button", {type: "button"}, "Restart");
    restart.addEventListener("click", () => this.ask("restart", null));
    this.choice = element("select", {"aria-label": "Resolver"},
                          ...resolvers.map(label => element("option", {}, label)));
    this.choice.addEventListener("change", () => this.ask("resolver", this.choice.value));
    this.grips = element("input", {type: "checkbox", checked: ""});
    this.warning = element("p", {id: "refused", role: "alert"});
    this.sliders = new Map(settings.map(one => [one.key, this.slider(one)]));
    const rows = [...this.sliders.values()].map(({row}) => row);
    document.getElementById("panel").append(
      element("div", {class: "row"}, element("label", {}, "Resolver ", this.choice), restart,
              element("label", {}, this.grips, "Blue dots to drag")), this.warning);
    document.getElementById("settings").append(...rows);
  }

  slider({key, label, high, step, value}) {
    const input = element("input", {type: "range", min: 0, max: Math.max(high, value), step, value});
    const output = element("output", {}, short(value));
    input.addEventListener("input", () => {
      output.textContent = short(+input.value);
      this.ask(key, +input.value);
    });
    return {input, output, row: element("label", {class: "setting", title: key}, label, output, input)};
  }

  ask(what, value) { this.asked[what] = value; }

  toggle() { this.ask("toggle", null); }

  seek() {
    this.end = this.runs[0].end;
    super.seek(this.end);
  }

  step() {}

  async poll() {
    for (;;) {
      const asked = JSON.stringify(this.asked);
      this.asked = {};
      const data = await fetch("now", {method: "POST", body: asked})
        .then(answer => answer.json(), () => null);
      if (!data) break;
      this.take({...this.words, ...data});
      await new Promise(done => setTimeout(done, PERIOD));
    }
    this.parts.time.textContent = "its program has ended";
  }

  // Take a frame and the state of the controls.
  take(data) {
    const [run] = this.runs, next = this.run(data.runs[0]);
    next.handles = this.grips.checked ? Object.values(data.handles) : [];
    const lists = [run.label, run.fault, run.goals].join();
    if (data.begun !== this.begun || next.shape !== run.shape) {
      this.begun = data.begun;
      this.stage?.forget(run);
      this.runs.splice(0, 1, next);
      this.curves.rolls = false;
      this.make_stacks(data);
    } else if (next.end > run.end) run.append(next);
    else for (const name of ["goals", "missed", "fault", "handles"]) run[name] = next[name];
    this.handles = data.handles;
    if (lists !== [run.label, run.fault, run.goals].join() && this.runs[0] === run) this.make_stacks(data);
    this.roll();
    this.renew();
    this.seek();
    this.show_controls(data);
  }

  // The curves of the frames that are kept, drawn now and then.
  roll() {
    const [run] = this.runs, {curves} = this;
    if (run.frames > 2 && (run.end - curves.end > ROLLS || run.end < curves.end || !curves.rolls)) {
      Object.assign(curves, {begin: run.t.values[0], end: run.end, rolls: true});
      curves.lay_out();
    }
  }

  renew() {
    const {stage, runs: [run]} = this;
    if (!stage) return;
    stage.forget(run);
    stage.paths.set(run, stage.shapes(run));
  }

  show_controls(data) {
    const {play, time} = this.parts;
    if (data.playing !== this.playing) this.show_playing(data.playing);
    time.textContent = data.note;
    if (document.activeElement !== this.choice) this.choice.value = data.resolver;
    const [count, why] = data.refused, anew = count !== this.refused;
    this.refused = count;
    if (anew) this.warning.textContent = `Not changed: ${why}`;
    for (const {key, value} of data.settings) {
      const slider = this.sliders.get(key);
      if (!slider || (document.activeElement === slider.input && !anew)) continue;
      slider.input.value = value;
      slider.output.textContent = short(value);
    }
  }

  follow_pointers(space) {
    space.addEventListener("pointerdown", event => {
      const name = this.grasped(event);
      if (!name) return;
      space.setPointerCapture(event.pointerId);
      this.held = {name, at: this.handles[name].slice(), x: event.clientX, y: event.clientY};
      event.stopImmediatePropagation();
    });
    space.addEventListener("pointermove", event => {
      if (this.held) this.drag(event);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      space.addEventListener(name, () => { this.held = null; });
    }
    super.follow_pointers(space);
  }

  // The handle under the pointer, if there is one.
  grasped(event) {
    if (!this.grips.checked) return null;
    const {space} = this.parts, box = space.getBoundingClientRect();
    const matrix = this.stage.camera.matrix(box.width / box.height);
    const far = ([, p]) => {
      const row = r => matrix[r] * p[0] + matrix[4 + r] * p[1] + matrix[8 + r] * p[2] + matrix[12 + r];
      const x = box.left + (row(0) / row(3) + 1) / 2 * box.width;
      const y = box.top + (1 - row(1) / row(3)) / 2 * box.height;
      return Math.hypot(x - event.clientX, y - event.clientY);
    };
    const near = Object.entries(this.handles || {}).map(one => [far(one), one[0]])
      .sort(([a], [b]) => a - b)[0];
    return near && near[0] < NEAR ? near[1] : null;
  }

  // Move what is held in the plane of the picture.
  drag({clientX, clientY}) {
    const {held, stage: {camera}, parts: {space}} = this, z = camera.direction;
    const side = unit(cross([0, 0, 1], z)), above = cross(z, side);
    const depth = dot(subtract(camera.eye(space.clientWidth / space.clientHeight), held.at), z);
    const step = 2 * Math.tan(FIELD / 2) * depth / space.clientHeight;
    held.at = add(held.at, add(scale(side, (clientX - held.x) * step),
                               scale(above, (held.y - clientY) * step)));
    [held.x, held.y] = [clientX, clientY];
    this.ask(held.name, held.at);
  }
}
