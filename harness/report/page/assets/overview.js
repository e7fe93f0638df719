// The map with everything: ways, missions and contacts of all deliveries.
function overview(open) {
  const names = Object.keys(DATA.scenery), all = [...new Set(DATA.missions.map(each => each[2]))];
  const state = { map: names[0] || all[0], ways: true, ends: DATA.trajectories.length === 0, contacts: true, soft: false, entries: new Set(DATA.entries.keys()) };
  const camera = new Camera(), mapOf = new Map(DATA.missions.map(each => [`${each[0]}/${each[1]}`, each[2]]));
  const here = (entry, episode) => state.entries.has(entry) && mapOf.get(`${entry}/${episode}`) === state.map;
  const ways = DATA.trajectories.map(([entry, episode, steps]) => {
    const points = [];
    for (let k = 0, x = 0, y = 0; k < steps.length; k += 2) points.push([(x += steps[k]) / 100, (y += steps[k + 1]) / 100]);
    return { entry, episode, points };
  });
  const extent = () => {
    const scenery = DATA.scenery[state.map];
    if (scenery) return scenery.bounds;
    const points = DATA.missions.filter(each => each[2] === state.map).flatMap(each => [[each[3], each[4]], [each[5], each[6]]]).filter(([x]) => isNumber(x));
    if (!points.length) return [0, 0, 10, 10];
    return around(points);
  };
  const { place, canvas, context, wasDragged } = stage(
    `Map with ${ways.length} recorded ways and ${DATA.contacts.length} contacts of ${DATA.deliveries.entry.length} deliveries`,
    width => width < 640 ? 1 : .66, camera, () => draw(), () => camera.show(extent(), 1.02), () => {});

  function draw() {
    const ratio = canvas.ratio || 1, colour = colours();
    drawScenery(context, prepare(state.map), camera, ratio);
    camera.screen(context, ratio);
    context.lineJoin = 'round';
    if (state.ways) for (const way of ways) {
      if (!here(way.entry, way.episode)) continue;
      context.beginPath();
      way.points.forEach(([x, y]) => context.lineTo(...camera.at(x, y)));
      context.strokeStyle = colour[`--s${way.entry % TINTS}`];
      context.globalAlpha = .8;
      context.lineWidth = 2;
      context.stroke();
    }
    context.globalAlpha = 1;
    if (state.ends) for (const [entry, episode, , x0, y0, x1, y1] of DATA.missions) {
      if (!here(entry, episode) || !isNumber(x0)) continue;
      context.fillStyle = colour['--soft'];
      dot(...camera.at(x0, y0), 2);
      context.fillStyle = colour[`--s${entry % TINTS}`];
      dot(...camera.at(x1, y1), 3);
    }
    if (state.contacts) for (const [entry, episode, x, y, , what, , cost, counted] of DATA.contacts) {
      if (here(entry, episode) && (counted || state.soft)) drawContact(context, camera.at(x, y), isGrave(what, cost, counted));
    }
    drawScaleBar(context, camera, ratio);
  }
  function dot(x, y, radius) {
    context.beginPath();
    context.arc(x, y, radius, 0, 7);
    context.fill();
  }
  function pointed(event) {
    const box = canvas.getBoundingClientRect(), px = event.clientX - box.left, py = event.clientY - box.top;
    const far = (x, y) => { const [a, b] = camera.at(x, y); return Math.hypot(a - px, b - py); };
    const near = DATA.contacts.find(([entry, episode, x, y, , , , , counted]) =>
      state.contacts && here(entry, episode) && (counted || state.soft) && far(x, y) < 9);
    if (near) return { entry: near[0], episode: near[1], time: near[4], text: `${DATA.entries[near[0]].label}, episode ${near[1]}\n`
      + `${near[5].replaceAll('_', ' ')} at ${num(near[4], 1)} s: ${num(near[6])} N s, ${isGrave(near[5], near[7], near[8]) ? usd(near[7]) : 'no cost'}` };
    const way = ways.find(each => state.ways && here(each.entry, each.episode) && each.points.some(([x, y], k) => {
      const next = each.points[k + 1];
      return next && distance([px, py], camera.at(x, y), camera.at(...next)) < 5;
    }));
    return way ? { entry: way.entry, episode: way.episode, time: 0, text: `${DATA.entries[way.entry].label}, episode ${way.episode}` } : null;
  }
  for (const kind of ['pointermove', 'pointerdown']) canvas.addEventListener(kind, event => {
    const found = kind === 'pointermove' && event.buttons ? null : pointed(event);
    const replay = found ? replayNumber(found.entry, found.episode) : -1;
    canvas.style.cursor = replay >= 0 ? 'pointer' : 'grab';
    showTip(found ? found.text + (replay >= 0 ? '\nclick for the replay' : '') : '', event.clientX, event.clientY);
  });
  canvas.addEventListener('pointerleave', event => { if (event.pointerType === 'mouse') showTip(''); });
  canvas.addEventListener('click', event => {
    if (wasDragged()) return;
    const found = pointed(event), replay = found ? replayNumber(found.entry, found.episode) : -1;
    if (replay >= 0) open(replay, Math.max(0, found.time - 3));
  });
  const set = key => value => { state[key] = value; draw(); };
  const chooser = h('select', { id: 'which-map', on: { change: () => { state.map = chooser.value; camera.show(extent(), 1.02); draw(); } } },
    all.map(name => option(name, name)));
  chooser.value = state.map;
  const counted = DATA.contacts.filter(each => each[8]).length;
  return [h('div', { class: 'bar' },
    all.length > 1 && h('label', { for: 'which-map' }, 'map', chooser),
    DATA.entries.map((each, k) => check(each.label, true, on => { if (on) state.entries.add(k); else state.entries.delete(k); draw(); }, tint(k))),
    h('span', { class: 'grow' }),
    check(`ways (${ways.length} recorded)`, state.ways, set('ways')), check('starts and goals', state.ends, set('ends')),
    check(`counted contacts (${counted})`, true, set('contacts'), 'var(--loss)'),
    check(`contacts not counted (${DATA.contacts.length - counted})`, false, set('soft'))), place];
}

function distance([px, py], [ax, ay], [bx, by]) {
  const dx = bx - ax, dy = by - ay, t = Math.max(0, Math.min(1, ((px - ax) * dx + (py - ay) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(px - ax - t * dx, py - ay - t * dy);
}
// A counted contact that is paid for, or with a person: the hardest have no price.
const isGrave = (what, cost, counted) => Boolean(counted) && (cost > 0 || what === PERSON);
function drawContact(context, [x, y], grave) {
  const colour = colours(), size = grave ? 5 : 3.5;
  for (const [stroke, width] of [[colour['--card'], 5], [grave ? colour['--loss'] : colour['--soft'], 2.4]]) {
    context.strokeStyle = stroke;
    context.lineWidth = width;
    context.beginPath();
    context.moveTo(x - size, y - size); context.lineTo(x + size, y + size);
    context.moveTo(x - size, y + size); context.lineTo(x + size, y - size);
    context.stroke();
  }
}
