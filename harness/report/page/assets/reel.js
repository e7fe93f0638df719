// The dearest deliveries side by side: each plays around its dearest moment, again and again.
const [LEAD, TRAIL] = [8, 3];  // [s] before and after the dearest moment
const REEL_METRES = 16;  // that a view shows
const CALM = matchMedia('(prefers-reduced-motion: reduce)').matches;

function reel(open) {
  const numbers = [...DATA.replays.keys()].sort((a, b) => DATA.replays[a].earned - DATA.replays[b].earned).slice(0, DATA.reel);
  if (!numbers.length) return null;
  const views = numbers.map(number => reelView(number, open));
  const state = { playing: !CALM, last: 0 };
  const button = h('button', { type: 'button', on: { click: () => { state.playing = !state.playing; label(); } } });
  const label = () => { button.textContent = state.playing ? '❚❚ Pause' : '▶ Play'; };
  label();
  function step(now) {
    const passed = state.last ? Math.min(now - state.last, 250) / 1000 : 0;
    state.last = now;
    if (state.playing) views.forEach(view => view.advance(passed));
    requestAnimationFrame(step);
  }
  requestAnimationFrame(step);
  return h('div', { id: 'reel' }, h('div', { class: 'bar' }, h('h3', {}, reelTitle(numbers)), button),
    h('div', { class: 'cards' }, views.map(view => view.place)));
}

function reelTitle(numbers) {
  const lost = facts => !['sla', 'arrived'].includes(facts.outcome) || facts.contacts.some(([, , , , , cost, counted]) => counted && cost > 0);
  const several = numbers.length > 1, recorded = DATA.hasDearest ? '' : 'recorded ';
  const them = several ? `${numbers.length} ` : '', noun = several ? 'deliveries' : 'delivery';
  if (numbers.some(number => lost(DATA.replays[number]))) return `The ${them}dearest ${recorded}${noun}`;
  if (numbers.every(number => !isNumber(DATA.replays[number].money.contribution_margin))) return `Without cargo and without a loss: ${several ? numbers.length : 'one'} ${recorded}${noun}`;
  return `Nothing was lost: the ${them}${recorded}${noun} that earned least`;
}

function reelView(number, open) {
  const facts = DATA.replays[number], camera = new Camera();
  const canvas = h('canvas', { role: 'img', 'aria-label': `${nameOf(facts)} around its dearest moment` });
  const shown = Object.fromEntries(LAYERS.map(([key]) => [key, !['scan', 'tracks', 'options'].includes(key)]));
  const frame = h('div', { class: 'stage' }, canvas);
  const dearest = facts.reasons.reduce((found, each) => !found || each.cost > found.cost ? each : found, null);
  const place = h('div', { class: 'card' }, frame,
    h('p', {}, h('strong', {}, nameOf(facts)), ` ${outcomeName(facts.outcome)}, ${isNumber(facts.money.contribution_margin) ? usd(facts.money.contribution_margin) : 'no margin'}`),
    dearest && h('p', { class: 'note' }, dearest.words.split('. ')[0] + '.'),
    h('button', { type: 'button', on: { click: () => open(number, dearest ? Math.max(0, dearest.time - LEAD) : 0) } }, 'Whole delivery'));
  let recording = null, time = 0, range = [0, 0];
  recordingOf(number).then(found => {
    recording = found;
    const moment = dearest ? dearest.time : found.end;
    range = [Math.max(0, moment - LEAD), Math.min(found.end, moment + TRAIL)];
    time = CALM ? moment : range[0];
    place.dataset.ready = '1';
    draw();
  }, () => { frame.replaceChildren(h('p', { class: 'note' }, 'This replay cannot be shown.')); });
  new ResizeObserver(() => {
    const width = frame.clientWidth, ratio = Math.min(devicePixelRatio || 1, 2);
    if (!width) return;
    Object.assign(camera, { width, height: Math.round(width * .75), metres: REEL_METRES });
    Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(width * .75 * ratio), ratio });
    draw();
  }).observe(frame);
  function draw() {
    if (!recording || camera.width === 1) return;
    [camera.x, camera.y] = recording.pose(recording.driven, recording.row(time));
    drawReplay(canvas.getContext('2d'), canvas.ratio || 1, camera, recording, time, shown, null);
    place.dataset.time = time.toFixed(2);
  }
  const advance = passed => {
    if (!recording) return;
    time = time + passed > range[1] ? range[0] : time + passed;
    draw();
  };
  return { place, advance };
}
