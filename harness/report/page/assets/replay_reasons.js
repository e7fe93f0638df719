// Beside a replay: why each costed event happened, in the words of navbench explain. The one that is near opens.
function replayReasons(reasons, seek) {
  if (!reasons.length) return { place: null, move() {} };
  const starts = reasons.map(each => Math.max(0, each.time - BEFORE_EVENT));
  let near = -1;
  const entries = reasons.map((each, k) => {
    const [head, ...rest] = sign(each.words).split(': '), text = rest.join(': ');  // "Event 1, 4.0 s, 37.18 USD: it hit ..."
    return h('details', { 'data-time': each.time },
      h('summary', { on: { click: event => { event.preventDefault(); choose(k); } } }, head),
      h('p', {}, text.charAt(0).toUpperCase() + text.slice(1)));
  });
  const place = h('div', { class: 'why', 'aria-live': 'polite' }, h('h3', {}, 'Why'), entries,
    h('p', { class: 'note' }, 'navbench explain tells more, and what another parameter would have saved.'));
  function open(chosen) {
    entries.forEach((entry, k) => { entry.open = k === chosen; });
  }
  function choose(k) {
    const wasOpen = entries[k].open;
    seek(starts[k]);
    open(wasOpen ? -1 : k);
  }
  function move(time) {
    const last = starts.findLastIndex(start => start <= time + .05);
    const now = starts.findIndex(start => last >= 0 && starts[last] - start < .2);  // of several at once the first: it tells all
    if (now === near) return;
    near = now;
    open(near);
  }
  return { place, move };
}

// What the navigator did besides planning and following: failures, recoveries, how it ended.
function navigatorHistory(text) {
  return text && h('div', { class: 'why' }, h('h3', {}, 'Navigator'), h('ul', { class: 'history' }, text.split('; ').map(line => h('li', {}, line))));
}
