// The strip below a replay: speed and the costs so far over time, with a mark for each costed event.
function replayStrip(recording, seek) {
  let cursor = null, x = null;
  const told = `Speed and costs over ${num(recording.end)} s with ${recording.stops.length} events that cost something`;
  const place = figure(told, width => {
    const height = 104, left = 34, right = 46, top = 18, bottom = 20, end = Math.max(recording.end, recording.settled);
    const speeds = recording.motion[0], fastest = Math.max(2, ...speeds), slowest = Math.min(0, ...speeds), total = Math.max(recording.costs(Infinity), 1e-9);
    x = linear(0, end, left, width - right);
    const y = linear(slowest, fastest, height - bottom, top), dollars = linear(0, total * 1.05, y(0), top);
    const picture = s('svg', { width, height, css: { cursor: 'pointer' } });
    picture.append(s('rect', { x: 0, y: 0, width, height, fill: 'transparent' }));
    for (const tick of ticks(0, end, width / 90)) {
      picture.append(s('line', { x1: x(tick), x2: x(tick), y1: top, y2: height - bottom, class: 'grid' }),
        s('text', { x: x(tick), y: height - 5, 'text-anchor': 'middle', class: 't' }, `${num(tick)} s`));
    }
    const points = [], every = Math.max(1, Math.floor(speeds.length / width));
    for (let k = 0; k < speeds.length; k += every) points.push(`${x(recording.times[k]).toFixed(1)} ${y(speeds[k]).toFixed(1)}`);
    picture.append(s('path', { d: `M${points.join('L')}`, fill: 'none', stroke: 'var(--accent)', 'stroke-width': 1.4 }),
      s('text', { x: left, y: 10, class: 't' }, 'speed [m/s]'), s('text', { x: left - 6, y: y(0) + 3, 'text-anchor': 'end', class: 't' }, '0'),
      s('text', { x: left - 6, y: y(Math.floor(fastest)) + 4, 'text-anchor': 'end', class: 't' }, num(Math.floor(fastest))));
    if (recording.costs(Infinity) >= .005) {
      let path = `M${x(0)} ${dollars(0)}`, sum = 0;
      for (const event of [...recording.events].sort((a, b) => a.time - b.time)) {
        path += `H${x(event.time).toFixed(1)}`;
        sum += event.cost;
        path += `V${dollars(sum).toFixed(1)}`;
      }
      picture.append(s('path', { d: `${path}H${x(end)}`, fill: 'none', stroke: 'var(--loss)', 'stroke-width': 1.8 }),
        s('text', { x: width, y: dollars(sum) + 4, 'text-anchor': 'end', css: { fill: 'var(--loss)' } }, usd(sum, sum < 100 ? 2 : 0)));
    }
    for (const [, , stamp, kind, , cost] of recording.costed) {
      picture.append(s('circle', { cx: x(stamp), cy: height - bottom, r: 4.5, fill: 'var(--loss)', 'data-tip': `${kind.replaceAll('_', ' ')} at ${num(stamp, 1)} s: ${usd(cost)}` }));
    }
    for (const { time, words } of recording.facts.reasons) {  // what no contact marks: food spoiled, too late, help needed
      if (recording.costed.some(each => Math.abs(each[2] - time) < .2)) continue;
      const at = x(time), low = height - bottom;
      picture.append(s('path', { d: `M${at - 5} ${low}L${at} ${low - 5}L${at + 5} ${low}L${at} ${low + 5}Z`, fill: 'var(--loss)', 'data-tip': sign(words).split(': ')[0] }));
    }
    cursor = s('line', { y1: 0, y2: height - bottom + 4, stroke: 'var(--ink)', 'stroke-width': 1.6 });
    picture.append(cursor);
    const go = event => {
      if (event.type === 'pointermove' && event.buttons !== 1) return;
      const at = event.clientX - picture.getBoundingClientRect().left;
      seek(Math.max(0, Math.min(recording.end, (at - left) / (width - right - left) * end)));
    };
    picture.addEventListener('pointerdown', go);
    picture.addEventListener('pointermove', go);
    move(last);
    return picture;
  });
  let last = 0;
  function move(time) {
    last = time;
    if (cursor) { cursor.setAttribute('x1', x(time)); cursor.setAttribute('x2', x(time)); }
  }
  return { place, move };
}
