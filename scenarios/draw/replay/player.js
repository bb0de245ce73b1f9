// Playback time, and everything that follows it.

class Player {
  constructor(data) {
    this.runs = data.runs.map(one => this.run(one));
    this.runs.forEach((run, i) => {  // of one colour: each paler than the previous one
      run.paler = 0.3 * this.runs.slice(0, i).filter(one => one.colour === run.colour).length;
    });
    this.end = Math.max(...this.runs.map(run => run.end));
    Object.assign(this, {t: 0, playing: false, beside: false, embedded: data.embedded});
    const get = id => document.getElementById(id);
    this.parts = Object.fromEntries(["space", "scrub", "time", "play", "speed", "legend", "modes",
      "names", "notice", "drawn", "stacks", "curves", "marks"].map(id => [id, get(id)]));
    this.make_stacks(data);
    this.curves = new Curves(this.parts.curves, this.runs, data, t => this.seek(t));
    this.make_stage();
    this.make_controls(data);
    this.make_legend();
    this.make_key(data.drawn);
    if (data.beside) this.arrange(true);
    this.seek(+(/^#t=([\d.]+)$/.exec(location.hash) || [0, 0])[1]);
  }

  run(data) { return new Run(data); }

  make_stacks(data) {
    this.stacks = this.runs.map(run => new StackList(run, data, this.runs.length > 1,
      t => this.seek(t)));
    for (const stack of this.stacks) stack.follow(this.t);  // else rows would move to their places
    this.parts.stacks.replaceChildren(...this.stacks.map(stack => stack.card));
  }

  make_stage() {
    const {space, notice} = this.parts;
    try {
      this.stage = new Stage(space, this.runs);
    } catch (error) {
      [notice.hidden, space.hidden] = [false, true];
      notice.textContent = `The arm cannot be drawn here (${error.message}). Stack and curves are ` +
        "those of the run.";
      return;
    }
    if (this.stage.flat) this.parts.space.title = "Drawn without WebGL";
    space.addEventListener("webglcontextlost", event => event.preventDefault());
    space.addEventListener("webglcontextrestored", () => { this.stage.prepare(); this.redraw(); });
    new ResizeObserver(() => this.redraw()).observe(space);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    this.follow_pointers(space);
  }

  make_controls() {
    const {scrub, play, speed, marks} = this.parts;
    scrub.max = this.end;
    scrub.addEventListener("input", () => this.seek(+scrub.value));
    play.addEventListener("click", () => this.toggle());
    document.addEventListener("keydown", event => this.key(event, speed));
    for (const run of this.runs.slice(0, 1)) {
      for (const t of run.switches.values) {
        marks.append(element("i", {style: `left: ${100 * t / (this.end || 1)}%`}));
      }
    }
  }

  make_legend() {
    const {legend, modes} = this.parts;
    if (this.runs.length < 2) return;
    for (const run of this.runs) {
      const button = element("button", {type: "button", "aria-pressed": "true",
        title: "Show or hide this run"},
        sample(run), run.label);
      button.addEventListener("click", () => this.show(run, !run.visible, button));
      legend.append(button);
    }
    ["overlaid", "side by side"].forEach((name, i) => {
      const button = element("button", {type: "button", "aria-pressed": `${i === 0}`}, name);
      button.addEventListener("click", () => this.arrange(i === 1));
      modes.append(button);
    });
  }

  // What the lines at contacts mean.
  make_key(words) {
    this.parts.drawn.append(...Object.entries(words).map(([name, text]) =>
      element("span", {class: `drawn ${name}`}, text)));
    this.parts.drawn.style.setProperty("--own", this.runs[0].colour);
  }

  arrange(beside) {
    this.beside = beside;
    [...this.parts.modes.children].forEach((button, i) =>
      button.setAttribute("aria-pressed", `${(i === 1) === beside}`));
    this.redraw();
  }

  show(run, visible, button) {
    if (!visible && this.runs.filter(one => one.visible).length < 2) return;
    run.visible = visible;
    button.setAttribute("aria-pressed", `${visible}`);
    this.stacks[this.runs.indexOf(run)].card.hidden = !visible;
    this.curves.lay_out();
    this.redraw();
  }

  toggle() {
    this.playing = !this.playing;
    if (this.playing && this.t >= this.end) this.seek(0);
    this.show_playing(this.playing);
    if (this.playing) {
      this.last = performance.now();
      requestAnimationFrame(now => this.tick(now));
    }
  }

  show_playing(playing) {
    this.playing = playing;
    this.parts.play.setAttribute("aria-label", playing ? "Pause" : "Play");
    this.parts.play.querySelector("path").setAttribute("d",
      playing ? "M6 4h4v16H6zM14 4h4v16h-4z" : "M7 4v16l13-8z");
  }

  tick(now) {
    if (!this.playing) return;
    const passed = Math.min(now - this.last, 250) / 1e3;
    this.last = now;
    this.seek(this.t + Math.max(passed, 0) * this.parts.speed.value);
    if (this.t >= this.end) this.toggle();
    else requestAnimationFrame(next => this.tick(next));
  }

  seek(t) {
    this.t = Math.min(Math.max(t, 0), this.end);
    const frame = this.runs.map(run => run.at(this.t).frame).join();
    const moved = frame !== this.frame;
    this.frame = frame;
    this.parts.scrub.value = this.t;
    this.parts.time.textContent = `${this.t.toFixed(2)} s`;
    this.stacks.forEach(stack => stack.follow(this.t));
    this.curves.follow(this.t, moved);
    this.redraw();
  }

  // By whole frames of the run that lasts longest.
  step(frames) {
    const run = this.runs.reduce((a, b) => b.end > a.end ? b : a), times = run.t.values;
    this.seek(times[Math.min(Math.max(run.at(this.t).frame + frames, 0), run.frames - 1)]);
  }

  key(event, speed) {
    const {key, target, shiftKey} = event;
    if (event.ctrlKey || event.metaKey || event.altKey || target.tagName === "SELECT") return;
    const faster = by => {
      speed.selectedIndex = Math.min(Math.max(speed.selectedIndex + by, 0), speed.length - 1);
    };
    const sideways = by => shiftKey ? this.seek(this.t + by) : this.step(by);
    const done = {
      " ": () => this.toggle(), ArrowLeft: () => sideways(-1), ArrowRight: () => sideways(1),
      Home: () => this.seek(0), End: () => this.seek(this.end),
      "+": () => faster(1), "-": () => faster(-1),
      r: () => { this.stage?.camera.reset(); this.redraw(); },
      s: () => this.runs.length > 1 && this.arrange(!this.beside)}[key];
    if (!done || (key === " " && target.tagName === "BUTTON")) return;
    event.preventDefault();
    done();
  }

  follow_pointers(space) {
    const down = new Map();
    const aspect = () => space.clientWidth / space.clientHeight;
    space.addEventListener("pointerdown", event => {
      space.setPointerCapture(event.pointerId);
      down.set(event.pointerId, event);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      space.addEventListener(name, event => down.delete(event.pointerId));
    }
    space.addEventListener("pointermove", event => {
      const before = down.get(event.pointerId);
      if (!before) return;
      const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
      const {camera} = this.stage, height = space.clientHeight;
      const other = [...down.values()].find(one => one.pointerId !== event.pointerId);
      if (other) {
        const apart = one => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
        camera.closer(apart(event) / Math.max(apart(before), 1));
        camera.move(dx / height / 2, -dy / height / 2, aspect());
      } else if (event.shiftKey || event.buttons & 6) {
        camera.move(dx / height, -dy / height, aspect());
      } else camera.turn(dx * 0.008, dy * 0.008);
      down.set(event.pointerId, event);
      this.redraw();
    });
    space.addEventListener("wheel", event => {
      if (this.embedded && document.activeElement !== space && !event.ctrlKey) return;
      event.preventDefault();
      this.stage.camera.closer(Math.exp(-event.deltaY * 0.0012));
      this.redraw();
    }, {passive: false});
    space.addEventListener("dblclick", () => { this.stage.camera.reset(); this.redraw(); });
    space.addEventListener("contextmenu", event => event.preventDefault());
  }

  redraw() {
    if (!this.stage || this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      const {space} = this.parts, ratio = Math.min(devicePixelRatio || 1, 2);
      const [width, height] = [space.clientWidth, space.clientHeight]
        .map(size => Math.max(1, Math.round(size * ratio)));
      if (space.width !== width || space.height !== height) Object.assign(space, {width, height});
      this.name(this.stage.draw(this.t, this.beside && this.runs.length > 1), ratio);
    });
  }

  name(pictures, ratio) {
    const {space, names, legend} = this.parts;
    const above = legend.offsetParent === legend.parentElement ? 44 : 6;  // height covered by the legend
    names.replaceChildren(...pictures.map(({run, area: [x, y, , h]}) => element("span", {
      style: `left: ${x / ratio + 10}px; border-left: 4px solid ${run.colour};` +
        `top: ${space.offsetTop + (space.height - y - h) / ratio + above}px`}, run.label)));
  }
}
