// One instant of a replay, drawn on a canvas.
const LAYERS = [  // key, label, colour
  ['scan', 'scan', '--scan'], ['plan', 'plan', '--plan'], ['people', 'people', '--person'], ['tracks', 'tracks', '--track'],
  ['belief', 'belief', '--belief'], ['way', 'way driven', '--robot'], ['options', 'motions weighed [USD more]', '--option'], ['contacts', 'contacts', '--loss'],
];
const PULSE = 1.2;  // [s] that a contact is marked after its moment

function drawReplay(context, ratio, camera, recording, time, shown, rival) {
  const facts = recording.facts, colour = colours(), row = recording.row(time), pose = recording.pose(recording.driven, row);
  const line = points => { context.beginPath(); points.forEach(([x, y]) => context.lineTo(...camera.at(x, y))); };
  const circle = ([x, y], radius) => { context.beginPath(); context.arc(...camera.at(x, y), radius, 0, 2 * Math.PI); };
  drawScenery(context, prepare(facts.map), camera, ratio);
  camera.screen(context, ratio);
  context.lineJoin = 'round';
  context.lineCap = 'round';
  drawEnds(context, camera, facts, colour);
  const there = rival && rival.pose(rival.driven, rival.row(time));
  if (shown.way) {
    if (rival) {
      line(rival.wayUntil(time).concat([there]));
      stroke(context, colour['--rival'], 3, .45);
    }
    line(recording.wayUntil(time).concat([pose]));
    stroke(context, colour['--robot'], 3, .45);
  }
  if (shown.plan) {
    line(recording.planAt(time));
    stroke(context, colour['--plan'], 2.2, .95, [7, 5]);
  }
  if (shown.scan) {
    context.fillStyle = colour['--scan'];
    const size = Math.max(1.6, Math.min(3.2, camera.scale * .07));
    for (const [x, y] of recording.scanAt(time)) {
      const [px, py] = camera.at(x, y);
      context.fillRect(px - size / 2, py - size / 2, size, size);
    }
  }
  if (shown.people) for (const person of recording.people(row)) {
    circle(person, Math.max(facts.personRadius * camera.scale, 2.5));
    context.fillStyle = colour['--person'];
    context.fill();
    stroke(context, colour['--card'], 1, .9);
  }
  if (shown.tracks) for (const [, x, y, vx, vy] of recording.tracksAt(row)) {
    circle([x, y], Math.max((facts.personRadius + .12) * camera.scale, 5));
    stroke(context, colour['--track'], 2, 1);
    line([[x, y], [x + vx, y + vy]]);
    stroke(context, colour['--track'], 2, 1);
  }
  if (rival) drawRobot(context, camera, rival.facts, there, colour['--rival'], colour['--card']);
  drawRobot(context, camera, facts, pose, colour['--robot'], colour['--card']);
  if (shown.options) drawOptions(context, camera, recording.optionsAt(row), colour);
  if (shown.belief && recording.belief) drawBelief(context, camera, recording, row, colour);
  if (shown.contacts) for (const [x, y, stamp, what, , cost, counted] of facts.contacts) {
    if (stamp > time + 1e-6) continue;
    drawContact(context, camera.at(x, y), isGrave(what, cost, counted));
    const age = (time - stamp) / PULSE;
    if (age < 1) { circle([x, y], 8 + 26 * age); stroke(context, colour['--loss'], 3, 1 - age); }
  }
  drawScaleBar(context, camera, ratio);
}
function stroke(context, colour, width, alpha, dash = []) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.globalAlpha = alpha;
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
}
function drawOptions(context, camera, options, colour) {  // the chosen one is whole, what others cost more stands at their ends
  options.forEach(({ total, way }, k) => {
    context.beginPath();
    way.forEach(([x, y]) => context.lineTo(...camera.at(x, y)));
    stroke(context, colour['--option'], k ? 1.5 : 4, k ? .8 : .9, k ? [2, 4] : []);
    if (!k) return;
    const [x, y] = camera.at(...way.at(-1)), more = total - options[0].total;
    write(context, `${more < 0 ? '−' : '+'}${num(Math.abs(more), 2)}`, x + 4, y - 4, colour['--option'], colour['--card']);
  });
}
function write(context, text, x, y, ink, card) {
  context.font = '600 12px system-ui, sans-serif';
  context.lineWidth = 3;
  context.strokeStyle = card;
  context.strokeText(text, x, y);
  context.fillStyle = ink;
  context.fillText(text, x, y);
}
function outline(camera, corners, [x, y, yaw]) {
  const c = Math.cos(yaw), n = Math.sin(yaw);
  return corners.map(([a, b]) => camera.at(x + c * a - n * b, y + n * a + c * b));
}
function polygon(context, points) {
  context.beginPath();
  points.forEach(([x, y]) => context.lineTo(x, y));
  context.closePath();
}
function drawRobot(context, camera, facts, pose, fill, edge) {
  const corners = outline(camera, facts.footprint, pose);
  if (camera.scale < 9) {  // too small to see: a dot stands for it
    context.beginPath();
    context.arc(...camera.at(pose[0], pose[1]), 5, 0, 7);
  } else polygon(context, corners);
  context.fillStyle = fill;
  context.fill();
  stroke(context, edge, 1.5, 1);
  if (camera.scale < 9) return;
  const front = Math.max(...facts.footprint.map(each => each[0]));
  const nose = outline(camera, [[front - .3, .13], [front - .07, 0], [front - .3, -.13]], pose);
  context.beginPath();
  nose.forEach(([x, y]) => context.lineTo(x, y));
  stroke(context, edge, 2.2, 1);
}
function drawBelief(context, camera, recording, row, colour) {
  const believed = recording.believed(row);
  if (!believed) return;
  polygon(context, outline(camera, recording.facts.footprint, believed));
  stroke(context, colour['--belief'], 2, 1, [4, 3]);
  const [xx, xy, yy] = recording.covariance.map(column => column[row[0]]);
  const middle = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
  const long = 2 * Math.sqrt(Math.max(middle + half, 0)), wide = 2 * Math.sqrt(Math.max(middle - half, 0));
  if (long * camera.scale < 3) return;
  const [px, py] = camera.at(believed[0], believed[1]);
  context.beginPath();
  context.ellipse(px, py, long * camera.scale, wide * camera.scale, -.5 * Math.atan2(2 * xy, xx - yy), 0, 7);
  stroke(context, colour['--belief'], 1.5, .8);
}
function drawEnds(context, camera, facts, colour) {
  for (const [place, text] of [[facts.start, 'start'], [facts.goal, 'goal']]) {
    if (!isNumber(place[0])) continue;
    const [x, y] = camera.at(...place);
    context.beginPath();
    context.arc(x, y, 6, 0, 7);
    context.fillStyle = text === 'goal' ? colour['--ink'] : colour['--card'];
    context.fill();
    stroke(context, colour['--ink'], 2, 1);
    write(context, text, x + 10, y + 4, colour['--ink'], colour['--card']);
  }
}
