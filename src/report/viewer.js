'use strict';
// The viewer: images of a scene flipped in place, with one zoom, position, exposure and tone curve for all of them.
(() => {
  const data = JSON.parse(document.getElementById('viewer-data').textContent);
  const bytesOf = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const element = (name, attributes = {}, ...children) => {
    const e = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
    e.append(...children);
    return e;
  };

  // Halves as numbers.
  const toFloat = h => {
    const exponent = h >> 10 & 31, mantissa = h & 1023, sign = h & 32768 ? -1 : 1;
    if (exponent === 0) return sign * mantissa * 2 ** -24;
    if (exponent === 31) return mantissa ? NaN : sign * Infinity;
    return sign * (1 + mantissa / 1024) * 2 ** (exponent - 15);
  };

  // Pixels of an image, interleaved halves, unpacked when they are first wanted.
  const unpack = async image => {
    if (image.pixels) return image;
    const packed = bytesOf(document.getElementById(image.data).textContent);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const count = image.width * image.height, low = 3 * count;
    const pixels = new Uint16Array(3 * count);
    for (let c = 0; c < 3; c++) {
      for (let i = 0, at = c * count; i < count; i++, at++) pixels[3 * i + c] = bytes[at] << 8 | bytes[low + at];
    }
    image.pixels = pixels;
    return image;
  };

  const VERTEX = `#version 300 es
    in vec2 at; void main() { gl_Position = vec4(at, 0, 1); }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    uniform sampler2D image, reference, ramp;
    uniform vec2 size, origin, extent;
    uniform float zoom, gain;
    uniform int mode, curve;
    out vec4 color;
    vec3 encode(vec3 x) { return mix(12.92 * x, 1.055 * pow(max(x, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x)); }
    vec3 tone(vec3 x) {
      if (curve == 0) return clamp(x, 0.0, 1.0);
      x = clamp(0.6 * x, 0.0, 1e6);
      return clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
    }
    void main() {
      vec2 p = origin + vec2(gl_FragCoord.x, size.y - gl_FragCoord.y) / zoom;
      if (any(lessThan(p, vec2(0))) || any(greaterThanEqual(p, extent))) { color = vec4(0.13, 0.13, 0.13, 1); return; }
      vec2 uv = p / extent;
      vec3 x = texture(image, uv).rgb;
      if (any(isnan(x)) || any(isinf(x))) { color = vec4(1, 0, 1, 1); return; }
      if (mode == 0) { color = vec4(encode(tone(gain * x)), 1); return; }
      vec3 r = texture(reference, uv).rgb, d = x - r;
      float t = mode == 1 ? dot(d * d / (r * r + 0.01), vec3(1.0 / 3.0)) : 0.5 + 0.5 * dot(d, vec3(1.0 / 3.0)) * gain;
      color = vec4(texture(ramp, vec2(clamp(mode == 1 ? t * gain : t, 0.0, 1.0), 0.5)).rgb, 1);
    }`;

  const HELP = [
    ['1 … 9, 0', 'image of that number; R: the reference'], ['← →, hover', 'image before, after, under the pointer'],
    ['wheel, + −', 'zoom; F: fit'], ['drag, Shift + arrows', 'move'], ['E, Shift + E', 'exposure up, down by half a stop'],
    ['T', 'tone curve: sRGB, filmic'], ['D', 'difference from the reference: off, relative squared, signed'],
    ['I J K L', 'move the cursor by a pixel (with Shift by ten)'], ['Esc', 'back to the page'],
  ];

  let scene, current = 0, reference = -1, previous = null;
  const state = {zoom: 1, x: 0, y: 0, stops: 0, curve: 0, mode: 0, cursor: [0, 0]};
  const canvas = element('canvas', {tabindex: 0, 'aria-label': 'image'});
  const list = element('ol', {'aria-label': 'images'});
  const status = element('p', {role: 'status'});
  const values = element('table', {'aria-label': 'values under the cursor'});
  const help = element('dl', {});
  HELP.forEach(([keys, what]) => help.append(element('dt', {}, keys), element('dd', {}, what)));
  const side = element('div', {class: 'viewer-side'}, status, values, list,
    element('details', {}, element('summary', {}, 'Keys'), help));
  const panel = element('div', {id: 'viewer', role: 'dialog', 'aria-modal': 'true', 'aria-label': 'viewer', hidden: ''}, canvas, side);
  document.body.append(panel);

  const gl = canvas.getContext('webgl2', {preserveDrawingBuffer: true, antialias: false});
  let uniforms;
  const compile = () => {
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
    const at = gl.getAttribLocation(program, 'at');
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 2, gl.FLOAT, false, 0, 0);
    uniforms = name => gl.getUniformLocation(program, name);
    ['image', 'reference', 'ramp'].forEach((name, unit) => gl.uniform1i(uniforms(name), unit));
  };
  const texture = (unit, upload) => {
    const made = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    upload();
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
    return made;
  };
  const bind = (unit, image) => {
    image.texture ??= texture(unit, () => gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB16F, image.width, image.height, 0,
      gl.RGB, gl.HALF_FLOAT, image.pixels));
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, image.texture);
  };
  const ramps = {};
  const bindRamp = name => {
    ramps[name] ??= texture(2, () => gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, bytesOf(data[name])));
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_2D, ramps[name]);
  };

  const gain = () => 2 ** (state.stops + (state.mode === 0 ? scene.exposure : 0));
  const draw = async () => {
    const shown = scene.images[current], other = scene.images[reference];
    await unpack(shown);
    if (state.mode && other) await unpack(other);
    // Another image may have been chosen meanwhile.
    if (panel.hidden || shown !== scene.images[current]) return;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map(v => Math.max(1, Math.round(v * ratio)));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    bind(0, shown);
    if (state.mode && other) bind(1, other);
    bindRamp(state.mode === 2 ? 'diverging' : 'sequential');
    gl.uniform2f(uniforms('size'), width, height);
    gl.uniform2f(uniforms('origin'), state.x, state.y);
    gl.uniform2f(uniforms('extent'), scene.width, scene.height);
    gl.uniform1f(uniforms('zoom'), state.zoom * ratio);
    gl.uniform1f(uniforms('gain'), gain());
    gl.uniform1i(uniforms('mode'), state.mode);
    gl.uniform1i(uniforms('curve'), state.curve);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    canvas.setAttribute('aria-label', `${scene.label}: ${shown.label}`);
    tell();
  };
  const MODES = ['', ', relative squared difference', ', signed difference'];
  const tell = () => {
    const stops = (state.mode === 0 ? scene.exposure : 0) + state.stops;
    status.textContent = `${scene.label}: ${scene.images[current].label}${MODES[state.mode]} – ` +
      `zoom ${state.zoom.toPrecision(3)}, ${stops >= 0 ? '+' : ''}${stops} stops, ${state.curve ? 'filmic' : 'sRGB'}`;
    [...list.children].forEach((item, i) => item.firstChild.setAttribute('aria-pressed', i === current));
    readout();
  };
  const number = v => Number.isFinite(v) ? (v !== 0 && (Math.abs(v) < 1e-3 || Math.abs(v) >= 1e5) ? v.toExponential(3) : v.toPrecision(4)) : String(v);
  const pixel = (image, [x, y]) => {
    const column = Math.floor(x * image.width / scene.width), row = Math.floor(y * image.height / scene.height);
    const at = 3 * (row * image.width + column);
    return [0, 1, 2].map(c => toFloat(image.pixels[at + c]));
  };
  let pending = false;
  const readout = () => {
    const [x, y] = state.cursor;
    if (x < 0 || y < 0 || x >= scene.width || y >= scene.height) return values.replaceChildren();
    const head = element('tr', {}, element('th', {}, `pixel ${x}, ${y}`), ...['R', 'G', 'B'].map(c => element('th', {}, c)));
    const rows = scene.images.filter((image, i) => image.role !== 'layer' || i === current).map(image => {
      if (!image.pixels) return element('tr', {}, element('td', {}, image.label), element('td', {colspan: 3}, '…'));
      return element('tr', {}, element('td', {}, image.label), ...pixel(image, state.cursor).map(v => element('td', {}, number(v))));
    });
    values.replaceChildren(head, ...rows);
    const left = scene.images.filter(image => image.role !== 'layer' && !image.pixels);
    if (left.length && !pending) {
      pending = true;
      unpack(left[0]).then(() => { pending = false; if (!panel.hidden) readout(); });
    }
  };

  const fit = () => {
    state.zoom = Math.min(canvas.clientWidth / scene.width, canvas.clientHeight / scene.height) || 1;
    state.x = (scene.width - canvas.clientWidth / state.zoom) / 2;
    state.y = (scene.height - canvas.clientHeight / state.zoom) / 2;
  };
  const zoomAt = (factor, px, py) => {
    const zoom = Math.min(256, Math.max(1 / 64, state.zoom * factor));
    state.x += px / state.zoom - px / zoom;
    state.y += py / state.zoom - py / zoom;
    state.zoom = zoom;
  };
  const show = index => {
    current = (index + scene.images.length) % scene.images.length;
    return draw();
  };
  const open = (key, exr, layer, mode = 0) => {
    if (!gl) return false;
    const found = data.scenes.find(s => s.key === key);
    const index = found ? found.images.findIndex(i => i.exr === exr && i.layer === layer) : -1;
    if (index < 0) return false;
    if (!uniforms) compile();
    const fresh = scene !== found || panel.hidden;
    previous = panel.hidden ? document.activeElement : previous;
    scene = found;
    current = index;
    reference = scene.images.findIndex(i => i.role === 'reference');
    state.mode = reference < 0 ? 0 : mode;
    list.replaceChildren(...scene.images.map((image, i) => {
      const button = element('button', {type: 'button'}, `${i < 10 ? (i + 1) % 10 + ' ' : ''}${image.label}`);
      button.addEventListener('pointerenter', () => show(i));
      button.addEventListener('click', () => show(i));
      button.addEventListener('focus', () => show(i));
      return element('li', {class: image.role}, button);
    }));
    panel.hidden = false;
    document.documentElement.classList.add('viewing');
    if (fresh) { fit(); state.cursor = [scene.width >> 1, scene.height >> 1]; }
    canvas.focus();
    draw();
    return true;
  };
  const close = () => {
    panel.hidden = true;
    document.documentElement.classList.remove('viewing');
    previous?.focus();
  };

  const keys = {
    Escape: close, ArrowLeft: () => show(current - 1), ArrowRight: () => show(current + 1),
    ArrowUp: () => show(current - 1), ArrowDown: () => show(current + 1),
    '+': () => { zoomAt(1.5, canvas.clientWidth / 2, canvas.clientHeight / 2); draw(); },
    '-': () => { zoomAt(1 / 1.5, canvas.clientWidth / 2, canvas.clientHeight / 2); draw(); },
    f: () => { fit(); draw(); }, e: () => { state.stops += .5; draw(); }, E: () => { state.stops -= .5; draw(); },
    t: () => { state.curve = 1 - state.curve; draw(); },
    d: () => { state.mode = reference < 0 ? 0 : (state.mode + 1) % 3; draw(); },
    r: () => { if (reference >= 0) show(reference); },
  };
  keys['='] = keys['+'];
  const moves = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
  const cursors = {j: [-1, 0], l: [1, 0], i: [0, -1], k: [0, 1]};
  panel.addEventListener('keydown', event => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const key = event.key, plain = key.length === 1 ? key.toLowerCase() : key;
    if (event.shiftKey && moves[key]) {
      const step = 0.1 * Math.min(canvas.clientWidth, canvas.clientHeight) / state.zoom;
      state.x += step * moves[key][0];
      state.y += step * moves[key][1];
      draw();
    } else if (cursors[plain]) {
      const step = event.shiftKey ? 10 : 1, [dx, dy] = cursors[plain];
      state.cursor = [Math.min(scene.width - 1, Math.max(0, state.cursor[0] + step * dx)),
        Math.min(scene.height - 1, Math.max(0, state.cursor[1] + step * dy))];
      readout();
    } else if (/^[0-9]$/.test(key)) {
      const index = (Number(key) + 9) % 10;
      if (index < scene.images.length) show(index);
    } else if (keys[key] ?? keys[plain]) {
      (keys[key] ?? keys[plain])();
    } else return;
    event.preventDefault();
  });
  canvas.addEventListener('wheel', event => {
    event.preventDefault();
    zoomAt(2 ** (-event.deltaY / 240), event.offsetX, event.offsetY);
    draw();
  }, {passive: false});
  let drag = null;
  canvas.addEventListener('pointerdown', event => { drag = [event.clientX, event.clientY]; });
  window.addEventListener('pointerup', () => { drag = null; });
  canvas.addEventListener('pointermove', event => {
    if (drag) {
      state.x -= (event.clientX - drag[0]) / state.zoom;
      state.y -= (event.clientY - drag[1]) / state.zoom;
      drag = [event.clientX, event.clientY];
      draw();
    }
    state.cursor = [Math.floor(state.x + event.offsetX / state.zoom), Math.floor(state.y + event.offsetY / state.zoom)];
    readout();
  });
  window.addEventListener('resize', () => { if (!panel.hidden) draw(); });

  // Every image of the page that the viewer has opens it, by a click or by Enter.
  if (gl) {
    for (const image of document.querySelectorAll('img[data-exr]')) {
      const key = image.closest('[data-scene]')?.dataset.scene;
      // An error map opens its estimator's image, less the reference.
      const isError = image.dataset.exr.endsWith('error.exr');
      const exr = image.dataset.exr.replace(/error\.exr$/, 'run-00.exr'), layer = isError ? '' : image.dataset.layer ?? '';
      const known = data.scenes.find(s => s.key === key)?.images.some(i => i.exr === exr && i.layer === layer);
      if (!known) continue;
      const open_ = () => open(key, exr, layer, isError ? 1 : 0);
      image.classList.add('opens');
      image.tabIndex = 0;
      image.setAttribute('role', 'button');
      image.addEventListener('click', open_);
      image.addEventListener('keydown', event => { if (event.key === 'Enter') open_(); });
    }
  }
})();
