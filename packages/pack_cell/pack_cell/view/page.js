// The banner over the 3D page. It asks for the state itself, twice a second, so that it also tells
// when nobody answers any more: what stands still on a page must not look like a cell that runs.
(() => {
  const PERIOD_MS = 500, LOST_AFTER = 3;
  const SIGNS = {run: '▶', paused: '❚❚', operator: '■', fault: '✖', idle: '●'};
  const LOST = {
    tone: 'fault', word: 'NO CONNECTION', action: 'Start this page again: cell view',
    now: 'What stands below is old', count: '',
  };
  const query = new URLSearchParams(location.search);
  // The app below reads this once, when it starts.
  if (matchMedia('(prefers-color-scheme: dark)').matches && !query.has('darkMode')) {
    query.append('darkMode', '');
    history.replaceState(null, '', `${location.pathname}?${query}`);
  }
  let banner, failed = 0;

  function show(state) {
    const parts = {
      sign: SIGNS[state.tone] || '', name: state.word, action: state.action, now: state.now,
      number: state.count === '' ? '' : state.placed,
      alarms: state.alarms ? `${state.alarms} to look at` : state.count === '' ? '' : 'placed',
    };
    for (const [name, text] of Object.entries(parts)) {
      const node = banner.querySelector(`.${name}`);
      if (node.textContent !== String(text)) node.textContent = text;
    }
    banner.dataset.tone = state.tone;
    banner.toggleAttribute('data-long', state.word.length > 10);
    document.title = `${state.word} · packing cell`;
  }

  async function ask() {
    try {
      const answer = await fetch('state.json', {cache: 'no-store'});
      show(await answer.json());
      failed = 0;
    } catch {
      failed += 1;
      if (failed >= LOST_AFTER) show(LOST);
    }
    setTimeout(ask, PERIOD_MS);
  }

  document.addEventListener('DOMContentLoaded', () => {
    banner = document.createElement('header');
    banner.id = 'cell-banner';
    banner.setAttribute('role', 'status');
    banner.innerHTML = '<div class="word"><span class="sign"></span><span class="name"></span></div>'
      + '<div class="text"><div class="action"></div><div class="now"></div></div>'
      + '<div class="count"><b class="number"></b><span class="alarms"></span></div>';
    document.body.prepend(banner);
    ask();
  });
})();
