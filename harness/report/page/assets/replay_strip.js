// The strip below a replay: speed, clearance and costs over time, a lane each; of two deliveries in two colours.
const FAR_ENOUGH = 4;  // [m] clearance above which nobody counts as near
const LANE = 58, LANE_GAP = 20;  // [px]
const LINES = ['--robot', '--rival'];

const rowsOf = values => recording => Array.from(recording.times, (time, k) => [time, values(recording, k)]);
const LANES = [  // what it shows, its least and largest value, and its points over time
  { title: 'speed [m/s]', least: 0, most: 2, points: rowsOf((recording, k) => recording.motion[0][k]) },
  { title: `nearest person [m], up to ${FAR_ENOUGH}`, least: 0, most: FAR_ENOUGH, points: recording => recording.crowd.length
    ? rowsOf((each, k) => Math.min(FAR_ENOUGH, each.clearances[k]))(recording) : [] },
  { title: 'costs so far [USD]', least: 0, most: 1, points: recording => {
    const points = [[0, 0]];
    let sum = 0;
    for (const event of [...recording.events].sort((a, b) => a.time - b.time)) {
      points.push([event.time, sum]);
      sum += event.cost;
      points.push([event.time, sum]);
    }
    return [...points, [Math.max(recording.end, recording.settled), sum]];
  } },
];

function replayStrip(recordings, seek) {
  const [first] = recordings, end = Math.max(...recordings.map(each => Math.max(each.end, each.settled)));
  const told = `Speed, clearance and costs over ${num(first.end)} s with ${first.stops.length} events that cost something`;
  const left = 34, right = 52, height = LANES.length * (LANE + LANE_GAP) + 20;
  let cursor = null, x = null, last = 0;
  const place = figure(told, width => {
    x = linear(0, end, left, width - right);
    const picture = s('svg', { width, height, css: { cursor: 'pointer' } }, s('rect', { x: 0, y: 0, width, height, fill: 'transparent' }));
    for (const tick of ticks(0, end, width / 90)) {
      picture.append(s('line', { x1: x(tick), x2: x(tick), y1: LANE_GAP, y2: height - 20, class: 'grid' }),
        s('text', { x: x(tick), y: height - 5, 'text-anchor': 'middle', class: 't' }, `${num(tick)} s`));
    }
    LANES.forEach((lane, k) => picture.append(drawLane(lane, LANE_GAP + k * (LANE + LANE_GAP), width)));
    picture.append(...marks(height - 20));
    cursor = s('line', { y1: 0, y2: height - 16, stroke: 'var(--ink)', 'stroke-width': 1.6 });
    picture.append(cursor);
    const go = event => {
      if (event.type === 'pointermove' && event.buttons !== 1) return;
      const at = event.clientX - picture.getBoundingClientRect().left;
      seek(Math.max(0, Math.min(first.end, (at - left) / (width - right - left) * end)));
    };
    picture.addEventListener('pointerdown', go);
    picture.addEventListener('pointermove', go);
    move(last);
    return picture;
  });
  function drawLane(lane, top, width) {
    const lines = recordings.map(lane.points), values = lines.flat().map(each => each[1]);
    const low = Math.min(lane.least, ...values), high = Math.max(lane.most, ...values), y = linear(low, high, top + LANE, top);
    const group = s('g', {}, s('text', { x: left, y: top - 6, class: 't' }, lane.title));
    for (const tick of ticks(low, high, 2)) {
      group.append(s('line', { x1: left, x2: width - right, y1: y(tick), y2: y(tick), class: 'grid' }),
        s('text', { x: left - 6, y: y(tick) + 4, 'text-anchor': 'end', class: 't' }, short(tick)));
    }
    lines.forEach((points, k) => {
      if (!points.length) return;
      const every = Math.max(1, Math.floor(points.length / width)), kept = points.filter((_, i) => i % every === 0 || i === points.length - 1);
      group.append(s('path', { d: `M${kept.map(([time, value]) => `${x(time).toFixed(1)} ${y(value).toFixed(1)}`).join('L')}`, fill: 'none',
        stroke: `var(${LINES[k]})`, 'stroke-width': 1.6 }));
    });
    return group;
  }
  function marks(low) {
    const found = first.costed.map(([, , stamp, kind, , cost]) =>
      s('circle', { cx: x(stamp), cy: low, r: 4.5, fill: 'var(--loss)', 'data-tip': `${kind.replaceAll('_', ' ')} at ${num(stamp, 1)} s: ${usd(cost)}` }));
    for (const { time, words } of first.facts.reasons) {  // what no contact marks: food spoiled, too late, help needed
      if (first.costed.some(each => Math.abs(each[2] - time) < .2)) continue;
      const at = x(time);
      found.push(s('path', { d: `M${at - 5} ${low}L${at} ${low - 5}L${at + 5} ${low}L${at} ${low + 5}Z`, fill: 'var(--loss)', 'data-tip': sign(words).split(': ')[0] }));
    }
    return found;
  }
  function move(time) {
    last = time;
    if (cursor) { cursor.setAttribute('x1', x(time)); cursor.setAttribute('x2', x(time)); }
  }
  return { place, move };
}
