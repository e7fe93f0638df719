// Elements, numbers, scales and the tooltip. Texts become text nodes only; nothing is ever parsed as HTML.
const SVG = 'http://www.w3.org/2000/svg';
const $ = id => document.getElementById(id);
const DATA = JSON.parse($('data').textContent);

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes || {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name === 'on') for (const [event, act] of Object.entries(value)) element.addEventListener(event, act);
    else if (name === 'tint') element.style.setProperty('--tint', value);
    else if (name === 'css') Object.assign(element.style, value);
    else element.setAttribute(name, value === true ? '' : value);
  }
  for (const child of children.flat(Infinity)) {
    if (child !== null && child !== undefined && child !== false) element.append(child);
  }
  return element;
}
const h = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
const s = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const TINTS = 12;  // colours of stacks
const tint = number => `var(--s${number % TINTS})`;

const PERSON = 'pedestrian';  // what a contact with a person is called

const isNumber = value => typeof value === 'number' && Number.isFinite(value);
const sign = text => text.replace(/-(?=[\d.])/g, '−');  // a minus, and no hyphen
function num(value, decimals = 0) {
  if (!isNumber(value)) return '–';
  const text = value.toLocaleString('en-US', { minimumFractionDigits: decimals, maximumFractionDigits: decimals });
  return sign(Number(text.replace(/,/g, '')) === 0 ? text.replace('-', '') : text);
}
function usd(value, decimals = 2) {
  if (!isNumber(value)) return '–';
  const text = num(Math.abs(value), decimals);
  return (value < 0 && Number(text.replace(/,/g, '')) !== 0 ? '−' : '') + '$' + text;
}
const percent = (value, decimals = 1) => isNumber(value) ? `${num(100 * value, decimals)} %` : '–';
const span = (interval, format) => isNumber(interval.lo) ? `${format(interval.lo)} to ${format(interval.hi)}` : '';
const short = value => {
  const size = Math.abs(value);
  if (size >= 1e6) return `${num(value / 1e6, size < 1e7 ? 1 : 0)} M`;
  return size >= 1e4 ? `${num(value / 1e3)} k` : num(value, size < 10 && value % 1 ? (size < 1 ? 2 : 1) : 0);
};

function tickStep(low, high, count) {
  const rough = (high - low) / Math.max(count, 1) || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map(each => each * power).find(each => each >= rough);
}
function ticks(low, high, count) {
  const step = tickStep(low, high, count), found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step || 0);
  return found;
}
// Least and largest x and y of points, as many as there may be.
const around = points => points.reduce(([left, low, right, high], [x, y]) =>
  [Math.min(left, x), Math.min(low, y), Math.max(right, x), Math.max(high, y)], [Infinity, Infinity, -Infinity, -Infinity]);
const linear = (low, high, from, to) => value => from + (value - low) / ((high - low) || 1) * (to - from);

// A figure that is drawn anew at every width.
function figure(label, draw) {
  const place = h('div', { class: 'figure' });
  let drawn = 0;
  new ResizeObserver(() => {
    const width = Math.floor(place.clientWidth);
    if (!width || width === drawn) return;
    drawn = width;
    const picture = draw(width);
    picture.setAttribute('viewBox', `0 0 ${picture.getAttribute('width')} ${picture.getAttribute('height')}`);  // paper may be narrower
    picture.setAttribute('role', 'img');
    picture.setAttribute('aria-label', label);
    place.replaceChildren(picture);
  }).observe(place);
  return place;
}

function section(id, title, lede, ...content) {
  const heading = `${id}-title`;
  return h('section', { id, 'aria-labelledby': heading },
    h('h2', { id: heading }, title), lede && h('p', { class: 'lede' }, lede), content);
}
const scroller = (label, table) => h('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, table);
const option = (value, text) => h('option', { value }, text);
function check(label, checked, act, colour) {
  const box = h('input', { type: 'checkbox', checked, on: { change: event => act(event.target.checked) } });
  return h('label', {}, box, colour && h('span', { class: 'key', tint: colour }), label);
}

// The tooltip shows the data-tip of whatever is pointed at, tapped or has the focus.
const tip = $('tip');
function showTip(text, x, y) {
  tip.textContent = text;
  tip.style.display = text ? 'block' : 'none';
  if (!text) return;
  const box = tip.getBoundingClientRect();
  tip.style.left = `${Math.max(6, Math.min(x + 14, innerWidth - box.width - 6))}px`;
  tip.style.top = `${y + box.height + 24 > innerHeight ? y - box.height - 10 : y + 16}px`;
}
const tipOf = element => element.closest('[data-tip]');
function pointAt(event) {
  if (event.target.closest('.stage')) return;
  const told = tipOf(event.target);
  showTip(told ? told.getAttribute('data-tip') : '', event.clientX, event.clientY);
}
document.addEventListener('pointermove', pointAt);
document.addEventListener('pointerdown', pointAt);
document.addEventListener('pointercancel', () => showTip(''));  // a finger scrolls
document.addEventListener('focusin', event => {
  const told = tipOf(event.target), box = event.target.getBoundingClientRect();
  if (told) showTip(told.getAttribute('data-tip'), box.left, box.bottom);
});
document.addEventListener('focusout', event => { if (tipOf(event.target)) showTip(''); });

// Light and dark: as the system has it, until somebody chooses.
const listeners = [];
const onTheme = act => listeners.push(act);
const system = matchMedia('(prefers-color-scheme: dark)');
let chosenTheme = null;
function applyTheme(forPrint) {
  const dark = !forPrint && (chosenTheme ? chosenTheme === 'dark' : system.matches);
  document.documentElement.dataset.theme = dark ? 'dark' : 'light';
  listeners.forEach(act => act());
}
system.addEventListener('change', () => applyTheme(false));
const unfolded = [];  // what printing opened
addEventListener('beforeprint', () => {
  unfolded.push(...document.querySelectorAll('details:not([open])'));
  unfolded.forEach(each => { each.open = true; });
  applyTheme(true);
});
addEventListener('afterprint', () => {
  unfolded.splice(0).forEach(each => { each.open = false; });
  applyTheme(false);
});
applyTheme(false);
function themeButton() {
  const name = () => document.documentElement.dataset.theme === 'dark' ? 'Light' : 'Dark';
  const button = h('button', { id: 'theme', type: 'button', 'aria-label': 'Switch between dark and light' }, name());
  button.addEventListener('click', () => {
    chosenTheme = name().toLowerCase();
    applyTheme(false);
  });
  onTheme(() => { button.textContent = name(); });
  return button;
}
