"use strict";
// Runs as scenarios/draw/replay/__init__.py packs them.

const KINDS = {f4: Float32Array, i2: Int16Array, u2: Uint16Array, i1: Int8Array};
const NOTHING = 65535;

function unpack(packed) {
  const bytes = Uint8Array.from(atob(packed.data), c => c.charCodeAt(0));
  const raw = new KINDS[packed.kind](bytes.buffer);
  const width = packed.shape.slice(1).reduce((a, b) => a * b, 1);
  if (packed.step === undefined) return {values: raw, width, rows: packed.shape[0]};
  const values = Float32Array.from(raw, at => at === NOTHING ? NaN : packed.low + at * packed.step);
  return {values, width, rows: packed.shape[0]};
}

class Run {
  constructor(data) {
    Object.assign(this, data);
    for (const [name, value] of Object.entries(data)) {
      if (value && value.data !== undefined) this[name] = unpack(value);
    }
    this.series = data.series.map(one => ({...one, value: unpack(one.value), low: unpack(one.low),
                                           high: unpack(one.high)}));
    this.paths = data.paths.map(({task, actual, wanted}) =>
      ({task, actual: unpack(actual), wanted: wanted && unpack(wanted)}));
    this.surroundings = JSON.stringify([data.obstacles, data.areas, data.centres]);
    this.frames = this.t.rows;
    this.end = this.t.values[this.frames - 1];
    this.visible = true;
    this.stretches = [{first: 0, last: Infinity, colour: this.colour}];  // of the path by colour
  }

  // The last frame not after time t [s], and the fraction of the time to the next.
  at(t) {
    const times = this.t.values;
    let low = 0, high = this.frames - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= t) low = middle; else high = middle - 1;
    }
    if (low === this.frames - 1) return {frame: low, share: 0};
    const share = (t - times[low]) / (times[low + 1] - times[low]);
    return {frame: low, share: Math.min(Math.max(share, 0), 1)};
  }

  // A row of an array, interpolated between two frames; an array with one row is constant.
  between(name, {frame, share}) {
    const {values, width, rows} = this[name];
    const first = Math.min(frame, rows - 1) * width;
    const row = values.slice(first, first + width);
    if (share > 0 && frame + 1 < rows) {
      for (let i = 0; i < width; i++) row[i] += share * (values[first + width + i] - row[i]);
    }
    return row;
  }

  row(name, frame) {
    const {values, width} = this[name];
    return values.subarray(frame * width, (frame + 1) * width);
  }

  order_at(frame) { return this.orders[this.order.values[frame]]; }
}
