// Puts the page together.
function masthead() {
  if (DATA.kind === 'study') return h('div', { class: 'masthead' }, h('div', {}, h('p', { class: 'kicker' }, 'navbench study'),
    h('h1', {}, DATA.title), h('p', { class: 'sub' }, DATA.date)), themeButton());
  const { basis, entries } = DATA, total = DATA.deliveries ? DATA.deliveries.entry.length : null;
  const each = key => [...new Set(basis.runs.map(run => run[key]))].join(', ');
  const where = [total !== null && `${num(total)} deliveries`, ...['map', 'seed', 'people'].map(key => `${key} ${each(key)}`), DATA.date];
  return h('div', { class: 'masthead' }, h('div', {},
    h('p', { class: 'kicker' }, DATA.kind === 'report' ? 'navbench report' : 'navbench replay'),
    h('h1', {}, DATA.kind === 'report' ? (entries.length > 1 ? `What ${entries.length} stacks earn` : `What ${DATA.title} earns`) : DATA.title),
    h('p', { class: 'sub' }, where.filter(Boolean).join(' · '))), themeButton());
}

function whatPairsShare() {
  if (!DATA.comparisons.length) return null;
  const missions = 'Differences are taken mission by mission: both stacks had the same ones';
  return DATA.comparisons.some(each => each.warnings.length) ? `${missions}. What else differed stands above each table.`
    : `${missions}, with the same people and the same noise.`;
}

function reportSections() {
  const instance = player(), replay = replaySection(instance), open = replay.open;
  const sections = [
    section('headline', 'What a delivery earns', 'Contribution margin: fee earned less refunds, injuries, damage, repair and electricity. Beside it a published stack: ' + DATA.headline.paper.label + '.', headlineCards(reel(open))),
    section('waterfall', 'From revenue to margin', 'US dollars per delivery, means; the whisker is the 95 % interval of the margin.', waterfallPanels()),
    h('div', { class: 'two' },
      section('outcomes', 'How deliveries end', 'Share of deliveries; Wilson’s intervals stand in the table below.', outcomeBars()),
      section('profit', 'Profit over deliveries', 'As driven, in order; the band holds 95 % of the sums over resampled missions.', profitCurves())),
    section('breakeven', 'When the robot has paid for itself', 'Capital expenditure over the mean margin, over 10 000 resamples of the missions. The dot is the point estimate.', breakEvenRidges()),
    DATA.accountings && section('liability', 'Who pays for contacts', 'Margin per delivery with its 95 % interval, the same deliveries and outcomes, if the robot paid for other contacts.', accountingTable()),
    section('comparison', 'Stacks compared', whatPairsShare(), comparisonTables()),
    section('tables', 'The paper’s two tables', 'Means per delivery with 95 % intervals, beside what the paper published.', paperTables()),
    section('map', 'Where it happened', 'Ways of recorded deliveries and contacts of all. Drag (or shift + arrows) to move, ctrl + wheel, + and − to zoom; a click opens the replay.', overview(open)),
    DATA.replays.length > 0 && section('replay', 'Replay', 'Space plays, ← → move by a second, N jumps to the next event that cost something, shift + arrows move the map.', replay.content),
    section('deliveries', 'Deliveries', 'Sorted by profit: the worst first. ▶ opens the replay.', deliveryList(open)),
    section('basis', 'What these figures rest on', null, basisContent()),
  ].filter(Boolean);
  for (const id of ['tables', 'deliveries', 'basis']) sections.find(each => each.id === id).classList.add('long');
  const links = [['headline', 'Margin'], ['waterfall', 'Costs'], ['outcomes', 'Outcomes'], ['profit', 'Profit'], ['breakeven', 'Break-even'], ['liability', 'Who pays'], ['comparison', 'Comparison'],
    ['tables', 'Tables'], ['map', 'Map'], ['replay', 'Replay'], ['deliveries', 'Deliveries'], ['basis', 'Basis']];
  const nav = h('nav', { 'aria-label': 'Sections' }, h('ul', {}, links.filter(([id]) => sections.some(each => each.id === id || each.querySelector(`#${id}`)))
    .map(([id, text]) => h('li', {}, h('a', { href: `#${id}` }, text)))));
  return { sections, nav, instance };
}

function boot() {
  $('top').append(masthead());
  const main = $('content');
  let instance;
  if (DATA.kind !== 'replay') {
    const made = DATA.kind === 'report' ? reportSections() : studySections();
    instance = made.instance;
    main.append(made.nav, ...made.sections);
  } else {
    instance = player();
    main.append(section('replay', 'Replay', 'Space plays, ← → move by a second, N jumps to the next event that cost something, shift + arrows move the map.', instance.place),
      section('basis', 'What this rests on', null, basisContent()));
  }
  $('foot').append(h('p', {}, `Made with navbench ${DATA.made ?? DATA.basis.made.navbench}. This page is complete in itself: it asks no server for anything.`));
  const loss = each => each.money.contribution_margin ?? Infinity;
  const worst = DATA.replays.reduce((found, each, k) => loss(each) < loss(DATA.replays[found]) ? k : found, 0);
  if (DATA.replays.length) instance.open(worst);
  if ($('which')) $('which').value = String(worst);
  document.documentElement.dataset.ready = Math.round(performance.now());  // [ms] since the page was asked for
}
boot();
