// Maps on a canvas: a camera, and the ground, houses and furniture that it sees.
const FURNITURE = { mailbox: '#3a78c2', trash_bin: '#8a6446', bollard: '#d0571b', plant: '#4c9a5d', fence: '#a94fb3', hydrant: '#d83a3a',
  lamp: '#c99b1e', traffic_light: '#68707c', newspaper_box: '#17a192', bus_stop: '#5f7de0', barrier: '#ee9a41' };
const GROUND = { road: '--road', sidewalk: '--sidewalk', crosswalk: '--crosswalk', plaza: '--plaza', lawn: '--lawn',
  construction: '--site', work_area: '--site' };

class Camera {
  constructor() { Object.assign(this, { x: 0, y: 0, metres: 30, width: 1, height: 1 }); }  // metres: that the width shows
  get scale() { return this.width / this.metres; }
  at(x, y) { return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale]; }
  back(px, py) { return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale]; }
  show([x0, y0, x1, y1], margin = 1.05) {
    this.x = (x0 + x1) / 2;
    this.y = (y0 + y1) / 2;
    this.metres = margin * Math.max(x1 - x0, (y1 - y0) * this.width / this.height, 4);
  }
  zoom(factor, most) { this.metres = Math.min(most, Math.max(4, this.metres * factor)); }
  sees([x0, y0, x1, y1]) {
    const half = this.metres / 2, up = half * this.height / this.width;
    return x1 > this.x - half && x0 < this.x + half && y1 > this.y - up && y0 < this.y + up;
  }
  world(context, ratio) {
    const k = this.scale * ratio;
    context.setTransform(k, 0, 0, -k, ratio * this.width / 2 - k * this.x, ratio * this.height / 2 + k * this.y);
  }
  screen(context, ratio) { context.setTransform(ratio, 0, 0, ratio, 0, 0); }
}

const prepared = new Map();
function prepare(name) {
  if (prepared.has(name) || !DATA.scenery[name]) return prepared.get(name) || null;
  const scenery = DATA.scenery[name];
  const shape = ([kind, flat]) => {
    const path = new Path2D(), box = [Infinity, Infinity, -Infinity, -Infinity];
    for (let k = 0; k < flat.length; k += 2) {
      const x = flat[k] / 100, y = flat[k + 1] / 100;
      if (k) path.lineTo(x, y); else path.moveTo(x, y);
      box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y); box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y);
    }
    path.closePath();
    return { kind, path, box };
  };
  const ready = { zones: scenery.zones.map(shape), obstacles: scenery.obstacles.map(shape), picture: null };
  if (scenery.picture) {
    const image = new Image();
    image.onload = () => { ready.picture = { image, bounds: scenery.picture.bounds }; listeners.forEach(act => act()); };
    image.src = `data:image/png;base64,${scenery.picture.png}`;
  }
  prepared.set(name, ready);
  return ready;
}

let palette = null;
onTheme(() => { palette = null; });
function colours() {
  if (palette) return palette;
  palette = {};
  for (const name of ['--ground', '--building', '--building-edge', '--other', '--ink', '--paper', '--card', '--soft', '--faint', '--scan', '--plan',
    '--person', '--track', '--belief', '--option', '--robot', '--rival', '--loss', '--accent', '--line', ...Object.values(GROUND),
    ...Array.from({ length: TINTS }, (_, k) => `--s${k}`)]) palette[name] = css(name);
  return palette;
}

function drawScenery(context, scenery, camera, ratio) {
  const colour = colours();
  camera.screen(context, ratio);
  context.fillStyle = colour['--ground'];
  context.fillRect(0, 0, camera.width, camera.height);
  if (!scenery) return;
  camera.world(context, ratio);
  if (scenery.picture) {
    const [x0, y0, x1, y1] = scenery.picture.bounds;
    context.save();
    context.translate(x0, y1);
    context.scale(1, -1);
    context.imageSmoothingEnabled = false;
    context.globalAlpha = document.documentElement.dataset.theme === 'dark' ? .25 : 1;
    context.drawImage(scenery.picture.image, 0, 0, x1 - x0, y1 - y0);
    context.restore();
  }
  for (const zone of scenery.zones) {
    if (!camera.sees(zone.box)) continue;
    context.fillStyle = colour[GROUND[zone.kind]] || colour['--ground'];
    context.fill(zone.path);
  }
  context.lineWidth = 1 / camera.scale;
  for (const each of scenery.obstacles) {
    if (!camera.sees(each.box)) continue;
    const building = each.kind.startsWith('building') || each.kind === 'unknown';
    context.fillStyle = building ? colour['--building'] : FURNITURE[each.kind] || colour['--other'];
    context.fill(each.path);
    context.strokeStyle = building ? colour['--building-edge'] : context.fillStyle;
    context.stroke(each.path);
  }
}

function drawScaleBar(context, camera, ratio) {
  const length = [100, 50, 20, 10, 5, 2, 1].find(each => each <= camera.metres * .25) || 1, colour = colours();
  camera.screen(context, ratio);
  const x = 14, y = camera.height - 14, wide = length * camera.scale;
  context.strokeStyle = colour['--ink'];
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(x, y - 4); context.lineTo(x, y); context.lineTo(x + wide, y); context.lineTo(x + wide, y - 4);
  context.stroke();
  context.fillStyle = colour['--ink'];
  context.font = '12px system-ui, sans-serif';
  context.fillText(`${length} m`, x + wide + 7, y + 1);
}

// A canvas that is as sharp as the screen, with buttons and gestures for its camera.
function stage(label, aspect, camera, redraw, reset, moved, measured = reset) {  // measured: once its size is known
  const canvas = h('canvas', { role: 'img', 'aria-label': label, tabindex: 0 });
  const buttons = [['+', 'Zoom in', () => camera.zoom(.7, 2000)], ['−', 'Zoom out', () => camera.zoom(1.4, 2000)], ['⤢', 'Show all', reset]];
  const place = h('div', { class: 'stage' }, canvas, h('div', { class: 'zoom' }, buttons.map(([text, name, act]) =>
    h('button', { type: 'button', 'aria-label': name, on: { click: () => { act(); redraw(); } } }, text))));
  const fit = () => {
    const width = place.clientWidth, ratio = Math.min(devicePixelRatio || 1, 2);
    if (!width) return;
    const height = Math.round(Math.min(width * aspect(width), innerHeight * .82));
    const first = camera.width === 1;
    camera.width = width; camera.height = height;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    canvas.ratio = ratio;
    if (first) measured();
    redraw();
  };
  new ResizeObserver(fit).observe(place);
  let held = null, dragged = false;
  canvas.addEventListener('pointerdown', event => {
    held = [event.clientX, event.clientY, camera.x, camera.y];
    dragged = false;
  });
  addEventListener('pointerup', () => { held = null; });
  canvas.addEventListener('pointermove', event => {
    if (!held || event.buttons === 0) return;
    dragged ||= Math.hypot(event.clientX - held[0], event.clientY - held[1]) > 4;
    if (!dragged) return;
    camera.x = held[2] - (event.clientX - held[0]) / camera.scale;
    camera.y = held[3] + (event.clientY - held[1]) / camera.scale;
    moved();
    redraw();
  });
  canvas.addEventListener('wheel', event => {
    if (!event.ctrlKey && !event.metaKey && document.activeElement !== canvas) return;  // the page scrolls
    event.preventDefault();
    camera.zoom(1.0015 ** event.deltaY, 2000);
    redraw();
  }, { passive: false });
  canvas.addEventListener('keydown', event => {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }, step = event.shiftKey && steps[event.key];
    const zooms = { '+': .7, '=': .7, '-': 1.4, _: 1.4 };
    if (event.ctrlKey || event.metaKey || event.altKey || (!step && !zooms[event.key])) return;
    event.preventDefault();
    if (step) {
      camera.x += step[0] * camera.metres / 8;
      camera.y += step[1] * camera.metres / 8;
      moved();
    } else camera.zoom(zooms[event.key], 2000);
    redraw();
  });
  onTheme(redraw);
  return { place, canvas, wasDragged: () => dragged, context: canvas.getContext('2d') };
}
