// Headline cards, cost waterfall and outcomes.
const OUTCOMES = {
  sla: ['delivered intact, in time', '--sla'], arrived: ['arrived', '--arrived'], spoiled: ['food spoiled', '--spoiled'],
  timeout: ['too late', '--timeout'], physical_assistance: ['physical assistance', '--physical'],
};
const undefinedFor = each => `undefined: ${each.why}`;
const BRIEF = { sla: 'in time', arrived: 'arrived', spoiled: 'spoiled', timeout: 'late', physical_assistance: 'assistance' };
const outcomeName = key => (OUTCOMES[key] || [key.replaceAll('_', ' ')])[0];

function headlineCards(dearest) {
  const { stacks, paper, verdicts, setup } = DATA.headline;
  return [
    h('ul', { class: 'verdicts' }, verdicts.map(verdict)),
    setup.map(line => h('p', { class: 'note' }, line)),
    dearest,
    h('div', { class: 'cards' }, stacks.map((each, number) => card(each, tint(number))), card(paper, null)),
  ];
}
function verdict(text) {  // the commands that would decide stand on lines of their own
  const [line, ...commands] = text.split('\n');
  return h('li', {}, line, commands.map(command => h('pre', { class: 'broken' }, h('code', {}, command.trim()))));
}
function card(each, colour) {
  const facts = [
    ['deliveries', num(each.n)],
    ['intact and in time', percent(each.sla.v)],
    ['cost of each', usd(each.opex.v)],
    each.atFault && ['margin if it pays where at fault', usd(each.atFault.v)],
    each.worst && isNumber(each.worst.v) && ['worst 5 % cost', usd(each.worst.v)],
    ['break-even', isNumber(each.breakEvenRuns) ? `${num(each.breakEvenRuns)} runs` : isNumber(each.margin.v) ? 'never' : 'undefined'],
    isNumber(each.probability) && ['P(within its life)', num(each.probability, 3)],
  ].filter(Boolean);
  const known = isNumber(each.margin.v);
  const interval = span(each.margin, usd);
  return h('div', { class: colour ? 'card' : 'card paper', tint: colour },
    h('h3', {}, colour ? each.label : `${each.label}, as published`),
    h('div', { class: each.loses ? 'big loss' : 'big' }, known ? usd(each.margin.v) : 'undefined'),
    h('div', { class: 'unit' }, 'margin per delivery'),
    h('div', { class: 'ci', 'data-tip': colour && 'One more delivery is admitted, which loses up to what world and rules allow.' }, interval ? `95 % ${interval}` : colour ? 'no interval: too few, or all alike' : 'no interval published'),
    h('dl', {}, facts.map(([name, value]) => [h('dt', {}, name), h('dd', {}, value)])));
}

function waterfallPanels() {
  const reach = some => some.flatMap(steps).flatMap(step => [step.from, step.to])
    .concat(some.flatMap(each => [each.margin.lo, each.margin.hi]), 0).filter(isNumber);
  const own = reach(DATA.waterfall.filter(each => !each.paper)), paper = reach(DATA.waterfall.filter(each => each.paper));
  const wide = Math.max(...own) - Math.min(...own), all = [...own, ...paper];
  const apart = wide > 0 && Math.max(...all) - Math.min(...all) > 3 * wide;  // then one scale would flatten one's own
  const scaleOf = each => !apart ? all : each.paper ? paper : own;
  const panel = (each, number) => {
    const low = Math.min(...scaleOf(each)), high = Math.max(...scaleOf(each));
    return h('div', {}, h('h3', {}, !each.paper && h('span', { class: 'dot', tint: tint(number) }), each.label),
      figure(`${each.label}: from revenue to margin: ${steps(each).map(step => `${step.name} ${usd(step.value)}`).join(', ') || undefinedFor(each)}`,
        width => waterfall(each, width, low, high)));
  };
  return [h('div', { class: 'panels' }, DATA.waterfall.map(panel)),
    apart && h('p', { class: 'note' }, 'The stacks share one scale; the published one has its own, for it reaches more than three times as far.')];
}
function steps(each) {
  if (!isNumber(each.revenue) || !isNumber(each.margin.v)) return [];
  let level = each.revenue;
  const found = [{ name: 'revenue', value: each.revenue, from: 0, to: level, kind: 'gain' }];
  for (const [name, cost] of each.terms) {
    found.push({ name, value: -cost, from: level, to: level - cost, kind: 'cost' });
    level -= cost;
  }
  return [...found, { name: 'margin', value: each.margin.v, from: 0, to: each.margin.v, kind: 'total' }];
}
function waterfall(each, width, low, high) {
  const rows = steps(each), row = 25, left = 86, right = 68;
  const height = rows.length * row + 24, x = linear(low, high, left, width - right);
  const picture = s('svg', { width, height });
  if (!rows.length) return fill(picture, {}, [s('text', { x: 0, y: 16, class: 't' }, undefinedFor(each))]);
  const count = Math.max(3, (width - left - right) / 48), decimals = Math.max(0, Math.ceil(-Math.log10(tickStep(low, high, count)) - 1e-9));
  for (const tick of ticks(low, high, count)) {
    picture.append(s('line', { x1: x(tick), x2: x(tick), y1: 0, y2: height - 20, class: tick ? 'grid' : 'axis' }),
      s('text', { x: x(tick), y: height - 5, 'text-anchor': 'middle', class: 't' }, usd(tick, decimals)));
  }
  rows.forEach((step, k) => {
    const y = k * row, from = Math.min(x(step.from), x(step.to)), size = Math.abs(x(step.to) - x(step.from));
    const total = step.kind === 'total', colour = step.kind === 'cost' ? 'var(--loss)' : step.value < 0 ? 'var(--loss)' : 'var(--gain)';
    picture.append(
      s('text', { x: 0, y: y + 15, class: total ? 'b' : '' }, step.name),
      s('rect', { x: from, y: y + 4, width: Math.max(size, 1.2), height: row - 9, rx: 1.5, fill: colour,
        'fill-opacity': step.kind === 'cost' ? .75 : total ? 1 : .45, 'data-tip': `${step.name}: ${usd(step.value, 4)} per delivery` }),
      s('text', { x: width, y: y + 15, 'text-anchor': 'end', class: total ? 'b' : '' }, usd(step.value)));
    if (k + 1 < rows.length) {
      picture.append(s('line', { x1: x(step.to), x2: x(step.to), y1: y + row - 5, y2: y + row + 4, stroke: 'var(--faint)' }));
    }
    if (total && isNumber(each.margin.lo)) picture.append(whisker(x(each.margin.lo), x(each.margin.hi), y + row / 2 - .5, 'var(--ink)'));
  });
  return picture;
}
const whisker = (from, to, y, stroke) => s('path', { d: `M${from} ${y}H${to}M${from} ${y - 4}V${y + 4}M${to} ${y - 4}V${y + 4}`, stroke,
  'stroke-width': 1.6, fill: 'none' });

function outcomeBars() {
  const kinds = Object.keys(OUTCOMES).filter(kind => DATA.outcomes.some(each => each.shares[kind] > 0));
  const told = each => kinds.filter(kind => each.shares[kind] > 0)
    .map(kind => `${percent(each.shares[kind])} ${outcomeName(kind)}`).join(' · ');
  const legend = h('div', { class: 'legend' }, kinds.map(kind =>
    h('span', {}, h('span', { class: 'key', tint: `var(${OUTCOMES[kind][1]})` }), outcomeName(kind))));
  const label = `Outcomes: ${DATA.outcomes.map(each => `${each.label}: ${told(each)}`).join('; ')}`;
  return [legend, figure(label, width => {
    const row = 62, picture = s('svg', { width, height: DATA.outcomes.length * row });
    DATA.outcomes.forEach((each, k) => {
      let x = 0;
      const y = k * row;
      const count = `n = ${num(each.n)}${each.errors ? `, ${each.errors} ${each.errors === 1 ? 'error' : 'errors'}` : ''}`;
      const room = Math.floor((width - 7 * count.length) / 7.5);  // characters, at most so wide
      const label = each.label.length > room ? `${each.label.slice(0, Math.max(room - 1, 1))}…` : each.label;
      picture.append(s('text', { x: 0, y: y + 13, class: each.paper ? 't' : 'b', 'data-tip': each.label }, label),
        s('text', { x: width, y: y + 13, 'text-anchor': 'end', class: 't' }, count));
      for (const kind of kinds) {
        const size = width * (each.shares[kind] || 0);
        if (size > 0) picture.append(s('rect', { x, y: y + 20, width: Math.max(size - (size > 3 ? 1 : 0), 1), height: 15, rx: 1.5,
          fill: `var(${OUTCOMES[kind][1]})`, 'fill-opacity': each.paper ? .6 : 1, 'data-tip': `${outcomeName(kind)}: ${percent(each.shares[kind], 2)}` }));
        x += size;
      }
      picture.append(s('text', { x: 0, y: y + 49, class: 't', css: width < 480 ? { fontSize: '11px' } : {} }, shortened(each, kinds, width)));
    });
    return picture;
  })];
}
function shortened(each, kinds, width) {
  return kinds.filter(kind => each.shares[kind] > 0)
    .map(kind => `${percent(each.shares[kind])} ${width < 640 ? BRIEF[kind] : outcomeName(kind)}`).join('  ·  ');
}
