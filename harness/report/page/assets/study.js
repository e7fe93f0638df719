// A page that was written as Markdown: sections of text, tables, pictures and code.
const spansOf = spans => spans.map(([style, text]) => style ? h(style, {}, text) : text);
const BLOCKS = {
  heading: block => h('h3', {}, block.text),
  text: block => h('p', { class: 'prose' }, spansOf(block.spans)),
  list: block => h('ul', { class: 'limits' }, block.items.map(item => h('li', {}, spansOf(item)))),
  code: block => h('pre', { class: 'broken' }, h('code', {}, block.text)),
  picture: block => h('figure', {}, h('img', { src: block.data, alt: block.text })),
  table: block => scroller('Table', h('table', { class: 'stack' }, h('thead', {}, h('tr', {}, block.head.map(cellOf('th', block)))),
    h('tbody', {}, block.rows.map(row => h('tr', {}, row.map(cellOf('td', block))))))),
};
const LONG = 60;  // characters of a cell that may be broken
// On a narrow page each row is a block, and each cell stands beside its column's head.
const plain = spans => spans.map(([, text]) => text).join('');
const cellOf = (tag, { head, right }) => (cell, k) => h(tag, { scope: tag === 'th' ? 'col' : null, 'data-head': tag === 'td' ? plain(head[k]) : null,
  class: [right[k] && 'n', cell.reduce((sum, [, text]) => sum + text.length, 0) > LONG && 'wrap'].filter(Boolean).join(' ') || null }, spansOf(cell));

function studySections() {
  const instance = player(), replay = replaySection(instance);
  const sections = DATA.sections.map(({ title, blocks }, k) => section(`part-${k}`, title, null, blocks.map(block => BLOCKS[block.kind](block))));
  if (!DATA.sections[0].title) sections[0].firstChild.remove();  // what comes first has no heading
  sections.forEach(each => each.classList.add('long'));
  const named = DATA.sections.flatMap(({ title }, k) => title ? [[`part-${k}`, title]] : []);
  if (DATA.replays.length) {
    sections.push(section('replay', 'Replay', DATA.lede, replay.content));
    named.unshift(['replay', 'Replay']);
  }
  const nav = h('nav', { 'aria-label': 'Sections' }, h('ul', {}, named.map(([id, text]) => h('li', {}, h('a', { href: `#${id}` }, text)))));
  return { sections, nav, instance };
}
