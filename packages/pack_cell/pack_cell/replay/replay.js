// The run at a moment: what stood where, what was decided, what happened.
(() => {
  const run = JSON.parse(document.getElementById('run').textContent);
  const by = (id) => document.getElementById(id);
  const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const scene = new Scene(by('view'));
  if (!scene.gl) by('without3d').hidden = false;
  // Nodes start and look before they decide for the first time: nothing is to be seen of that.
  const begun = run.decisions.length ? run.decisions[0].t : 0, begin = Math.max(0, begun - 2);

  // Index of the last row whose time is not after `t`; -1 before the first.
  const last = (rows, t, time = (row) => row[0]) => {
    let low = 0, high = rows.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time(rows[middle]) <= t + 1e-9) low = middle + 1; else high = middle;
    }
    return low - 1;
  };

  // -- the robot -------------------------------------------------------------------------------
  const jointTimes = floats(run.joint_times), joints = floats(run.joints), width = run.joint_names.length;
  const jointsAt = (t) => {
    const n = Math.max(0, last(jointTimes, t, (time) => time)), m = Math.min(n + 1, jointTimes.length - 1);
    const span = jointTimes[m] - jointTimes[n], share = span > 0 ? Math.min(1, Math.max(0, (t - jointTimes[n]) / span)) : 0;
    const values = {};
    run.joint_names.forEach((name, k) => {
      values[name] = joints[n * width + k] + share * (joints[m * width + k] - joints[n * width + k]);
    });
    return values;
  };
  const framesOf = (values) => {
    const frames = {};
    for (const joint of run.robot.joints) {
      const value = values[joint.name] ?? 0;
      let moved = M.pose(joint.pose);
      if (joint.kind === 'prismatic') moved = M.times(moved, M.pose(joint.axis.map((v) => v * value)));
      else if (joint.kind !== 'fixed') moved = M.times(moved, M.about(joint.axis, value));
      frames[joint.child] = M.times(frames[joint.parent] ?? M.unit(), moved);
    }
    return frames;
  };
  const tcpAt = (t) => framesOf(jointsAt(t)).tcp;
  const shapesOf = (frames) => run.robot.shapes.map(({ link, kind, sizes, pose, colour }) => {
    const at = M.times(frames[link] ?? M.unit(), M.pose(pose)), [first, second] = sizes;
    const edges = { box: sizes, cylinder: [first, first, second], sphere: [first, first, first] };
    return { mesh: kind, model: M.scaled(at, edges[kind]), colour };
  });
  const hasArm = Boolean(run.robot && jointTimes.length && run.robot.joints.some((joint) => joint.child === 'tcp'));

  // -- what stands still -------------------------------------------------------------------------
  const block = (low, high, colour, alpha = 1, frame = M.unit()) => {
    const size = high.map((v, n) => v - low[n]), middle = M.pose(high.map((v, n) => (v + low[n]) / 2));
    return { mesh: 'box', model: M.scaled(M.times(frame, middle), size), colour, alpha };
  };
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const floor = { light: block([-3.4, -2.4, -0.03], [3.4, 4.2, -0.005], [0.74, 0.76, 0.79]), dark: block([-3.4, -2.4, -0.03], [3.4, 4.2, -0.005], [0.27, 0.3, 0.34]) };
  const still = [];
  const head = run.belt_head;
  if (head) {
    // As long, and with a strand as low, as boxes were ever seen on it.
    const [width, length] = run.belt_size, thick = 0.05;
    let far = head[1] + length, low = head[2];
    for (const [, rows] of run.belt) {
      for (const [box, , y, z] of rows) {
        far = Math.max(far, y / 1000 + 0.35);
        low = Math.min(low, Math.round((z - run.boxes[box].size[2] / 2) / 100) / 10);
      }
    }
    for (const top of low < head[2] - 0.2 ? [head[2], low] : [head[2]]) {
      still.push(block([-width / 2, head[1], top - thick], [width / 2, far, top], [0.2, 0.21, 0.23]));
    }
    for (const x of [-width / 2, width / 2]) {
      for (const y of [head[1] + 0.1, far - 0.1]) still.push(block([x - 0.025, y - 0.025, 0], [x + 0.025, y + 0.025, head[2] - thick], [0.45, 0.47, 0.5]));
    }
  }
  if (run.robot) {
    const rail = run.robot.joints.find((joint) => joint.kind === 'prismatic');
    if (rail && rail.limits) still.push(block([rail.limits[0] - 0.25, -0.12, 0], [rail.limits[1] + 0.25, 0.12, 0.1], [0.45, 0.47, 0.5]));
  }
  const wallsOf = (bin, frame) => {
    const [x, y, z] = bin.size.map((v) => v / 1000), w = 0.02, wall = [0.35, 0.55, 0.78], parts = [];
    parts.push(block([-w, -w, -w], [x + w, y + w, 0], [0.62, 0.47, 0.3], 1, frame));
    if (bin.walls !== 'pallet') {
      parts.push(block([-w, 0, 0], [0, y, z], wall, 0.16, frame), block([x, 0, 0], [x + w, y, z], wall, 0.16, frame));
      parts.push(block([-w, -w, 0], [x + w, 0, z], wall, 0.16, frame));
      if (bin.walls === 'box') parts.push(block([-w, y, 0], [x + w, y + w, z], wall, 0.16, frame));
    }
    return parts;
  };
  const inBin = (frame, [x, y, z, dx, dy, dz]) =>
    M.scaled(M.times(frame, M.pose([x / 1000, y / 1000, z / 1000])), [dx / 1000, dy / 1000, dz / 1000]);
  const stationOf = (bin) => M.pose(run.stations[bin.station] ?? [0, 0, 0]);
  const binNamed = Object.fromEntries(run.bins.map((bin) => [bin.id, bin]));

  // -- boxes -------------------------------------------------------------------------------------
  const beltAt = (t) => {
    const n = last(run.belt, t);
    if (n < 0) return [];
    const [from, rows] = run.belt[n], next = run.belt[n + 1];
    if (!next || next[0] - from > 1.5 || next[0] <= from) return rows;
    const share = (t - from) / (next[0] - from), later = Object.fromEntries(next[1].map((row) => [row[0], row]));
    return rows.map((row) => {
      const goal = later[row[0]];
      return goal ? row.map((v, k) => (k && k < 4 ? v + share * (goal[k] - v) : v)) : row;
    });
  };
  const onBelt = ([, x, y, z, ...turn]) => M.pose([x / 1000, y / 1000, z / 1000, ...turn.slice(0, 4)]);
  const lastOnBelt = (box, t) => {
    for (let n = last(run.belt, t); n >= 0 && n > last(run.belt, t) - 40; n -= 1) {
      const row = run.belt[n][1].find((each) => each[0] === box);
      if (row) return row;
    }
    return null;
  };
  const decisionAbout = (box, t) => {
    for (let n = last(run.decisions, t, (d) => d.t); n >= 0; n -= 1) {
      if (run.decisions[n].box === box && !run.decisions[n].rejected) return run.decisions[n];
    }
    return null;
  };
  const targetOf = (decision) => {
    const bin = decision && binNamed[decision.bin];
    return bin ? M.times(stationOf(bin), M.pose(decision.at.map((v) => v / 1000))) : null;
  };

  // How a box hangs on the pad: square to it, the face that was taken on the pad.
  const onPad = (pad, box, pose) => {
    const relative = M.times(M.inverse(pad), pose), turn = new Array(9).fill(0), free = [true, true, true];
    for (const row of [2, 1, 0]) {
      const best = [0, 1, 2].filter((c) => free[c]).sort((a, b) => Math.abs(relative[4 * b + row]) - Math.abs(relative[4 * a + row]))[0];
      free[best] = false;
      turn[3 * best + row] = Math.sign(relative[4 * best + row]) || 1;
    }
    const size = run.boxes[box].size.map((v) => v / 1000);
    const depth = [0, 1, 2].reduce((sum, c) => sum + Math.abs(turn[3 * c + 2]) * size[c], 0);
    return [turn[0], turn[1], turn[2], 0, turn[3], turn[4], turn[5], 0, turn[6], turn[7], turn[8], 0, 0, 0, depth / 2, 1];
  };
  const carries = run.held.map(([from, until, box]) => {
    const to = until ?? run.end, row = lastOnBelt(box, from), decision = decisionAbout(box, to);
    const carry = { box, from, to, target: targetOf(decision), decision, letGo: to };
    if (row && hasArm) {
      carry.grip = onPad(tcpAt(from), box, onBelt(row));
      if (carry.target) {
        // The pad lets go where it is nearest to the place; no message says when.
        let nearest = Infinity;
        for (let n = last(jointTimes, from, (v) => v); n >= 0 && n < jointTimes.length && jointTimes[n] <= to; n += 1) {
          const at = M.times(tcpAt(jointTimes[n]), carry.grip), far = Math.hypot(...[12, 13, 14].map((k) => at[k] - carry.target[k]));
          if (far < nearest + 0.004) { nearest = Math.min(far, nearest); carry.letGo = jointTimes[n]; }
        }
        if (nearest > 0.25) carry.letGo = to;
      }
    } else if (row) {
      carry.start = onBelt(row);
    }
    return carry;
  });
  const boxThing = (box, model, more = {}) => ({ mesh: 'box', model, colour: run.boxes[box].colour, edges: true, ...more });
  const sizeOf = (box) => run.boxes[box].size.map((v) => v / 1000);
  const carryModel = (carry, t, tcp) => {
    if (t > carry.letGo && carry.target) return M.scaled(carry.target, carry.decision.size.map((v) => v / 1000));
    if (carry.grip) return M.scaled(M.times(tcp, carry.grip), sizeOf(carry.box));
    if (!carry.start || !carry.target) return null;
    const share = Math.min(1, (t - carry.from) / Math.max(1e-3, carry.to - carry.from));
    const between = carry.target.map((v, k) => (k < 12 ? v : carry.start[k] + share * (v - carry.start[k])));
    between[14] += 0.8 * Math.sin(Math.PI * share);
    return M.scaled(between, carry.decision.size.map((v) => v / 1000));
  };

  const contentAt = (bin, t) => {
    const places = new Map();
    for (const [time, box, ...row] of bin.put) {
      if (time > t + 1e-9) break;
      places.delete(box);
      if (row[0] !== null) places.set(box, row);
    }
    return places;
  };
  const standing = (t) => {
    const at = {};
    // A closed bin is shown until the next one stands in its place.
    for (const bin of run.bins) if (bin.opened <= t + 1e-9) at[bin.station] = bin;
    return Object.values(at);
  };

  // The colours of the live page.
  const LAST = [0.1, 0.55, 0.95, 1], NEXT = [0.98, 0.62, 0.1];

  // -- the picture -------------------------------------------------------------------------------
  const thingsAt = (t) => {
    const things = [dark.matches ? floor.dark : floor.light, ...still], tcp = hasArm ? framesOf(jointsAt(t)) : null;
    if (tcp) things.push(...shapesOf(tcp));
    const shown = new Set();
    const inAir = carries.filter((carry) => carry.from <= t + 1e-9 && t < carry.to - 1e-9);
    const n = last(run.decisions, t, (d) => d.t), decision = run.decisions[n];
    for (const bin of standing(t)) {
      const frame = stationOf(bin), content = contentAt(bin, t), newest = [...content.keys()].pop();
      things.push(...wallsOf(bin, frame));
      for (const [box, row] of content) {
        shown.add(box);
        things.push(boxThing(box, inBin(frame, row), box === newest ? { edges: LAST } : {}));
      }
    }
    for (const carry of inAir) {
      const model = shown.has(carry.box) ? null : carryModel(carry, t, tcp && tcp.tcp);
      if (model) things.push(boxThing(carry.box, model));
      shown.add(carry.box);
    }
    for (const row of beltAt(t)) {
      if (!shown.has(row[0])) things.push(boxThing(row[0], M.scaled(onBelt(row), sizeOf(row[0]))));
    }
    for (const ghost of run.decisions.slice(Math.max(0, n - 1), n + 1)) {
      const placed = binNamed[ghost.bin] && contentAt(binNamed[ghost.bin], t).has(ghost.box);
      const target = ghost.rejected || placed ? null : targetOf(ghost);
      if (target) {
        const model = M.scaled(target, ghost.size.map((v) => v / 1000));
        things.push({ mesh: 'box', model, colour: NEXT, alpha: 0.4, edges: [...NEXT, 1] });
      }
    }
    return things;
  };

  // -- the text ----------------------------------------------------------------------------------
  const MODES = { INACTIVE: ['wait', 'NOT READY'], IDLE: ['run', 'RUN'], EXECUTING: ['run', 'RUN'], PROTECTIVE_STOP: ['stop', 'PROTECTIVE STOP'], FAULT: ['stop', 'FAULT'] };
  const seconds = (t) => `${Math.floor(t / 60)}:${(t % 60).toFixed(1).padStart(4, '0')}`;
  const element = (kind, text, parts = {}) => Object.assign(document.createElement(kind), { textContent: text }, parts);
  const sizeText = (size) => size.map((v) => Math.round(v)).join(' × ');
  const fillOf = (bin, t) => {
    let volume = 0;
    for (const box of contentAt(bin, t).keys()) volume += run.boxes[box].size.reduce((a, b) => a * b, 1);
    return 100 * volume / bin.size.reduce((a, b) => a * b, 1);
  };
  const tell = (t) => {
    const mode = run.modes[last(run.modes, t)], [style, word] = mode ? MODES[mode[1]] ?? ['wait', mode[1]] : ['wait', 'NOT HEARD YET'];
    by('mode').className = style;
    by('mode').textContent = mode && mode[2] ? `${word}: ${mode[2]}` : word;
    const placed = run.bins.reduce((sum, bin) => sum + contentAt(bin, t).size, 0);
    const rows = [['in bins', placed === 1 ? '1 box' : `${placed} boxes`], ['rate so far', t > begun + 5 ? `${Math.round(3600 * placed / (t - begun))} /h` : '–']];
    for (const bin of standing(t)) rows.push([`${bin.id}${bin.closed !== null && bin.closed <= t ? ', closed' : ''}`, `${fillOf(bin, t).toFixed(1)} % full`]);
    by('figures').replaceChildren(...rows.map(([name, value]) => {
      const div = document.createElement('div');
      div.append(element('dt', name), element('dd', value));
      return div;
    }));
    const n = last(run.decisions, t, (d) => d.t), parts = [element('h2', n < 0 ? 'Nothing is decided yet' : `Decision ${n + 1} of ${run.decisions.length}`)];
    if (n >= 0) {
      const d = run.decisions[n], box = run.boxes[d.box];
      parts.push(element('p', `${box.id}: ${sizeText(box.size)} mm, ${box.kg} kg`));
      parts.push(element('p', d.rejected ? 'to the reject lane' : `to bin ${d.bin} at (${d.corner.join(', ')}) mm, ${d.turned}`));
      if (d.why) parts.push(element('p', `Why: ${d.why}`));
      if (d.first_refusal) parts.push(element('p', `The arm would not do the first choice: ${d.first_refusal}.`));
      if (d.others.length) {
        const list = element('ul', '');
        list.append(...d.others.map(([place, reason]) => element('li', `${place}: ${reason}`)));
        parts.push(element('p', 'What else there was', { className: 'note' }), list);
      }
      parts.push(element('p', `planned in ${d.planning_ms} ms (${d.status})${d.asked ? `, arm asked about ${d.asked} in ${d.check_ms} ms` : ''}`, { className: 'note' }));
      if (d.code) parts.push(element('p', `outcome: ${d.code === 'NONE' ? 'as planned' : d.code.replaceAll('_', ' ').toLowerCase()}, motion ${d.motion_s} s, ${d.slack_s} s to spare`, { className: 'note' }));
    }
    by('decision').replaceChildren(...parts);
    const end = last(run.notes, t) + 1, notes = run.notes.slice(Math.max(0, end - 8), end).reverse();
    by('notes').replaceChildren(...notes.map(([time, text, bad]) => {
      const item = element('li', '', { className: bad ? 'bad' : '' });
      item.append(element('time', seconds(time)), text);
      return item;
    }));
    by('clock').textContent = `${seconds(t)} of ${seconds(run.end)}`;
  };

  // -- time --------------------------------------------------------------------------------------
  let now = 0, playing = false, before = null, due = false, told = null;
  const frame = (stamp) => {
    due = false;
    if (playing) {
      now = Math.min(run.end, now + (before === null ? 0 : (stamp - before) / 1000) * Number(by('speed').value));
      before = stamp;
      if (now >= run.end) setPlaying(false);
    }
    scene.draw(thingsAt(now), dark.matches);
    if (told === null || Math.abs(told - now) > 0.05) { tell(now); told = now; }
    by('time').value = now;
    if (playing) ask();
  };
  function ask() {
    if (!due) { due = true; requestAnimationFrame(frame); }
  }
  function setPlaying(on) {
    playing = on;
    before = null;
    by('play').textContent = on ? '❚❚' : '▶';
    ask();
  }
  const goTo = (t) => { now = Math.min(run.end, Math.max(0, t)); told = null; before = null; ask(); };
  const step = (by_) => {
    const times = run.decisions.map((d) => d.t), n = last(times, now, (v) => v);
    setPlaying(false);
    if (by_ < 0) {
      // Back to the beginning of this decision first, then to the one before.
      const at = n >= 0 && now - times[n] > 0.05 ? n : n - 1;
      goTo(at >= 0 ? times[at] : begin);
    } else {
      const next = times.find((t) => t > now + 0.005);
      goTo(next ?? run.end);
    }
  };

  const marks = () => {
    const canvas = by('marks'), paper = canvas.getContext('2d');
    canvas.width = canvas.clientWidth;
    canvas.height = canvas.clientHeight;
    const style = getComputedStyle(document.documentElement), x = (t) => 8 + (canvas.width - 16) * (t - begin) / (run.end - begin || 1);
    const line = (t, colour, from) => { paper.fillStyle = style.getPropertyValue(colour); paper.fillRect(x(t) - 0.75, from, 1.5, canvas.height - from); };
    run.decisions.forEach((d) => line(d.t, d.rejected ? '--s4' : '--muted', 7));
    run.bins.forEach((bin) => { if (bin.closed !== null) line(bin.closed, '--accent', 3); });
    run.notes.forEach(([t, , bad]) => { if (bad) line(t, '--bad', 0); });
  };

  by('time').min = begin;
  by('time').max = run.end;
  by('time').addEventListener('input', () => { setPlaying(false); goTo(Number(by('time').value)); });
  by('play').addEventListener('click', () => { if (!playing && now >= run.end) goTo(begin); setPlaying(!playing); });
  by('first').addEventListener('click', () => goTo(begin));
  by('last').addEventListener('click', () => goTo(run.end));
  by('back').addEventListener('click', () => step(-1));
  by('forth').addEventListener('click', () => step(1));
  addEventListener('keydown', (event) => {
    if (event.target.matches('input, select')) return;
    const keys = { ' ': () => by('play').click(), ArrowLeft: () => step(-1), ArrowRight: () => step(1), Home: () => goTo(begin), End: () => goTo(run.end) };
    if (keys[event.key] && !(event.key === ' ' && event.target.matches('button'))) { event.preventDefault(); keys[event.key](); }
  });
  addEventListener('resize', () => { marks(); ask(); });
  dark.addEventListener('change', () => { marks(); ask(); });
  if (scene.gl) scene.handle(ask);
  marks();
  const wanted = /t=([\d.]+)/.exec(location.hash);
  goTo(wanted ? Number(wanted[1]) : run.decisions.length ? run.decisions[0].t : 0);
})();
