// The paper's two tables, the comparison of stacks, and what the figures rest on.
function paperTables() {
  const { columns, layouts, notes, beside } = DATA.tables;
  const shown = all => columns.map((each, k) => [each, k]).filter(([each]) => all || !each.paper || each.title === beside);
  const place = h('div');
  const draw = all => place.replaceChildren(...layouts.map(layout => paperTable(layout, shown(all))));
  draw(false);
  return [h('div', { class: 'bar' }, check('all of the paper’s columns', false, draw)), place,
    notes.map(note => h('p', { class: 'note' }, note))];
}
function paperTable(layout, columns) {
  const head = h('tr', {}, h('th', { scope: 'col' }, layout.title), columns.map(([each]) =>
    h('th', { scope: 'col', class: each.paper ? 'n papercol' : 'n' }, each.title, h('span', { class: 'span' },
      `${each.paper ? 'paper, ' : ''}n = ${num(each.n)}`))));
  const groups = layout.sections.map(group => h('tbody', { class: 'group' },
    h('tr', {}, h('th', { colspan: columns.length + 1, scope: 'rowgroup' }, group.title)),
    group.rows.map(row => h('tr', { class: row.bold ? 'bold' : null }, h('th', { scope: 'row' }, row.label),
      columns.map(([each, k]) => h('td', { class: each.paper ? 'n papercol' : 'n' }, sign(row.cells[k][0]),
        row.cells[k][1] && h('span', { class: 'span' }, sign(row.cells[k][1]))))))));
  return scroller(layout.title, h('table', { class: 'wide' }, h('thead', {}, head), groups));
}

function accountingTable() {
  const { rows, notes } = DATA.accountings, cell = each => each === null ? '–' : [usd(each.value),
    isNumber(each.low) && h('span', { class: 'span' }, `${usd(each.low)} to ${usd(each.high)}`)];
  const head = h('tr', {}, h('th', { scope: 'col' }, 'contacts that count, and who pays'),
    DATA.headline.stacks.map(each => h('th', { scope: 'col', class: 'n' }, each.label, h('span', { class: 'span' }, `n = ${num(each.n)}`))));
  return [scroller('Who pays for contacts', h('table', { class: 'wide' }, h('thead', {}, head), h('tbody', {}, rows.map(row => h('tr', {},
    h('th', { scope: 'row' }, row.title), row.cells.map(each => h('td', { class: 'n' }, cell(each)))))))), notes.map(note => h('p', { class: 'note' }, note))];
}

function comparisonTables() {
  const known = DATA.comparisons;
  if (!known.length) return [h('p', { class: 'note' }, 'There is nothing to compare: one stack, or no missions in common.')];
  const place = h('div');
  const choose = number => place.replaceChildren(...comparisonTable(known[number]));
  const pick = h('select', { id: 'pair', on: { change: event => choose(Number(event.target.value)) } },
    known.map((each, k) => option(k, `${each.b} against ${each.a}`)));
  choose(0);
  return [h('div', { class: 'bar' }, h('label', { for: 'pair' }, 'compare', pick)), place];
}
function comparisonTable(pair) {
  const row = each => h('tr', {}, h('th', { scope: 'row' }, each.metric), h('td', { class: 'n' }, figures(each.a)), h('td', { class: 'n' }, figures(each.b)),
    h('td', { class: 'n' }, figures(each.difference.v), isNumber(each.difference.lo) &&
      h('span', { class: 'span' }, `${figures(each.difference.lo)} to ${figures(each.difference.hi)}`)),
    h('td', {}, forest(each.difference)), h('td', { class: 'n' }, each.p < .001 ? '< 0.001' : num(each.p, 3)),
    h('td', {}, each.better && h('strong', {}, each.better)), h('td', { class: 'n' }, num(each.needed)));
  const table = rows => scroller(`${pair.b} against ${pair.a}`, h('table', { class: 'wide' }, h('thead', {}, h('tr', {},
    h('th', { scope: 'col' }, `${num(pair.pairs)} common missions`),
    [pair.a, pair.b, 'difference'].map(name => h('th', { scope: 'col', class: 'n' }, name)),
    h('th', { scope: 'col' }, '95 % interval'), h('th', { scope: 'col', class: 'n' }, 'p'), h('th', { scope: 'col' }, 'better'),
    h('th', { scope: 'col', class: 'n' }, 'needed'))),
  h('tbody', {}, rows.map(row))));
  const first = pair.rows.filter(each => each.first), more = pair.rows.filter(each => !each.first);
  const left = pair.leftOut[0] + pair.leftOut[1];
  return [
    pair.warnings.map(text => h('p', { class: 'note loss' }, `Not comparable: ${text}`)),
    first.length ? table(first) : h('p', { class: 'note' }, 'Alike on every mission in the foremost metrics.'),
    more.length > 0 && h('details', {}, h('summary', {}, `${more.length} further metrics that differ`), table(more)),
    h('p', { class: 'note' }, `Differences mission by mission (${pair.b} minus ${pair.a}); intervals: the means that the test of p does not reject; `
      + `of the margin they admit an unseen loss; p by sign flips: the margin's, adjusted for all pairs of stacks (Holm), decides, the others are for looking only; ${pair.alike} metrics are alike on every mission. `
      + 'Needed: missions that resolve a difference as large as the one observed (power 0.8).'
      + (left ? ` ${left} deliveries have no partner and are left out.` : '')),
  ].flat().filter(Boolean);
}
function figures(value) {
  if (!isNumber(value)) return '–';
  const size = Math.abs(value);
  return num(value, size === 0 || size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : size >= .01 ? 3 : 4);
}
function forest(interval) {
  const width = 108, height = 18;
  if (!isNumber(interval.lo)) return '';
  const reach = Math.max(Math.abs(interval.lo), Math.abs(interval.hi)) * 1.08 || 1, x = linear(-reach, reach, 0, width);
  const sure = interval.lo > 0 || interval.hi < 0, colour = sure ? 'var(--accent)' : 'var(--faint)';
  return s('svg', { width, height, 'aria-hidden': 'true' },
    s('line', { x1: x(0), x2: x(0), y1: 0, y2: height, class: 'axis' }), whisker(x(interval.lo), x(interval.hi), height / 2, colour),
    s('circle', { cx: x(interval.v), cy: height / 2, r: 3.6, fill: colour }));
}

const LIMITS = [
  'Everything here is simulated: a rigid-body world on level ground, people who walk by a model, sensors with modelled noise. No figure was measured on a street.',
  'The maps that come with navbench are generated after the statistics of the published one; none of them is it.',
  "Contacts count from the threshold of the world's file on, property from that of the publication; softer ones are shown and cost nothing.",
  'Rare events decide the costs: a contact that no delivery met is not known to be impossible. An interval tells of chance within these missions, not of other cities, robots or prices.',
  "The paper's columns are its own measurements; only the money is worked out here from them, at these prices.",
  'Costs that the paper leaves out (mapping, operators, wear of the battery) are left out here: see navbench price.',
];
const FORGIVING = 'An injury has a price up to MAIS 3 only, as published: the hardest contacts with people, those that may kill, cost next to nothing here. Look at who was hit, not at the cost alone.';
function basisContent() {
  const { runs, prices, notes, made } = DATA.basis;
  const keys = ['folder', 'seed', 'missions', 'map', 'map version', 'people', 'world version', 'rules version', 'prices version', 'command'];
  const line = (name, values) => h('tr', {}, h('th', { scope: 'row' }, name), values.map(value => h('td', { class: 'wrap' }, value)));
  const listed = values => Object.entries(values).map(([name, value]) => `${name} ${value}`).join(', ');
  return [
    notes.map(text => h('p', { class: 'note loss' }, text)),
    scroller('Runs', h('table', {}, h('tbody', {},
      line('deliveries', runs.map(run => listed(run.deliveries) + (run.errors ? `; ${run.errors} ended in an error` : ''))),
      keys.map(key => line(key, runs.map(run => String(run[key] ?? '–')))),
      line('driven with', runs.map(run => listed(run.versions))),
      line('this page', runs.map(() => `navbench ${made.navbench}, Python ${made.python}, ${DATA.date}`))))),
    h('details', {}, h('summary', {}, `Prices (${prices.length}) and their sources`), scroller('Prices', h('table', {},
      h('thead', {}, h('tr', {}, ['price', 'value', 'unit', 'source'].map((name, k) => h('th', { scope: 'col', class: k === 1 ? 'n' : null }, name)))),
      h('tbody', {}, prices.map(price => h('tr', {}, h('th', { scope: 'row' }, price.key.replaceAll('_', ' ')),
        h('td', { class: 'n' }, sign(price.value.toLocaleString('en-US', { maximumSignificantDigits: 10 })), price.differs && ' *'),
        h('td', {}, price.unit), h('td', { class: 'wrap' }, price.source))))))),
    prices.some(price => price.differs) && h('p', { class: 'note loss' }, '* other runs of this page have another value.'),
    h('h3', {}, 'What they do not say'), h('ul', { class: 'limits' }, [...LIMITS, ...(DATA.basis.isForgiving ? [FORGIVING] : [])].map(text => h('li', {}, text))),
  ].flat().filter(Boolean);
}
