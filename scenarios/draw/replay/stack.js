// The stack of each run as a live list: what is met, inactive, missed.

const ROW = 26;  // px

class StackList {
  constructor(run, {fates, phrases}, several, seek) {
    this.phrases = phrases;
    this.run = run;
    this.unknown = fates.unknown;
    this.fates = Object.fromEntries(Object.entries(fates).map(([name, value]) => [value, name]));
    this.rows = run.tasks.map(task => {
      const parts = {rank: element("b"), said: element("em")};
      parts.row = element("li", {"data-task": task}, parts.rank, element("span", {}, task),
                          parts.said);
      return parts;
    });
    this.list = element("ol", {class: "order", style: `height: ${ROW * run.tasks.length}px`},
                        ...this.rows.map(parts => parts.row));
    this.near = element("p");
    this.goals = element("div", {class: "goals"}, ...run.goals.map((goal, k) => {
      if (!run.missed.includes(k)) return element("div", {}, goal);
      const [short, ...rest] = goal.split(";");
      return element("div", {}, element("b", {}, short), element("span", {}, `;${rest.join(";")}`));
    }));
    this.note = element("p");
    const head = element("h2", {}, ...(several ? [sample(run)] : []), run.label, element("small", {}, run.scenario));
    this.card = element("article", {class: "card"}, head, this.goals, this.list, ...this.joint_row(),
                        this.near, this.note, ...this.events(seek));
    const judged = !run.fate.values.includes(this.unknown);
    this.doubt = judged ? [] : ["Unknown where the rows cannot be reconstructed, for example after a change by hand."];
    this.note.hidden = judged && !run.fault;
    this.note.append(...this.doubt);
    this.frame = -1;
  }

  // What happened, and when; a click goes there.
  events(seek) {
    return this.run.events.map(({t, text}) => {
      const button = element("button", {type: "button"}, `${t.toFixed(3)} s`);
      button.addEventListener("click", () => seek(t));
      return element("p", {class: "event"}, button, ` ${text}`);
    });
  }

  joint_row() {
    if (!this.run.limited || this.run.fate.values.includes(this.unknown)) return [];
    this.joints = this.run.joints.map(name => element("i", {title: name}));
    this.joints_say = element("span");
    return [element("div", {class: "joints"}, element("span", {}, "limits:"), ...this.joints,
                    this.joints_say)];
  }

  follow(t) {
    const {frame} = this.run.at(t);
    if (frame === this.frame) return;
    this.frame = frame;
    this.order(frame);
    this.limits(frame);
    this.distance(frame);
    if (this.run.fault) {
      this.note.replaceChildren(...this.doubt, element("b", {}, frame === this.run.frames - 1 ?
        `stopped: ${this.run.fault}` : `will stop at ${this.run.end.toFixed(2)} s`));
    }
  }

  order(frame) {
    const {run} = this, order = run.order_at(frame);
    const fates = run.row("fate", frame), violations = run.row("violation", frame);
    this.list.setAttribute("aria-label", `Stack: ${order.join(", then ")}`);
    const absent = run.tasks.filter(task => !order.includes(task));
    run.tasks.forEach((task, n) => {
      const {row, rank, said} = this.rows[n], place = order.indexOf(task);
      const fate = this.fates[fates[n]];
      const at = place < 0 ? order.length + absent.indexOf(task) : place;
      row.className = fate;
      row.style.transform = `translateY(${at * ROW}px)`;
      rank.textContent = place < 0 ? "–" : `${place + 1}`;
      said.textContent = fate === "missed" ?
        `${this.phrases.missed} by ${short(violations[n])} ${run.units[n]}` : this.phrases[fate];
      row.title = fate === "missed" ?
        `Norm of the violation of its rows (${run.level})` : "";
    });
  }

  limits(frame) {
    if (!this.joints) return;
    const sides = this.run.row("saturated", frame);
    const few = this.joints.length <= 12;
    this.joints.forEach((joint, j) => {
      joint.hidden = !few && !sides[j];
      joint.className = sides[j] ? "at" : "";
      joint.textContent = `${few ? j + 1 : this.run.joints[j]}${sides[j] > 0 ? "↑" : sides[j] < 0 ? "↓" : ""}`;
    });
    const any = sides.some(side => side !== 0);
    this.joints_say.textContent = any ? "saturated" : "no joint is saturated";
  }

  distance(frame) {
    const {run} = this, linked = run.linked.values[frame], distance = run.distance.values[frame];
    if (!Number.isFinite(distance)) return;
    const what = linked === run.points.width / 3 - 1 ? "end effector" : `point ${linked + 1}`;
    const active = run.active.values[frame] === linked;
    this.near.replaceChildren(active ? element("b", {}, what) : what,
      `: ${(1e3 * distance).toFixed(0)} mm from an obstacle${active ? ", kept away" : ""}`);
  }
}
