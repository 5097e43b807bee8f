'use strict';
// Plays a recording of a run: see web_page.hpp for its format. Drag to orbit, right button or two fingers to move,
// wheel or pinch to zoom, space to pause, arrow keys to step, 0 to return to the initial view.
(async () => {
  const page = document.documentElement, text = id => document.getElementById(id).textContent;
  const fail = message => {
    page.dataset.state = 'error';
    page.dataset.error = message;
    const box = document.getElementById('error');
    box.style.display = 'flex';
    box.textContent = message;
  };
  window.onerror = message => fail(String(message));
  window.onunhandledrejection = event => fail(String(event.reason));

  const bytesOf = base64 => Uint8Array.from(atob(base64), c => c.charCodeAt(0));
  const scene = JSON.parse(text('scene')), shaders = JSON.parse(text('shaders'));
  const packed = new Blob([bytesOf(text('motion').trim())]);
  const stream = new Uint8Array(
    await new Response(packed.stream().pipeThrough(new DecompressionStream('deflate'))).arrayBuffer());

  // --- motion: seven channels per body and frame, as differences from the extrapolation of the last two frames ------
  const bodies = scene.bodies, count = bodies.length, frames = scene.frames.length, channels = 7;
  const motion = new Int32Array(frames * count * channels);
  {
    let at = 0;
    const before = new Int32Array(count * channels), beforeThat = new Int32Array(count * channels);
    for (let frame = 0; frame < frames; ++frame) {
      const known = scene.frames[frame];
      for (let channel = 0; channel < channels; ++channel) {
        for (let body = 0; body < known; ++body) {
          let value = 0, shift = 0, byte;
          do {
            byte = stream[at++];
            value |= (byte & 127) << shift;
            shift += 7;
          } while (byte & 128);
          const i = body * channels + channel, age = frame - bodies[body].first;
          const expected = age > 1 ? 2 * before[i] - beforeThat[i] : age > 0 ? before[i] : 0;
          const now = expected + ((value >>> 1) ^ -(value & 1));
          beforeThat[i] = before[i];
          before[i] = now;
        }
      }
      motion.set(before, frame * count * channels);
    }
    if (at !== stream.length) throw new Error('the recording in this page is damaged');
  }

  // --- WebGL --------------------------------------------------------------------------------------------------------
  const canvas = document.querySelector('canvas');
  const gl = canvas.getContext('webgl2', {antialias: true, powerPreference: 'high-performance'});
  if (!gl) return fail('This browser offers no WebGL 2; enable hardware acceleration or use another browser.');
  const compile = (kind, source) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    return shader;
  };
  const program = (defines, vertex, fragment) => {
    const name = gl.createProgram(), head = '#version 300 es\n' + defines;
    gl.attachShader(name, compile(gl.VERTEX_SHADER, head + vertex));
    gl.attachShader(name, compile(gl.FRAGMENT_SHADER, head + fragment));
    gl.linkProgram(name);
    if (!gl.getProgramParameter(name, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(name));
    const places = new Map();
    return {name, place: uniform => {
      if (!places.has(uniform)) places.set(uniform, gl.getUniformLocation(name, uniform));
      return places.get(uniform);
    }};
  };
  const buffer = (target, data, usage = gl.STATIC_DRAW) => {
    const name = gl.createBuffer();
    gl.bindBuffer(target, name);
    gl.bufferData(target, data, usage);
    return name;
  };

  // Bodies in the order of draw calls.
  const order = [...bodies.keys()].sort((a, b) => bodies[a].mesh - bodies[b].mesh || a - b);
  const poses = new Float32Array(count * 7);
  const poseBuffer = buffer(gl.ARRAY_BUFFER, poses, gl.DYNAMIC_DRAW);
  const scales = buffer(gl.ARRAY_BUFFER, new Float32Array(order.flatMap(i => bodies[i].scale)));
  const colours = buffer(gl.ARRAY_BUFFER, new Uint8Array(order.flatMap(i => [...bodies[i].colour, 255])));
  const programs = new Map(), depthPrograms = new Map();
  const batches = [];
  for (let first = 0; first < count;) {
    const index = bodies[order[first]].mesh, mesh = scene.meshes[index];
    let end = first;
    while (end < count && bodies[order[end]].mesh === index) ++end;
    const defines = '#define ' + mesh.surface + '\n#define TAPS 3\n' + (scene.look.water ? '#define WATER\n' : '');
    if (!programs.has(mesh.surface)) {
      programs.set(mesh.surface, program(defines, shaders.body_vert, shaders.body_frag));
      depthPrograms.set(mesh.surface, program(defines, shaders.body_vert, shaders.depth_frag));
    }
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    buffer(gl.ARRAY_BUFFER, new Float32Array(bytesOf(mesh.vertices).buffer));
    const attribute = (place, size, type, normal, stride, offset, divisor) => {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, type, normal, stride, offset);
      gl.vertexAttribDivisor(place, divisor);
    };
    attribute(0, 3, gl.FLOAT, false, 28, 0, 0);
    attribute(1, 3, gl.FLOAT, false, 28, 12, 0);
    attribute(2, 1, gl.FLOAT, false, 28, 24, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, poseBuffer);
    attribute(3, 3, gl.FLOAT, false, 28, 28 * first, 1);
    attribute(4, 4, gl.FLOAT, false, 28, 28 * first + 12, 1);
    gl.bindBuffer(gl.ARRAY_BUFFER, scales);
    attribute(5, 3, gl.FLOAT, false, 12, 12 * first, 1);
    gl.bindBuffer(gl.ARRAY_BUFFER, colours);
    attribute(6, 4, gl.UNSIGNED_BYTE, true, 4, 4 * first, 1);
    const indices = new Uint32Array(bytesOf(mesh.indices).buffer);
    buffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    batches.push({surface: mesh.surface, array, indices: indices.length, instances: end - first});
    first = end;
  }
  const sky = program('#define FAR_DEPTH 1.0\n', shaders.sky_vert, shaders.sky_frag);
  const emptyArray = gl.createVertexArray();

  const shadowSize = 2048, shadowMap = gl.createTexture(), shadowFrame = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, shadowMap);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, shadowSize, shadowSize);
  for (const [key, value] of [[gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE], [gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL],
    [gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) gl.texParameteri(gl.TEXTURE_2D, key, value);
  gl.bindFramebuffer(gl.FRAMEBUFFER, shadowFrame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, shadowMap, 0);

  // --- vectors and matrices -----------------------------------------------------------------------------------------
  const add = (a, b, s = 1) => a.map((v, i) => v + s * b[i]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = a => a.map(v => v / (Math.hypot(...a) || 1));
  const product = (a, b) => Array.from({length: 16}, (_, i) =>
    [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + i % 4] * b[4 * (i >> 2) + k], 0));
  const view = (eyeAt, right, up, back) => [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0,
    right[2], up[2], back[2], 0, -dot(right, eyeAt), -dot(up, eyeAt), -dot(back, eyeAt), 1];

  // --- camera -------------------------------------------------------------------------------------------------------
  const first = {azimuth: scene.camera.azimuth, elevation: scene.camera.elevation, distance: 1,
    target: scene.camera.target};
  const camera = {...first};
  const fieldOfView = 0.7;
  const cameraAxes = () => {
    const back = [Math.cos(camera.elevation) * Math.cos(camera.azimuth), Math.cos(camera.elevation) * Math.sin(camera.azimuth),
      Math.sin(camera.elevation)];
    const right = unit(cross([0, 0, 1], back));
    return {back, right, up: cross(back, right), eyeAt: add(camera.target, back, camera.distance)};
  };
  // Distance at which everything that moves is visible at this aspect ratio, as in camera_on (camera.hpp).
  const firstAxes = cameraAxes();
  const farEnough = aspect => {
    const tan = Math.tan(fieldOfView / 2), half = scene.camera.half_extents;
    return Math.max(0.2, ...[0, 1, 2, 3, 4, 5, 6, 7].map(c => {
      const corner = half.map((h, axis) => c >> axis & 1 ? h : -h);
      const across = Math.abs(dot(corner, firstAxes.right)) / aspect, upwards = Math.abs(dot(corner, firstAxes.up));
      return 1.06 * (Math.max(across, upwards) / tan + dot(corner, firstAxes.back));
    }));
  };
  // A window that changes its shape, such as a rotated phone, shows as much as before.
  const fit = aspect => {
    const distance = farEnough(aspect);
    camera.distance *= distance / first.distance;
    first.distance = distance;
  };

  // --- state --------------------------------------------------------------------------------------------------------
  const wanted = new URLSearchParams(location.hash.slice(1));
  const duration = (frames - 1) / scene.rate, speeds = [1, 2, 0.25, 0.5];
  const start = Number(wanted.get('t'));  // not a number: starts at 0; beyond an end: starts at that end
  let time = Math.min(duration, Math.max(0, start || 0)), playing = !wanted.has('paused') && frames > 1, speed = 1, last = 0;
  const slider = document.getElementById('slider'), play = document.getElementById('play');
  const clock = document.getElementById('time'), speedButton = document.getElementById('speed');
  slider.max = duration;
  document.title = scene.name + ' · Fathom';
  document.getElementById('title').innerHTML = '<b></b><small></small>';
  document.querySelector('#title b').textContent = scene.name;
  document.querySelector('#title small').textContent = scene.moving.toLocaleString('en') + ' bodies';
  const setPlaying = on => {
    if (on && time >= duration) time = 0;
    playing = on;
    play.textContent = on ? 'Pause' : 'Play';
  };
  setPlaying(playing);
  play.onclick = () => setPlaying(!playing);
  slider.oninput = () => { time = Number(slider.value); setPlaying(false); };
  speedButton.onclick = () => {
    speed = speeds[(speeds.indexOf(speed) + 1) % speeds.length];
    speedButton.textContent = speed + '×';
  };
  addEventListener('keydown', event => {
    if (event.code === 'Space') setPlaying(!playing);
    else if (event.code === 'ArrowRight' || event.code === 'ArrowLeft') {
      setPlaying(false);
      time = Math.min(duration, Math.max(0, time + (event.code === 'ArrowRight' ? 1 : -1) / scene.rate));
    } else if (event.key === '0') Object.assign(camera, first);
    else return;
    event.preventDefault();
  });

  const pointers = new Map();
  const zoom = factor => { camera.distance = Math.min(1e4, Math.max(0.2, camera.distance * factor)); };
  const pan = (x, y) => {
    const a = cameraAxes(), scale = 2 * camera.distance * Math.tan(fieldOfView / 2) / canvas.clientHeight;
    camera.target = add(add(camera.target, a.right, -x * scale), a.up, y * scale);
  };
  canvas.addEventListener('contextmenu', event => event.preventDefault());
  canvas.addEventListener('pointerdown', event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, event => pointers.delete(event.pointerId));
  canvas.addEventListener('pointermove', event => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY], x = now[0] - before[0], y = now[1] - before[1];
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const apart = p => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
      zoom(apart(before) / apart(now));
      pan(x / 2, y / 2);
    } else if (event.buttons & 2 || event.shiftKey) pan(x, y);
    else {
      camera.azimuth -= 0.006 * x;
      camera.elevation = Math.min(1.55, Math.max(-1.55, camera.elevation + 0.006 * y));
    }
    pointers.set(event.pointerId, now);
  });
  canvas.addEventListener('wheel', event => {
    event.preventDefault();
    zoom(Math.exp(0.0012 * event.deltaY));
  }, {passive: false});

  // --- drawing ------------------------------------------------------------------------------------------------------
  const low = [0, 0, 0], high = [0, 0, 0];  // bounds of what casts shadows
  const placeBodies = () => {
    const at = Math.min(time, duration) * scene.rate, frame = Math.min(frames - 1, Math.floor(at));
    const next = Math.min(frames - 1, frame + 1), share = at - frame;
    low.fill(Infinity);
    high.fill(-Infinity);
    for (let i = 0; i < count; ++i) {
      const body = bodies[order[i]], to = 7 * i;
      if (frame < body.first || frame > body.last) {
        poses.fill(0, to, to + 7);  // an absent body has no extent
        continue;
      }
      const a = channels * (frame * count + order[i]);
      const b = next > body.last ? a : channels * (next * count + order[i]);
      for (let c = 0; c < 3; ++c) {
        const value = scene.quantum * (motion[a + c] + share * (motion[b + c] - motion[a + c]));
        poses[to + c] = value;
        if (body.ground) continue;
        low[c] = Math.min(low[c], value - body.radius);
        high[c] = Math.max(high[c], value + body.radius);
      }
      let norm = 0;
      for (let c = 3; c < 7; ++c) {
        const value = motion[a + c] + share * (motion[b + c] - motion[a + c]);
        poses[to + c] = value;
        norm += value * value;
      }
      norm = 1 / Math.sqrt(norm || 1);
      for (let c = 3; c < 7; ++c) poses[to + c] *= norm;
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, poseBuffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, poses);
  };

  const sunView = () => {
    const sun = scene.look.sun_direction.slice(0, 3), right = unit(cross([0, 0, 1], sun)), up = cross(sun, right);
    const reach = 1.5 * camera.distance, corners = [];
    const lower = low.map((v, c) => Math.max(v, camera.target[c] - reach));
    const upper = high.map((v, c) => Math.min(v, camera.target[c] + reach));
    for (let c = 0; c < 8; ++c) {
      const p = [c & 1 ? upper[0] : lower[0], c & 2 ? upper[1] : lower[1], c & 4 ? upper[2] : lower[2]];
      corners.push([dot(right, p), dot(up, p), dot(sun, p)]);
    }
    const least = [0, 1, 2].map(c => Math.min(...corners.map(p => p[c])) - 1);
    const most = [0, 1, 2].map(c => Math.max(...corners.map(p => p[c])) + 1);
    const side = Math.max(most[0] - least[0], most[1] - least[1]);
    most[0] = least[0] + side;
    most[1] = least[1] + side;
    most[2] += 200;  // objects nearer to the sun cast shadows too
    const scale = [0, 1, 2].map(c => 2 / (most[c] - least[c]));
    const projection = [scale[0], 0, 0, 0, 0, scale[1], 0, 0, 0, 0, -scale[2], 0,
      -(most[0] + least[0]) * scale[0] / 2, -(most[1] + least[1]) * scale[1] / 2, (most[2] + least[2]) * scale[2] / 2, 1];
    return {matrix: product(projection, view([0, 0, 0], right, up, sun)), texel: side / shadowSize};
  };
  const toTexture = [.5, 0, 0, 0, 0, .5, 0, 0, 0, 0, .5, 0, .5, .5, .5, 1];

  const setUniforms = (which, values) => {
    gl.useProgram(which.name);
    for (const [key, value] of Object.entries(values)) {
      const place = which.place(key);
      if (!place) continue;
      if (value.length === 16) gl.uniformMatrix4fv(place, false, value);
      else gl.uniform4fv(place, value);
    }
  };
  const drawBodies = (set, values, shadows) => {
    for (const batch of batches) {
      if (shadows && batch.surface === 'GROUND') continue;
      setUniforms(set.get(batch.surface), values);
      gl.bindVertexArray(batch.array);
      gl.drawElementsInstanced(gl.TRIANGLES, batch.indices, gl.UNSIGNED_INT, 0, batch.instances);
    }
  };

  const draw = () => {
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    placeBodies();
    const tan = Math.tan(fieldOfView / 2), aspect = width / height;
    fit(aspect);
    const a = cameraAxes();
    const near = 0.02 * camera.distance, far = 100 * camera.distance + 2000;
    const projection = [1 / (tan * aspect), 0, 0, 0, 0, 1 / tan, 0, 0, 0, 0, -(far + near) / (far - near), -1,
      0, 0, -2 * far * near / (far - near), 0];
    const sun = sunView();
    const look = Object.fromEntries(Object.entries(scene.look).filter(([, value]) => value.length).map(([key, value]) => ['look_' + key, value]));
    look.look_water = [scene.look.water_surface, time, 0, 0];
    const values = {...look, view_projection: product(projection, view(a.eyeAt, a.right, a.up, a.back)),
      shadow_matrix: product(toTexture, sun.matrix), eye: [...a.eyeAt, 0],
      camera_right: [...a.right.map(v => v * tan * aspect), 0], camera_up: [...a.up.map(v => v * tan), 0],
      camera_ahead: [...a.back.map(v => -v), 0], viewport: [width, height, sun.texel, 0]};
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.depthFunc(gl.LEQUAL);
    gl.depthMask(true);
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, shadowFrame);
    gl.viewport(0, 0, shadowSize, shadowSize);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    drawBodies(depthPrograms, {...values, view_projection: sun.matrix}, true);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindTexture(gl.TEXTURE_2D, shadowMap);
    gl.viewport(0, 0, width, height);
    gl.clear(gl.DEPTH_BUFFER_BIT | gl.COLOR_BUFFER_BIT);
    drawBodies(programs, values, false);
    setUniforms(sky, values);
    gl.bindVertexArray(emptyArray);
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  };

  const show = now => {
    const passed = Math.min(0.1, (now - last) / 1000);
    last = now;
    if (playing) {
      time += speed * passed;
      if (time >= duration) {
        time = duration;
        setPlaying(false);
      }
    }
    draw();
    slider.value = time;
    clock.textContent = time.toFixed(2) + ' / ' + duration.toFixed(1) + ' s';
    if (page.dataset.state === 'loading') {
      const error = gl.getError();
      if (error) throw new Error('WebGL error ' + error);
      page.dataset.state = 'ready';
      page.dataset.bodies = String(scene.moving);
    }
    requestAnimationFrame(show);
  };
  requestAnimationFrame(show);
})();
