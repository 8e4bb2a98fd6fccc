'use strict';
// The bins in 3D: one WebGL context draws them all, each into the canvas of its own.
(() => {
  const scenes = JSON.parse(document.getElementById('scenes').textContent);
  const gl = document.createElement('canvas').getContext('webgl', { antialias: true });
  const figures = [...document.querySelectorAll('.bin3d')];
  if (!gl) {
    for (const figure of figures) {
      figure.replaceChildren('This browser shows no 3D pictures; the layers show the same.');
    }
    return;
  }

  const compile = (kind, text) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compile(gl.VERTEX_SHADER, `
    attribute vec3 position; attribute vec3 normal; attribute vec3 colour;
    uniform mat4 view; uniform vec3 light; uniform vec4 tint; varying vec4 shade;
    void main() {
      gl_Position = view * vec4(position, 1.0);
      float lit = 0.66 + 0.34 * max(0.0, dot(normal, light));
      shade = vec4(mix(colour, tint.rgb, tint.a) * (normal == vec3(0.0) ? 1.0 : lit), 1.0);
    }`));
  gl.attachShader(program, compile(gl.FRAGMENT_SHADER,
    'precision mediump float; varying vec4 shade; void main() { gl_FragColor = shade; }'));
  gl.linkProgram(program);
  gl.useProgram(program);
  const at = Object.fromEntries(['position', 'normal', 'colour']
    .map((name) => [name, gl.getAttribLocation(program, name)]));
  const uniform = Object.fromEntries(['view', 'light', 'tint']
    .map((name) => [name, gl.getUniformLocation(program, name)]));

  // Corners are numbered by bits: 1 x, 2 y, 4 z. Faces run around, outside to the viewer.
  const FACES = [
    [[1, 3, 7, 5], [1, 0, 0]], [[0, 4, 6, 2], [-1, 0, 0]], [[2, 6, 7, 3], [0, 1, 0]],
    [[0, 1, 5, 4], [0, -1, 0]], [[4, 5, 7, 6], [0, 0, 1]], [[0, 2, 3, 1], [0, 0, -1]],
  ];
  const EDGES = [0, 1, 1, 3, 3, 2, 2, 0, 4, 5, 5, 7, 7, 6, 6, 4, 0, 4, 1, 5, 2, 6, 3, 7];
  const corner = ([x, y, z], [dx, dy, dz], n) =>
    [x + (n & 1 ? dx : 0), y + (n & 2 ? dy : 0), z + (n & 4 ? dz : 0)];

  // Golden angle: neighbours in the order of placing differ most.
  const colourOf = (n) => {
    const hue = (n * 137.508) % 360, channel = (k) => {
      const t = (k + hue / 30) % 12;
      return 0.62 - 0.2 * Math.max(-1, Math.min(t - 3, 9 - t, 1));
    };
    return [channel(0), channel(8), channel(4)];
  };

  const built = new Map();
  const buildScene = (scene) => {
    const solid = [], lines = [];
    scene.boxes.forEach(([, x, y, z, dx, dy, dz], n) => {
      const colour = colourOf(n), from = [x, y, z], size = [dx, dy, dz];
      for (const [around, normal] of FACES) {
        for (const k of [0, 1, 2, 0, 2, 3]) {
          solid.push(...corner(from, size, around[k]), ...normal, ...colour);
        }
      }
      for (const k of EDGES) lines.push(...corner(from, size, k), 0, 0, 0, 0.1, 0.12, 0.15);
    });
    const frame = [], size = scene.size;
    const edges = scene.walls === 'pallet' ? EDGES.slice(0, 8) : EDGES;
    for (const k of edges) frame.push(...corner([0, 0, 0], size, k), 0, 0, 0, 0.5, 0.56, 0.62);
    const buffer = (values) => {
      const made = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, made);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
      return made;
    };
    return { solid: buffer(solid), lines: buffer(lines), frame: buffer(frame), edges: edges.length };
  };

  const draw = (buffer, kind, first, count, tint) => {
    if (!count) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    ['position', 'normal', 'colour'].forEach((name, n) => {
      gl.enableVertexAttribArray(at[name]);
      gl.vertexAttribPointer(at[name], 3, gl.FLOAT, false, 36, 12 * n);
    });
    gl.uniform4fv(uniform.tint, tint || [0, 0, 0, 0]);
    gl.drawArrays(kind, first, count);
  };

  // Unit vectors of the picture (right, up, towards the eye) in the frame of the bin.
  const axesOf = ({ yaw, pitch }) => {
    const [s, c, t, u] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
    return [[c, s, 0], [-s * t, c * t, u], [s * u, -c * u, t]];
  };

  const states = figures.map((figure) => {
    const scene = scenes[+figure.dataset.scene];
    const yaw = scene.walls === 'cage' ? Math.PI + 0.55 : 0.55;
    return {
      scene, yaw, pitch: 0.5, home: yaw, shown: scene.boxes.length,
      canvas: figure.querySelector('canvas'), slider: figure.querySelector('input'),
      told: figure.querySelector('output'), hover: -1,
    };
  });

  const project = (state, width, height) => {
    const size = state.scene.size, axes = axesOf(state);
    const scale = 0.96 * Math.min(width, height * 1.25) / Math.hypot(...size);
    const middle = size.map((edge) => edge / 2);
    return { axes, scale, middle };
  };

  const paint = (state) => {
    const { canvas, scene } = state;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.round((canvas.clientWidth || 520) * ratio);
    const height = Math.round((canvas.clientHeight || 380) * ratio);
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    const target = gl.canvas;
    if (target.width !== width) target.width = width;
    if (target.height !== height) target.height = height;
    if (!built.has(scene)) built.set(scene, buildScene(scene));
    const parts = built.get(scene);
    const { axes: [right, up, eye], scale, middle } = project(state, width, height);
    const depth = 1 / Math.hypot(...scene.size);
    const rows = [right.map((v) => v * 2 * scale / width), up.map((v) => v * 2 * scale / height),
      eye.map((v) => -v * depth)];
    const shift = rows.map((row) => -row.reduce((sum, v, k) => sum + v * middle[k], 0));
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.uniformMatrix4fv(uniform.view, false, [0, 1, 2].flatMap((k) =>
      [rows[0][k], rows[1][k], rows[2][k], 0]).concat(shift, 1));
    const light = [0, 1, 2].map((k) => 0.35 * right[k] + 0.55 * up[k] + 0.75 * eye[k]);
    gl.uniform3fv(uniform.light, light);
    draw(parts.frame, gl.LINES, 0, parts.edges);
    draw(parts.solid, gl.TRIANGLES, 0, 36 * state.shown);
    draw(parts.lines, gl.LINES, 0, 24 * state.shown);
    const told = state.hover >= 0 ? state.hover : state.shown < scene.boxes.length ? state.shown - 1 : -1;
    if (told >= 0) {
      gl.depthFunc(gl.LEQUAL);
      draw(parts.solid, gl.TRIANGLES, 36 * told, 36, [1, 1, 0.6, 0.55]);
      gl.depthFunc(gl.LESS);
    }
    const paper = canvas.getContext('2d');
    paper.clearRect(0, 0, width, height);
    paper.drawImage(target, 0, 0);
    const box = scene.boxes[told];
    state.told.textContent = box
      ? `step ${told + 1}: ${box[0]}, ${box.slice(4).join(' × ')} mm`
      : `${scene.boxes.length} boxes`;
  };

  // The box under a point of the picture: the ray goes along the eye's axis.
  const boxAt = (state, x, y) => {
    const { canvas, scene } = state;
    const { axes: [right, up, eye], scale, middle } =
      project(state, canvas.clientWidth, canvas.clientHeight);
    const [px, py] = [(x - canvas.clientWidth / 2) / scale, (canvas.clientHeight / 2 - y) / scale];
    const start = [0, 1, 2].map((k) => middle[k] + px * right[k] + py * up[k]);
    let best = -1, nearest = -Infinity;
    scene.boxes.slice(0, state.shown).forEach((box, n) => {
      let low = -Infinity, high = Infinity;
      for (const k of [0, 1, 2]) {
        const ends = [box[1 + k], box[1 + k] + box[4 + k]].map((v) => (v - start[k]) / (eye[k] || 1e-9));
        low = Math.max(low, Math.min(...ends));
        high = Math.min(high, Math.max(...ends));
      }
      if (low < high && high > nearest) [best, nearest] = [n, high];
    });
    return best;
  };

  const due = new Set();
  const ask = (state) => {
    if (!due.size) requestAnimationFrame(() => { due.forEach(paint); due.clear(); });
    due.add(state);
  };

  const seen = new IntersectionObserver((entries) => entries.forEach((entry) => {
    if (entry.isIntersecting) ask(states.find((state) => state.canvas === entry.target));
  }), { rootMargin: '200px' });

  for (const state of states) {
    const { canvas, slider } = state;
    let grip = null;
    canvas.addEventListener('pointerdown', (event) => {
      grip = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', (event) => {
      if (grip) {
        state.yaw -= (event.clientX - grip[0]) / 130;
        state.pitch = Math.min(1.57, Math.max(-0.2, state.pitch + (event.clientY - grip[1]) / 130));
        grip = [event.clientX, event.clientY];
      }
      state.hover = boxAt(state, event.offsetX, event.offsetY);
      ask(state);
    });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { grip = null; });
    canvas.addEventListener('pointerleave', () => { state.hover = -1; ask(state); });
    canvas.addEventListener('dblclick', () => { [state.yaw, state.pitch] = [state.home, 0.5]; ask(state); });
    canvas.addEventListener('keydown', (event) => {
      const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
      if (!turn) return;
      event.preventDefault();
      state.yaw += turn[0];
      state.pitch = Math.min(1.57, Math.max(-0.2, state.pitch + turn[1]));
      ask(state);
    });
    slider.addEventListener('input', () => { state.shown = +slider.value; state.hover = -1; ask(state); });
    seen.observe(canvas);
  }

  addEventListener('resize', () => states.forEach((state) => {
    if (state.canvas.clientWidth) ask(state);
  }));
  // On paper everything is to be seen: all pictures whole, all lists open.
  let closed = [];
  addEventListener('beforeprint', () => {
    closed = [...document.querySelectorAll('details:not([open])')];
    closed.forEach((details) => { details.open = true; });
    states.forEach((state) => { [state.shown, state.hover] = [state.scene.boxes.length, -1]; paint(state); });
  });
  addEventListener('afterprint', () => closed.forEach((details) => { details.open = false; }));
})();
