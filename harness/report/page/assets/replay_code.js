// Reads what recording_code.py wrote: gzip, then a head in JSON and whole numbers as differences along each column.
const ABSENT = 5e4;  // [m] nobody stands beyond it, and no belief is there
const WHOLE = { 1: Int8Array, 2: Int16Array, 4: Int32Array };

async function decodeRecording(text) {
  if (typeof DecompressionStream === 'undefined') throw new Error('This browser cannot unpack replays (it has no DecompressionStream); use one from 2023 or later.');
  const packed = Uint8Array.from(atob(text), character => character.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  const bytes = await new Response(stream).arrayBuffer();
  const size = new DataView(bytes).getUint32(0, true);
  const heads = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, size)));
  const fields = {};
  let position = 4 + size;
  for (const head of heads) {
    const length = head.columns * head.n * head.bytes;
    const steps = new WHOLE[head.bytes](bytes.slice(position, position + length));
    position += length;
    fields[head.name] = Array.from({ length: head.columns }, (_, column) => {
      const values = new Float32Array(head.n), scale = head.scales[column] ?? head.scales[0];
      let whole = head.first[column];
      for (let k = 0; k < head.n; k++) values[k] = (whole += steps[column * head.n + k]) * scale;
      return values;
    });
  }
  return fields;
}

// One delivery as a function of time.
class Recording {
  constructor(facts, fields) {
    const { pose, ...others } = fields;
    Object.assign(this, others);
    this.driven = pose;
    this.facts = facts;
    this.times = fields.t[0];
    this.settled = facts.duration ?? this.times.at(-1);
    this.end = Math.max(this.times.at(-1), this.settled, ...facts.contacts.map(each => each[2]));
    this.trackStart = starts(fields.trackCount[0]);
    this.planStart = starts(fields.planSize[0]);
    this.optionStart = starts(fields.optionCount[0]);
    this.wayStart = starts(fields.optionSize[0]);
    this.costed = facts.contacts.filter(each => isGrave(each[3], each[5], each[6]));
    this.bill = [
      ['refund', facts.money.service_compensation], ['repair', facts.money.repair], ['electricity', facts.money.electricity],
    ].filter(each => each[1] > 0).map(([name, cost]) => ({ time: this.settled, name, cost }));
    const hasFailed = !['sla', 'arrived', 'end_of_the_log'].includes(facts.outcome);
    const ended = hasFailed && !facts.reasons.length ? [this.settled] : [];  // otherwise the reasons tell of it
    this.stops = [...new Set([...this.costed.map(each => each[2]), ...facts.reasons.map(each => each.time), ...ended])].sort((a, b) => a - b);
    this.events = [...this.costed.map(each => ({ time: each[2], name: each[3].replaceAll('_', ' '), cost: each[5] })), ...this.bill];
  }
  row(time) {  // the row at or before a time, and how far it is to the next
    const last = this.times.length - 1, k = Math.min(last, Math.max(0, before(this.times, time)));
    const next = Math.min(last, k + 1), gap = this.times[next] - this.times[k];
    return [k, next, gap > 0 ? Math.min(1, Math.max(0, (time - this.times[k]) / gap)) : 0];
  }
  value(columns, index, [k, next, part]) { return columns[index][k] + part * (columns[index][next] - columns[index][k]); }
  wayUntil(time) { return Array.from({ length: this.row(time)[0] + 1 }, (_, k) => [this.driven[0][k], this.driven[1][k]]); }
  pose(columns, row) { return [0, 1, 2].map(index => this.value(columns, index, row)); }
  believed([k, next, part]) {  // null: it has no belief just then
    const isKnown = index => Math.abs(this.belief[0][index]) < ABSENT;
    return this.belief && isKnown(k) ? this.pose(this.belief, isKnown(next) ? [k, next, part] : [k, k, 0]) : null;
  }
  people(row) {
    const found = [];
    for (let k = 0; k < this.crowd.length; k += 2) found.push([this.value(this.crowd, k, row), this.value(this.crowd, k + 1, row)]);
    return found;
  }
  tracksAt([k]) {
    const found = [];
    for (let i = this.trackStart[k]; i < this.trackStart[k + 1]; i++) found.push(this.tracks.map(column => column[i]));
    return found;
  }
  optionsAt([k]) {  // the chosen motion first
    const found = [];
    for (let i = this.optionStart[k]; i < this.optionStart[k + 1]; i++) {
      const way = [];
      for (let j = this.wayStart[i]; j < this.wayStart[i + 1]; j++) way.push([this.options[0][j], this.options[1][j]]);
      found.push({ total: this.optionTotal[0][i], way });
    }
    return found;
  }
  planAt(time) {
    if (!this.planStamp[0].length) return [];
    const k = before(this.planStamp[0], time + 1e-3);
    if (k < 0) return [];
    const found = [];
    for (let i = this.planStart[k]; i < this.planStart[k + 1]; i++) found.push([this.plan[0][i], this.plan[1][i]]);
    return found;
  }
  scanAt(time) {  // where its beams ended, map frame, from where the robot really was
    if (!this.scanStamp[0].length) return [];
    const k = before(this.scanStamp[0], time + 1e-3);
    if (k < 0) return [];
    const stamp = this.scanStamp[0][k], [x, y, yaw] = this.pose(this.driven, this.row(stamp));
    const [least, step, , , sx, sy, turn] = this.scanGeometry[0];
    const ox = x + Math.cos(yaw) * sx - Math.sin(yaw) * sy, oy = y + Math.sin(yaw) * sx + Math.cos(yaw) * sy;
    const found = [];
    this.scan[k].forEach((range, beam) => {
      if (range <= 0) return;
      const angle = yaw + turn + least + beam * step;
      found.push([ox + range * Math.cos(angle), oy + range * Math.sin(angle)]);
    });
    return found;
  }
  costs(time) { return this.events.reduce((sum, each) => sum + (each.time <= time + 1e-3 ? each.cost : 0), 0); }
  get clearances() {  // [m] of every row
    return this.kept ??= Array.from(this.times, (_, k) => this.nearest([k, k, 0]));
  }
  nearest(row) {  // [m] between the robot's outline and the disc of whoever is nearest; 0: they touch
    const [x, y, yaw] = this.pose(this.driven, row), c = Math.cos(yaw), n = Math.sin(yaw), radius = this.facts.personRadius;
    return this.people(row).reduce((least, [px, py]) => {
      const place = [c * (px - x) + n * (py - y), c * (py - y) - n * (px - x)];
      return Math.min(least, Math.max(0, gap(place, this.facts.footprint) - radius));
    }, Infinity);
  }
}
function gap([px, py], corners) {  // from a point to a polygon; 0: it is inside
  let inside = false, least = Infinity;
  corners.forEach(([ax, ay], k) => {
    const [bx, by] = corners[(k + 1) % corners.length];
    if (ay > py !== by > py && px < ax + (py - ay) / (by - ay) * (bx - ax)) inside = !inside;
    least = Math.min(least, distance([px, py], [ax, ay], [bx, by]));
  });
  return inside ? 0 : least;
}
function starts(counts) {
  const found = new Int32Array(counts.length + 1);
  counts.forEach((count, k) => { found[k + 1] = found[k] + Math.round(count); });
  return found;
}
function before(sorted, value) {  // the last that is not above the value; -1: none
  let low = -1, high = sorted.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= value + 1e-6) low = middle; else high = middle;
  }
  return low;
}
