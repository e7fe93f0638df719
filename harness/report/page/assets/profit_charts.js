// Profit over deliveries, and when the robot has paid for itself.
function profitCurves() {
  const curves = DATA.profit, without = DATA.noProfit.map(each => h('p', { class: 'note' }, `${each.label}: undefined, ${each.why}.`));
  if (!curves.length) return without;
  const colour = each => tint(DATA.entries.findIndex(entry => entry.label === each.label));
  const told = each => `${usd(each.sum.at(-1), 0)} after ${num(each.k.at(-1))}`
    + (each.low ? `, 95 % of resampled ${usd(each.low.at(-1), 0)} to ${usd(each.high.at(-1), 0)}` : '');
  const label = `Profit summed over deliveries: ${curves.map(each => `${each.label} ${told(each)}`).join('; ')}`;
  const legend = h('div', { class: 'legend' }, curves.map(each =>
    h('span', {}, h('span', { class: 'key', tint: colour(each) }), `${each.label}: ${told(each)}`)));
  return [legend, without, figure(label, width => {
    const height = Math.min(360, Math.max(250, width * .55)), left = 52, right = 12, top = 10, bottom = 38;
    const last = Math.max(...curves.map(each => each.k.at(-1)));
    const ends = curves.flatMap(each => [...(each.low || []), ...(each.high || []), ...each.sum, 0]);
    const low = Math.min(...ends), high = Math.max(...ends);
    const x = linear(0, last, left, width - right), y = linear(low, high, height - bottom, top);
    const picture = s('svg', { width, height });
    for (const tick of ticks(low, high, 5)) {
      picture.append(s('line', { x1: left, x2: width - right, y1: y(tick), y2: y(tick), class: tick ? 'grid' : 'axis' }),
        s('text', { x: left - 8, y: y(tick) + 4, 'text-anchor': 'end', class: 't' }, (tick < 0 ? '−$' : '$') + short(Math.abs(tick))));
    }
    for (const tick of ticks(0, last, Math.max(3, width / 110)).filter(Number.isInteger)) {
      picture.append(s('text', { x: x(tick), y: height - bottom + 17, 'text-anchor': 'middle', class: 't' }, num(tick)));
    }
    picture.append(s('text', { x: (left + width - right) / 2, y: height - 3, 'text-anchor': 'middle', class: 't' }, 'deliveries'));
    for (const each of curves.filter(each => each.low)) {
      const there = each.k.map((k, i) => `${x(k).toFixed(1)} ${y(each.high[i]).toFixed(1)}`);
      const back = each.k.map((k, i) => `${x(k).toFixed(1)} ${y(each.low[i]).toFixed(1)}`).reverse();
      picture.append(s('path', { d: `M${[...there, ...back].join('L')}Z`, fill: colour(each), 'fill-opacity': .14 }));
    }
    for (const each of curves) {
      const line = [`${x(0)} ${y(0)}`, ...each.k.map((k, i) => `${x(k).toFixed(1)} ${y(each.sum[i]).toFixed(1)}`)];
      picture.append(s('path', { d: `M${line.join('L')}`, fill: 'none', stroke: colour(each), 'stroke-width': 2.2, 'stroke-linejoin': 'round', 'data-tip': `${each.label}: ${told(each)}` }));
    }
    return picture;
  })];
}

function breakEvenRidges() {
  const known = DATA.breakEven;
  const note = DATA.noBreakEven.map(each => h('p', { class: 'note' }, `${each.label}: no spread, ${each.why}.`));
  if (!known.length) return note;
  const colour = each => tint(DATA.entries.findIndex(entry => entry.label === each.label));
  const told = each => `${each.label}: ${isNumber(each.runs) ? `${num(each.runs)} deliveries` : 'never at the mean margin'}, `
    + `never in ${percent(each.never)} of the resamples`;
  return [figure(`Break-even point: ${known.map(told).join('; ')}`, width => {
    const row = 104, bottom = 40, height = known.length * row + bottom, left = 4, right = 4;
    const ends = known.flatMap(each => [...each.edges, each.life]);
    const low = Math.log10(Math.min(...ends)) - .06, high = Math.log10(Math.max(...ends)) + .06;
    const at = linear(low, high, left, width - right), x = runs => at(Math.log10(runs));
    const picture = s('svg', { width, height });
    for (let power = Math.floor(low); power <= high; power++) for (const digit of [1, 2, 5]) {
      const runs = digit * 10 ** power;
      if (Math.log10(runs) < low || Math.log10(runs) > high || (digit !== 1 && high - low > 1.6 && width < 700)) continue;
      picture.append(s('line', { x1: x(runs), x2: x(runs), y1: 8, y2: height - bottom, class: 'grid' }),
        s('text', { x: x(runs), y: height - bottom + 17, 'text-anchor': 'middle', class: 't' }, short(runs)));
    }
    known.forEach((each, k) => {
      const base = (k + 1) * row, room = row - 52, tall = (1 - each.never) * room / Math.max(...each.shares, 1e-9);
      let path = '';
      each.shares.forEach((share, i) => {
        const top = base - share * tall;
        path += `${i ? 'V' : `M${x(each.edges[0])} ${base}V`}${top.toFixed(1)}H${x(each.edges[i + 1]).toFixed(1)}`;
      });
      if (path) picture.append(s('path', { d: `${path}V${base}Z`, fill: colour(each), 'fill-opacity': .3, stroke: colour(each), 'stroke-width': 1.4,
        'data-tip': told(each) }));
      const facts = [`${usd(each.capex, 0)}: ${isNumber(each.runs) ? `${num(each.runs)} at the mean margin` : 'never at the mean margin'}`,
        each.never > 0 && `never in ${each.never < .0005 ? '< 0.1 %' : percent(each.never)}`].filter(Boolean).join(' · ');
      picture.append(s('line', { x1: left, x2: width - right, y1: base, y2: base, class: 'axis' }),
        s('text', { x: left, y: base - row + 25, class: 'b', css: { fill: colour(each) } }, each.label),
        s('text', { x: left, y: base - row + 42, class: 't' }, facts),
        s('line', { x1: x(each.life), x2: x(each.life), y1: base - room - 4, y2: base, stroke: 'var(--loss)', 'stroke-dasharray': '4 3' }));
      if (isNumber(each.runs) && Math.log10(each.runs) < high) picture.append(s('circle', { cx: x(each.runs), cy: base, r: 4, fill: colour(each) }));
    });
    picture.append(s('text', { x: (left + width - right) / 2, y: height - 3, 'text-anchor': 'middle', class: 't' },
      width < 640 ? 'deliveries to break even (log); dashed: robot’s life'
        : 'deliveries to break even (log scale); a hill is as high as resamples are many that pay back; dashed: robot’s life'));
    return picture;
  }), ...note];
}
