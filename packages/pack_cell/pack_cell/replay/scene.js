'use strict';
// Draws boxes, bars and balls in perspective. Matrices are column-major, metres, z up.
const M = {
  unit: () => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
  times(a, b) {
    const out = new Array(16).fill(0);
    for (let c = 0; c < 4; c += 1) {
      for (let r = 0; r < 4; r += 1) {
        for (let k = 0; k < 4; k += 1) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
      }
    }
    return out;
  },
  // Position x y z and quaternion x y z w.
  pose([x, y, z, i = 0, j = 0, k = 0, w = 1]) {
    return [
      1 - 2 * (j * j + k * k), 2 * (i * j + k * w), 2 * (i * k - j * w), 0,
      2 * (i * j - k * w), 1 - 2 * (i * i + k * k), 2 * (j * k + i * w), 0,
      2 * (i * k + j * w), 2 * (j * k - i * w), 1 - 2 * (i * i + j * j), 0,
      x, y, z, 1,
    ];
  },
  about([x, y, z], angle) {
    const half = angle / 2, s = Math.sin(half) / (Math.hypot(x, y, z) || 1);
    return M.pose([0, 0, 0, x * s, y * s, z * s, Math.cos(half)]);
  },
  scaled(m, [x, y, z]) {
    return m.map((v, n) => v * (n < 4 ? x : n < 8 ? y : n < 12 ? z : 1));
  },
  // Of a matrix without scale.
  inverse(m) {
    const out = [m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, 0, 0, 0, 1];
    for (let r = 0; r < 3; r += 1) {
      out[12 + r] = -(out[r] * m[12] + out[4 + r] * m[13] + out[8 + r] * m[14]);
    }
    return out;
  },
};

class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext('webgl', { alpha: false, antialias: true, preserveDrawingBuffer: true });
    this.home = { yaw: 1.08, pitch: 0.55, far: 5.6, at: [0, 0.42, 0.7] };
    this.camera = { ...this.home, at: [...this.home.at] };
    if (!this.gl) return;
    const gl = this.gl;
    const compile = (kind, text) => {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      return shader;
    };
    this.program = gl.createProgram();
    gl.attachShader(this.program, compile(gl.VERTEX_SHADER, `
      attribute vec3 position; attribute vec3 normal;
      uniform mat4 view; uniform mat4 model; uniform vec4 colour; varying vec4 shade;
      void main() {
        gl_Position = view * model * vec4(position, 1.0);
        // Edges stand a little before their faces, by 1.5 thousandths of the distance.
        if (normal == vec3(0.0)) gl_Position.z -= 0.0003;
        vec3 n = normalize(mat3(model) * normal + vec3(1e-6));
        float lit = 0.58 + 0.30 * max(0.0, n.z) + 0.22 * max(0.0, dot(n, vec3(0.5, 0.75, 0.3)));
        shade = vec4(colour.rgb * (normal == vec3(0.0) ? 1.0 : lit), colour.a);
      }`));
    gl.attachShader(this.program, compile(gl.FRAGMENT_SHADER,
      'precision mediump float; varying vec4 shade; void main() { gl_FragColor = shade; }'));
    gl.linkProgram(this.program);
    gl.useProgram(this.program);
    this.at = Object.fromEntries(['position', 'normal'].map((name) => [name, gl.getAttribLocation(this.program, name)]));
    this.uniform = Object.fromEntries(['view', 'model', 'colour'].map((name) => [name, gl.getUniformLocation(this.program, name)]));
    this.meshes = { box: this.mesh(Scene.cube()), cylinder: this.mesh(Scene.cylinder(20)), sphere: this.mesh(Scene.sphere(14)), edges: this.mesh(Scene.edges()) };
  }

  mesh(values) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
    return { buffer, count: values.length / 6 };
  }

  static cube() {
    const out = [];
    for (let axis = 0; axis < 3; axis += 1) {
      for (const side of [-1, 1]) {
        const corner = (a, b) => {
          const p = [0, 0, 0], n = [0, 0, 0];
          p[axis] = side / 2; p[(axis + 1) % 3] = a / 2; p[(axis + 2) % 3] = b / 2; n[axis] = side;
          return [...p, ...n];
        };
        for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) out.push(...corner(a, b));
      }
    }
    return out;
  }

  static edges() {
    const out = [];
    for (let axis = 0; axis < 3; axis += 1) {
      for (const a of [-1, 1]) {
        for (const b of [-1, 1]) {
          for (const end of [-1, 1]) {
            const p = [0, 0, 0];
            p[axis] = end / 2; p[(axis + 1) % 3] = a / 2; p[(axis + 2) % 3] = b / 2;
            out.push(...p, 0, 0, 0);
          }
        }
      }
    }
    return out;
  }

  static cylinder(parts) {
    const out = [], ring = (n) => [Math.cos(2 * Math.PI * n / parts), Math.sin(2 * Math.PI * n / parts)];
    for (let n = 0; n < parts; n += 1) {
      const [a, b] = ring(n), [c, d] = ring(n + 1);
      for (const [x, y, z] of [[a, b, -0.5], [c, d, -0.5], [c, d, 0.5], [a, b, -0.5], [c, d, 0.5], [a, b, 0.5]]) out.push(x, y, z, x, y, 0);
      for (const z of [-0.5, 0.5]) out.push(0, 0, z, 0, 0, 2 * z, a, b, z, 0, 0, 2 * z, c, d, z, 0, 0, 2 * z);
    }
    return out;
  }

  static sphere(parts) {
    const out = [], point = (u, v) => [Math.sin(v) * Math.cos(u), Math.sin(v) * Math.sin(u), Math.cos(v)];
    for (let i = 0; i < 2 * parts; i += 1) {
      for (let j = 0; j < parts; j += 1) {
        const [u, w] = [i, i + 1].map((n) => Math.PI * n / parts), [v, x] = [j, j + 1].map((n) => Math.PI * n / parts);
        for (const p of [point(u, v), point(u, x), point(w, x), point(u, v), point(w, x), point(w, v)]) out.push(...p, ...p);
      }
    }
    return out;
  }

  // `things`: { mesh, model, colour [r g b], alpha, edges }.
  draw(things, dark) {
    const gl = this.gl;
    if (!gl) return;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    gl.viewport(0, 0, width, height);
    gl.clearColor(...(dark ? [0.105, 0.137, 0.172] : [0.955, 0.965, 0.975]), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniformMatrix4fv(this.uniform.view, false, this.view(width / height));
    gl.disable(gl.BLEND);
    gl.depthMask(true);
    const clear = things.filter((thing) => (thing.alpha ?? 1) < 1);
    for (const thing of things) if (!clear.includes(thing)) this.paint(thing, dark);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    for (const thing of clear) this.paint(thing, dark);
    gl.depthMask(true);
  }

  paint({ mesh, model, colour, alpha = 1, edges }, dark) {
    const gl = this.gl;
    this.shape(this.meshes[mesh], gl.TRIANGLES, model, [...colour, alpha]);
    if (edges) this.shape(this.meshes.edges, gl.LINES, model, edges === true ? [...colour.map((v) => 0.45 * v), 1] : edges);
  }

  shape({ buffer, count }, kind, model, colour) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    ['position', 'normal'].forEach((name, n) => {
      gl.enableVertexAttribArray(this.at[name]);
      gl.vertexAttribPointer(this.at[name], 3, gl.FLOAT, false, 24, 12 * n);
    });
    gl.uniformMatrix4fv(this.uniform.model, false, model);
    gl.uniform4fv(this.uniform.colour, colour);
    gl.drawArrays(kind, 0, count);
  }

  view(aspect) {
    const { yaw, pitch, far, at } = this.camera;
    const eye = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
    const right = [-Math.sin(yaw), Math.cos(yaw), 0];
    const up = [-Math.sin(pitch) * Math.cos(yaw), -Math.sin(pitch) * Math.sin(yaw), Math.cos(pitch)];
    this.axes = { right, up };
    const away = eye.map((v, n) => at[n] + far * v), dot = (a, b) => a.reduce((sum, v, n) => sum + v * b[n], 0);
    const look = [
      right[0], up[0], eye[0], 0, right[1], up[1], eye[1], 0, right[2], up[2], eye[2], 0,
      -dot(right, away), -dot(up, away), -dot(eye, away), 1,
    ];
    // A narrow picture still shows the whole width of the cell.
    const lens = 1 / Math.tan(0.36 * Math.max(1, 1.25 / aspect)), near = 0.1, back = 60;
    const project = [lens / aspect, 0, 0, 0, 0, lens, 0, 0, 0, 0, (near + back) / (near - back), -1, 0, 0, 2 * near * back / (near - back), 0];
    return M.times(project, look);
  }

  // Turned, moved and brought nearer by hand; `changed` is called then.
  handle(changed) {
    const { canvas, camera } = this, grips = new Map();
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('pointerdown', (event) => {
      grips.set(event.pointerId, [event.clientX, event.clientY]);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', (event) => {
      const before = grips.get(event.pointerId);
      if (!before) return;
      const now = [event.clientX, event.clientY], [dx, dy] = [now[0] - before[0], now[1] - before[1]];
      const other = [...grips].find(([id]) => id !== event.pointerId);
      if (other) {
        const apart = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]);
        camera.far = Math.min(20, Math.max(0.6, camera.far * apart(before) / Math.max(1, apart(now))));
      } else if (event.shiftKey || event.buttons & 6) {
        const { right, up } = this.axes, scale = camera.far / canvas.clientHeight * 0.75;
        camera.at = camera.at.map((v, n) => v - dx * scale * right[n] + dy * scale * up[n]);
      } else {
        camera.yaw -= dx / 160;
        camera.pitch = Math.min(1.55, Math.max(-0.2, camera.pitch + dy / 160));
      }
      grips.set(event.pointerId, now);
      changed();
    });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (event) => grips.delete(event.pointerId));
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      camera.far = Math.min(20, Math.max(0.6, camera.far * Math.exp(event.deltaY / 700)));
      changed();
    }, { passive: false });
    canvas.addEventListener('dblclick', () => {
      Object.assign(camera, this.home, { at: [...this.home.at] });
      changed();
    });
  }
}
