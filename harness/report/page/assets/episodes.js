// The list of deliveries: filters by stack, outcome and cost, sorting by every column.
const PAGE = 60;  // rows shown at once
const LISTED = [  // key, title, how it is written, whether it is a number
  ['entry', 'stack', value => DATA.entries[value].label], ['episode', 'episode', value => num(value), true],
  ['profit', 'profit $', value => num(value, 2), true],
  ['cost', 'cost $', value => num(value, 2), true], ['outcome', 'outcome', value => BRIEF[value] || outcomeName(value)],
  ['injury', 'injury $', value => num(value, 2), true],
  ['people', 'people hit', value => num(value), true], ['property', 'things hit', value => num(value), true], ['soft', 'soft', value => num(value), true],
  ['lost', 'pieces lost', value => num(value), true], ['duration', 'time s', value => num(value, 1), true],
  ['distance', 'distance m', value => num(value, 1), true], ['nearest', 'nearest m', value => num(value, 2), true],
  ['localization', 'loc. error m', value => num(value, 2), true], ['recoveries', 'recov.', value => num(value), true],
];
const MEANT = { soft: 'contacts that the published rule does not count: too soft, or within its pause after another', nearest: 'least distance to a person [m]', injury: 'expected cost of injuries [USD]',
  localization: 'error of the believed position, 95th percentile [m]', recoveries: 'recoveries begun', profit: 'fee earned less all costs [USD]',
  cost: 'refunds, injuries, damage, repair and electricity [USD]', people: 'counted contacts with people', property: 'paid contacts with furniture and buildings', lost: 'pieces of cargo outside the bucket' };
const PLAIN = ['arrived', 'timeout', 'cargo lost', 'cargo not modelled'];  // reasons that say no more than their outcome
const COSTS = {
  all: ['any cost', () => true],
  person: ['contact with a person', row => row.people > 0],
  loss: ['lost money', row => isNumber(row.profit) && row.profit < 0],
  cost: ['cost more than $1', row => row.cost > 1],
  contact: ['touched something', row => row.touched],
  recorded: ['has a replay', row => replayNumber(row.entry, row.episode) >= 0],
};

function replayNumber(entry, episode) {
  return DATA.replays.findIndex(each => each.entry === entry && each.episode === episode);
}

function deliveryList(open) {
  const columns = DATA.deliveries;
  const rows = columns.entry.map((_, k) => Object.fromEntries(Object.keys(columns).map(key => [key, columns[key][k]])));
  const state = { stack: '', outcome: '', cost: 'all', sort: 'profit', rising: true, shown: PAGE };
  const found = [...new Set(columns.outcome)];
  const body = h('tbody'), count = h('span', { class: 'sub grow', role: 'status', id: 'list-count' });
  const printed = h('span', { class: 'printonly' });
  const more = h('button', { type: 'button', on: { click: () => { state.shown += 5 * PAGE; draw(); } } });
  const choose = (id, label, key, options) => h('label', { for: id }, label, h('select', { id, on: { change: event => {
    state[key] = event.target.value;
    state.shown = PAGE;
    draw();
  } } }, options.map(([value, text]) => option(value, text))));
  const heads = LISTED.map(([key, title, , isNumeric]) => h('th', { scope: 'col', class: isNumeric ? 'n' : null, 'data-key': key, 'data-tip': MEANT[key] },
    h('button', { type: 'button', 'aria-description': MEANT[key], on: { click: () => {
      state.rising = state.sort === key ? !state.rising : true;
      state.sort = key;
      draw();
    } } }, title)));

  function draw() {
    const kept = rows.filter(row => (state.stack === '' || row.entry === Number(state.stack))
      && (state.outcome === '' || row.outcome === state.outcome) && COSTS[state.cost][1](row));
    const key = state.sort, way = state.rising ? 1 : -1;
    kept.sort((a, b) => (a[key] === null) - (b[key] === null) || way * (a[key] < b[key] ? -1 : a[key] > b[key] ? 1 : 0) || a.episode - b.episode);
    for (const head of heads) {
      if (head.dataset.key === key) head.setAttribute('aria-sort', state.rising ? 'ascending' : 'descending');
      else head.removeAttribute('aria-sort');
    }
    count.textContent = `${num(kept.length)} of ${num(rows.length)} deliveries`;
    printed.textContent = [...[['by-stack', state.stack], ['by-outcome', state.outcome]].filter(([, value]) => value !== '').map(([id]) => $(id).selectedOptions[0].textContent),
      ...(state.cost === 'all' ? [] : [COSTS[state.cost][0]]), kept.length > state.shown && `the first ${num(state.shown)} of them follow`].filter(Boolean).join('; ');
    body.replaceChildren(...kept.slice(0, state.shown).map(line));
    more.hidden = kept.length <= state.shown;
    more.textContent = `Show more (${num(kept.length - state.shown)} left)`;
  }
  function line(row) {
    const replay = replayNumber(row.entry, row.episode);
    return h('tr', {}, h('td', {}, replay >= 0 ? h('button', { type: 'button', 'data-replay': replay,
      'aria-label': `Replay ${DATA.entries[row.entry].label} episode ${row.episode}`, on: { click: () => open(replay) } }, '▶') : ''),
    LISTED.map(([key, , write, isNumeric]) => h('td', { class: isNumeric ? (key === 'profit' && row[key] < 0 ? 'n loss' : 'n') : null },
      key === 'entry' && h('span', { class: 'dot', tint: tint(row.entry) }), write(row[key]),
      key === 'outcome' && row.reason && !PLAIN.includes(row.reason) && h('span', { class: 'span' }, row.reason))));
  }
  draw();
  return [
    h('div', { class: 'bar' },
      choose('by-stack', 'stack', 'stack', [['', 'all'], ...DATA.entries.map((each, k) => [k, each.label])]),
      choose('by-outcome', 'outcome', 'outcome', [['', 'all'], ...found.map(key => [key, outcomeName(key)])]),
      choose('by-cost', 'cost', 'cost', Object.entries(COSTS).map(([key, [text]]) => [key, text])), count, printed),
    scroller('Deliveries', h('table', { id: 'deliveries-table' },
      h('thead', {}, h('tr', {}, h('th', { scope: 'col' }, h('span', { class: 'skip' }, 'replay')), heads)), body)),
    h('div', { class: 'bar' }, more)];
}
