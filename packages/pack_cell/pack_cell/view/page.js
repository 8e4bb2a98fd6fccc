// The banner over the 3D page. It asks for the state itself, twice a second, so that it also tells
// when nobody answers any more: what stands still on a page must not look like a cell that runs.
(() => {
  const PERIOD_MS = 500, LOST_AFTER = 3;
  // Drawn, since not every machine has a font with such signs.
  const SIGNS = {
    run: 'M4 2 21 12 4 22z', paused: 'M4 2h6v20H4zM14 2h6v20h-6z', operator: 'M12 2a5 5 0 0 1 0 10 5 5 0 0 1 0-10zM2 23c0-6 4-9 10-9s10 3 10 9z',
    fault: 'M5 2 12 9 19 2 22 5 15 12 22 19 19 22 12 15 5 22 2 19 9 12 2 5z', idle: 'M12 3a9 9 0 0 1 0 18 9 9 0 0 1 0-18z',
  };
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
      name: state.word, action: state.action, now: state.now,
      number: state.count === '' ? '' : state.placed,
      alarms: state.alarms ? `${state.alarms} to look at` : state.count === '' ? '' : 'placed',
    };
    for (const [name, text] of Object.entries(parts)) {
      const node = banner.querySelector(`.${name}`);
      if (node.textContent !== String(text)) node.textContent = text;
    }
    banner.querySelector('.sign path').setAttribute('d', SIGNS[state.tone] || '');
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
    banner.innerHTML = '<div class="word"><svg class="sign" viewBox="0 0 24 24" aria-hidden="true"><path/></svg><span class="name"></span></div>'
      + '<div class="text"><div class="action"></div><div class="now"></div></div>'
      + '<div class="count"><b class="number"></b><span class="alarms"></span></div>';
    document.body.prepend(banner);
    ask();
  });
})();
