// The player: play, scrub, speed, and the jump to the next event that cost something.
const SPEEDS = [.25, .5, 1, 2, 4, 8, 16];
const NEAR = 20;  // [m] that the view shows at first
const BEFORE_EVENT = 2;  // [s] before an event to which a jump leads

const nameOf = facts => `${DATA.entries[facts.entry].label}, episode ${facts.episode}`;
const recordingOf = async number => new Recording(DATA.replays[number], await decodeRecording($(`recording-${number}`).textContent));
const rivalsOf = number => {  // recorded deliveries of the same mission
  const key = each => JSON.stringify([each.map, each.start, each.goal]), own = key(DATA.replays[number]);
  return DATA.replays.flatMap((each, k) => k !== number && key(each) === own ? [k] : []);
};

function player() {
  const place = h('div', { id: 'player', tabindex: -1 }), camera = new Camera();
  const shown = Object.fromEntries(LAYERS.map(([key]) => [key, true]));
  const state = { recording: null, rival: null, time: 0, speed: 1, playing: false, follow: true, number: -1, asked: 0, frames: 0 };
  const view = stage('Replay', width => width < 640 ? 1.05 : .62, camera, draw, reset, release,
    () => { if (!state.follow) reset(); });  // all was asked for before its size was known
  let last = 0, parts = null, strip = null, reasons = null;

  async function open(number, time = 0) {
    const asked = state.asked += 1;
    pause();
    place.setAttribute('aria-busy', 'true');
    try {
      if (number !== state.number || !state.recording) {
        const recording = await recordingOf(number);
        if (asked !== state.asked) return;  // another one was chosen meanwhile
        Object.assign(state, { recording, rival: null, number });
        build();
      }
      seek(time);
    } catch (error) {
      if (asked !== state.asked) return;
      state.number = -1;
      place.replaceChildren(h('p', { class: 'note loss', role: 'alert' }, `This replay cannot be shown. ${error.message}`));
    }
    place.removeAttribute('aria-busy');
    place.dataset.ready = number;
  }
  async function accompany(choice) {  // by another delivery of the same mission; empty: by none
    const asked = state.asked, rival = choice === '' ? null : await recordingOf(Number(choice));
    if (asked !== state.asked) return;
    state.rival = rival;
    place.dataset.rival = choice;
    plot();
    draw();
  }
  function plot() {
    strip = replayStrip([state.recording, state.rival].filter(Boolean), seek);
    parts.strip.replaceChildren(strip.place);
    parts.legend.replaceChildren(...(state.rival ? [state.recording, state.rival].map((each, k) =>
      h('span', {}, h('span', { class: 'key', tint: `var(${LINES[k]})` }), `${nameOf(each.facts)}: ${outcomeName(each.facts.outcome)}, ${usd(each.facts.money.contribution_margin)}`)) : []));
    strip.move(state.time);
  }
  function release() {
    state.follow = false;
    parts.follow.setAttribute('aria-pressed', 'false');
  }
  function reset() {
    if (!state.recording) return;
    release();
    const [xs, ys] = state.recording.driven;
    camera.show(around(Array.from(xs, (x, k) => [x, ys[k]])), 1.25);
  }
  function follow() {
    state.follow = true;
    parts.follow.setAttribute('aria-pressed', 'true');
    camera.metres = NEAR;
    draw();
  }
  function build() {
    const facts = state.recording.facts, name = nameOf(facts), rivals = rivalsOf(state.number);
    view.canvas.setAttribute('aria-label', `Replay of ${name}`);
    state.follow = true;
    camera.metres = NEAR;
    const button = (text, label, act, more) => h('button', { type: 'button', 'aria-label': label, ...more, on: { click: act } }, text);
    const stops = state.recording.stops.length;
    parts = {
      play: button('▶ Play', 'Play or pause (space)', toggle, { class: 'play' }),
      follow: button('Follow', 'Follow the robot', follow, { 'aria-pressed': 'true' }),
      next: button('Next cost →', 'Jump to the next event that cost something (N)', () => jump(1), { disabled: !stops }),
      previous: button('←', 'Jump to the event before that cost something (P)', () => jump(-1), { disabled: !stops }),
      speed: h('select', { 'aria-label': 'Speed', on: { change: event => { state.speed = Number(event.target.value); } } },
        SPEEDS.map(each => h('option', { value: each, selected: each === state.speed }, `${each} ×`))),
      clock: h('span', { class: 'clock' }),
      beside: rivals.length > 0 && h('div', { class: 'bar' }, h('label', {}, 'on the same mission', h('select', { id: 'beside', on: { change: event => accompany(event.target.value) } },
        option('', 'nobody'), rivals.map(k => option(k, nameOf(DATA.replays[k])))))),
      strip: h('div', {}), legend: h('div', { class: 'legend' }),
      seek: h('input', { type: 'range', class: 'seek', min: 0, max: state.recording.end, step: 'any', value: 0, 'aria-label': 'Time [s]',
        on: { input: event => seek(Number(event.target.value)) } }),
      facts: h('dl'), costs: h('ul', { class: 'costs' }),
    };
    plot();
    reasons = replayReasons(facts.reasons, seek);
    place.replaceChildren(
      h('div', { class: 'player' },
        h('div', {}, view.place, h('div', { class: 'transport' }, parts.play, parts.previous, parts.next, parts.speed, parts.follow, parts.clock),
          parts.seek, parts.beside, parts.legend, parts.strip,
          h('div', { class: 'layers' }, LAYERS.filter(([key]) => has(key)).map(([key, label, colour]) =>
            check(label, shown[key], on => { shown[key] = on; draw(); }, `var(${colour})`)))),
        h('div', { class: 'side' }, h('h3', {}, name), parts.facts, h('h3', {}, 'Costs'), parts.costs, reasons.place, navigatorHistory(facts.history))));
    listCosts();
  }
  const has = key => ({ scan: 'scan', plan: 'plan', tracks: 'tracks', belief: 'belief', options: 'options' }[key] === undefined
    || Boolean(['tracks', 'options'].includes(key) ? state.recording[key][0].length : state.recording[key]));
  function listCosts() {
    const money = state.recording.facts.money, lines = state.recording.events.map(event => h('li', { 'data-time': event.time },
      h('span', {}, `${num(event.time, 1)} s  ${event.name}`), h('span', {}, usd(event.cost))));
    if (isNumber(money.revenue)) lines.push(h('li', { 'data-time': state.recording.settled }, h('span', {}, 'fee earned'), h('span', {}, usd(money.revenue))));
    if (isNumber(money.contribution_margin)) lines.push(h('li', { 'data-time': state.recording.settled }, h('strong', {}, 'profit of this delivery'),
      h('strong', { class: money.contribution_margin < 0 ? 'loss' : null }, usd(money.contribution_margin))));
    parts.costs.replaceChildren(...lines);
  }
  function tell() {
    const { recording, time } = state, row = recording.row(time), facts = recording.facts;
    const pose = recording.pose(recording.driven, row), lines = [
      ['time', `${num(time, 1)} s`], ['speed', `${num(recording.motion[0][row[0]], 2)} m/s`],
      ['commanded', `${num(recording.motion[2][row[0]], 2)} m/s, ${num(recording.motion[3][row[0]], 2)} rad/s`]];
    const believed = recording.believed(row);
    if (recording.belief) lines.push(['belief error', believed ? `${num(Math.hypot(believed[0] - pose[0], believed[1] - pose[1]), 2)} m` : 'no belief']);
    const nearest = recording.crowd.length ? recording.nearest(row) : Infinity;
    lines.push(['nearest person', nearest < 1e3 ? `${num(nearest, 1)} m` : '–']);
    if (recording.tracks[0].length) lines.push(['tracks', num(recording.tracksAt(row).length)]);
    lines.push(['cargo lost', isNumber(facts.pieces) ? `${num(recording.lost[0][row[0]])} of ${num(facts.pieces)}` : 'not modelled']);
    lines.push(['energy', `${num(recording.energy[0][row[0]] / 3600, 1)} Wh`]);
    lines.push(['costs so far', usd(recording.costs(time))]);
    if (time >= recording.end - 1e-3) lines.push(['ended', outcomeName(facts.outcome)]);
    parts.facts.replaceChildren(...lines.map(([name, value]) => [h('dt', {}, name), h('dd', {}, value)]).flat());
    for (const line of parts.costs.children) line.className = Number(line.dataset.time) <= time + 1e-3 ? '' : 'later';
    parts.clock.textContent = `${num(time, 1)} / ${num(recording.end, 1)} s`;
    parts.seek.value = time;
    strip.move(time);
    reasons.move(time);
  }
  function draw() {
    if (!state.recording || camera.width === 1) return;
    if (state.follow) [camera.x, camera.y] = state.recording.pose(state.recording.driven, state.recording.row(state.time));
    drawReplay(view.context, view.canvas.ratio || 1, camera, state.recording, state.time, shown, state.rival);
  }
  function seek(time) {
    state.time = Math.max(0, Math.min(time, state.recording.end));
    place.dataset.time = state.time.toFixed(2);
    tell();
    draw();
  }
  function toggle() {
    if (!state.recording) return;
    if (!state.playing && state.time >= state.recording.end - .01) state.time = 0;
    if (state.playing) return pause();
    state.playing = true;
    parts.play.textContent = '❚❚ Pause';
    last = performance.now();
    requestAnimationFrame(step);
  }
  function pause() {
    state.playing = false;
    if (parts) parts.play.textContent = '▶ Play';
  }
  function step(now) {
    if (!state.playing) return;
    seek(state.time + Math.min(now - last, 250) / 1000 * state.speed);
    last = now;
    place.dataset.frames = state.frames += 1;
    if (state.time >= state.recording.end - 1e-6) pause(); else requestAnimationFrame(step);
  }
  function jump(way) {
    const stamps = state.recording.stops.map(each => Math.max(0, each - BEFORE_EVENT));
    const next = way > 0 ? stamps.find(each => each > state.time + .05) : stamps.findLast(each => each < state.time - .05);
    if (next !== undefined) seek(next);
  }
  place.addEventListener('keydown', event => {
    if (!state.recording || event.target.tagName === 'SELECT' || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    const pressed = ['BUTTON', 'SUMMARY'].includes(event.target.tagName) || event.target.type === 'checkbox';  // space is theirs
    const acts = { ' ': pressed ? null : toggle, n: () => jump(1), p: () => jump(-1),
      ArrowRight: () => seek(state.time + 1), ArrowLeft: () => seek(state.time - 1), Home: () => seek(0), End: () => seek(state.recording.end) };
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
  return { place, open };
}

function replaySection(instance) {
  const names = DATA.replays.map(each => `${nameOf(each)}: ${outcomeName(each.outcome)}`
    + (isNumber(each.money.contribution_margin) ? `, ${usd(each.money.contribution_margin)}` : ''));
  const pick = h('select', { id: 'which', on: { change: event => instance.open(Number(event.target.value)) } }, names.map((name, k) => option(k, name)));
  const open = (number, time) => {
    pick.value = String(number);
    $('replay').scrollIntoView();
    instance.place.focus({ preventScroll: true });  // its keys work at once
    return instance.open(number, time);
  };
  return { open, content: [DATA.replays.length > 1 && h('div', { class: 'bar' }, h('label', { for: 'which' }, 'delivery', pick)), instance.place] };
}
