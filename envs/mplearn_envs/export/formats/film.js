"use strict";
// Plays one motion of a robot: forward kinematics and flat-shaded convex shapes on a plain canvas.
(() => {
  const motion = JSON.parse(document.getElementById("motion").textContent);
  const { bodies, shapes, rate_hz: rate, root_pos: places, root_quat: turns, joint_pos: angles, spans } = motion;
  const byId = (id) => document.getElementById(id);
  const canvas = byId("stage"), context = canvas.getContext("2d", { alpha: false });
  const slider = byId("time"), playButton = byId("play"), clock = byId("clock"), now = byId("now");
  const last = places.length - 1, LIGHT = unit([0.45, -0.5, 0.9]), SHADE = [-0.5, 0.45];
  let frame = 0, playing = false, before = 0, speed = 1;
  let azimuth = -0.65, elevation = 0.2, distance = 2.6 * motion.height;
  let aim = [places[0][0], places[0][1], 0.5 * motion.height];

  byId("title").textContent = motion.name;
  byId("about").textContent = `${motion.robot}, ${(last / rate).toFixed(1)} s`;
  slider.max = String(last);
  slider.step = "any";
  const marks = spans.map((span) => {
    const mark = document.createElement("button");
    mark.type = "button";
    mark.textContent = mark.title = span.name;
    mark.style.flexGrow = String(Math.max(span.end_s - span.start_s, 1e-3));
    mark.style.flexBasis = "0";
    mark.addEventListener("click", () => { frame = span.start_s * rate; draw(); });
    byId("spans").append(mark);
    return mark;
  });

  playButton.addEventListener("click", () => play(!playing));
  byId("speed").addEventListener("change", (e) => { speed = Number(e.target.value); });
  slider.addEventListener("input", () => { frame = Number(slider.value); draw(); });
  window.addEventListener("keydown", (e) => {
    if (e.target.closest("input, select, button") && e.key !== "Escape") return;
    if (e.key === " ") play(!playing);
    else if (e.key === "ArrowRight" || e.key === "ArrowLeft") { frame = clamp(frame + (e.key === "ArrowRight" ? 1 : -1), 0, last); draw(); }
    else return;
    e.preventDefault();
  });
  canvas.addEventListener("pointerdown", (e) => {
    const start = { azimuth, elevation, x: e.clientX, y: e.clientY };
    canvas.setPointerCapture(e.pointerId);
    const move = (m) => {
      azimuth = start.azimuth - (m.clientX - start.x) / 150;
      elevation = clamp(start.elevation + (m.clientY - start.y) / 200, -0.05, 1.5);
      draw();
    };
    const end = () => { canvas.removeEventListener("pointermove", move); canvas.removeEventListener("pointerup", end); canvas.removeEventListener("pointercancel", end); };
    canvas.addEventListener("pointermove", move);
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
  });
  canvas.addEventListener("wheel", (e) => {
    distance = clamp(distance * Math.exp(e.deltaY / 900), 0.8 * motion.height, 12 * motion.height);
    e.preventDefault();
    draw();
  }, { passive: false });
  new ResizeObserver(() => draw()).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => draw());

  function play(on) {
    playing = on;
    playButton.textContent = on ? "Pause" : "Play";
    if (on && frame >= last) frame = 0;
    before = performance.now();
    if (on) requestAnimationFrame(tick);
  }

  function tick(at) {
    if (!playing) return;
    frame += Math.max(0, at - before) / 1000 * rate * speed;
    before = at;
    if (frame >= last) { frame = last; play(false); }
    draw();
    if (playing) requestAnimationFrame(tick);
  }

  // Where each body is, 12 numbers: its origin, then its orientation as a matrix, row by row.
  function posture() {
    const low = Math.floor(frame), high = Math.min(low + 1, last), share = frame - low;
    const mixed = (a, b) => a.map((x, i) => x + share * (b[i] - x));
    const flip = turns[low].reduce((sum, x, i) => sum + x * turns[high][i], 0) < 0 ? -1 : 1;
    const q = mixed(turns[low], turns[high].map((x) => flip * x)), a = mixed(angles[low], angles[high]);
    const out = [];
    for (const body of bodies) {
      if (body.parent < 0) { out.push({ p: mixed(places[low], places[high]), r: matrix(unit(q)) }); continue; }
      const above = out[body.parent];
      let p = add(above.p, turned(above.r, body.pos)), r = product(above.r, matrix(body.quat));
      for (const { axis, anchor, index, shift } of body.joints) {
        const turn = about(axis, a[index] - shift), centre = add(p, turned(r, anchor));
        r = product(r, turn);
        p = add(centre, turned(r, anchor.map((x) => -x)));
      }
      out.push({ p, r });
    }
    return out;
  }

  function draw() {
    const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(name).trim();
    const ratio = Math.min(window.devicePixelRatio || 1, 2), width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const c = context;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.fillStyle = colour("--back");
    c.fillRect(0, 0, width, height);
    const found = posture(), base = found[0].p;
    aim = [aim[0] + 0.15 * (base[0] - aim[0]), aim[1] + 0.15 * (base[1] - aim[1]), aim[2]];
    const ca = Math.cos(azimuth), sa = Math.sin(azimuth), ce = Math.cos(elevation), se = Math.sin(elevation);
    const towards = [ca * ce, sa * ce, se], right = [-sa, ca, 0], up = [-ca * se, -sa * se, ce];
    const eye = add(aim, towards.map((x) => x * distance)), zoom = 1.55 * Math.min(height, 1.3 * width);
    const seen = (point) => {
      const away = add(point, eye.map((x) => -x)), depth = -dot(towards, away);
      if (depth < 0.1) return null;
      return [width / 2 + zoom * dot(right, away) / depth, height / 2 - zoom * dot(up, away) / depth, depth];
    };
    grid(c, seen, colour("--line"));

    const solid = shapes.map((shape) => {
      const { p, r } = found[shape.body];
      const points = shape.points.map((x) => add(p, turned(r, x)));
      const middle = points.reduce(add, [0, 0, 0]).map((x) => x / points.length);
      return { shape, points, depth: dot(towards, middle) };
    });
    c.fillStyle = colour("--line");
    for (const { points } of solid) {
      const floor = points.map((x) => seen([x[0] + SHADE[0] * x[2], x[1] + SHADE[1] * x[2], 0]));
      if (floor.every(Boolean)) polygon(c, hull(floor));
    }
    solid.sort((a, b) => a.depth - b.depth);
    for (const { shape, points } of solid) {
      const flat = points.map(seen);
      if (!flat.every(Boolean)) continue;
      for (const face of shape.faces) {
        const [i, j, k] = face;
        const a = flat[i], b = flat[j], d = flat[k];
        if ((b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]) >= 0) continue; // seen from behind
        const normal = unit(cross(add(points[j], points[i].map((x) => -x)), add(points[k], points[i].map((x) => -x))));
        const bright = 0.55 + 0.45 * Math.max(0, dot(normal, LIGHT)) + 0.08 * normal[2];
        c.fillStyle = c.strokeStyle = `rgb(${shape.rgb.map((x) => Math.round(clamp(255 * x * bright, 0, 255))).join()})`;
        polygon(c, face.map((v) => flat[v]));
        c.lineWidth = 0.7;
        c.stroke(); // closes the seams between faces
      }
    }

    slider.value = String(frame);
    clock.textContent = `${(frame / rate).toFixed(2)} / ${(last / rate).toFixed(2)} s`;
    const t = frame / rate;
    const at = spans.findIndex((span) => t >= span.start_s - 1e-9 && t < span.end_s);
    const which = at < 0 && spans.length && t >= spans[spans.length - 1].start_s ? spans.length - 1 : at;
    marks.forEach((mark, k) => mark.classList.toggle("on", k === which));
    const text = which < 0 ? "" : spans[which].name;
    if (now.textContent !== text) now.textContent = text;
  }

  function grid(c, seen, colour) {
    const step = motion.height > 0.8 ? 0.25 : 0.1, n = 12;
    const x0 = step * Math.round(aim[0] / step), y0 = step * Math.round(aim[1] / step);
    c.strokeStyle = colour;
    c.lineWidth = 1;
    for (let k = -n; k <= n; k++) {
      for (const [one, other] of [[[x0 + k * step, y0 - n * step], [x0 + k * step, y0 + n * step]], [[x0 - n * step, y0 + k * step], [x0 + n * step, y0 + k * step]]]) {
        const a = seen([...one, 0]), b = seen([...other, 0]);
        if (!a || !b) continue;
        c.beginPath();
        c.moveTo(a[0], a[1]);
        c.lineTo(b[0], b[1]);
        c.stroke();
      }
    }
  }

  function polygon(c, points) {
    c.beginPath();
    points.forEach(([x, y], k) => (k ? c.lineTo(x, y) : c.moveTo(x, y)));
    c.closePath();
    c.fill();
  }

  function hull(points) {
    const sorted = points.slice().sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const half = (list) => {
      const out = [];
      for (const p of list) {
        while (out.length > 1) {
          const [a, b] = out.slice(-2);
          if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
          out.pop();
        }
        out.push(p);
      }
      return out.slice(0, -1);
    };
    return [...half(sorted), ...half(sorted.reverse())];
  }

  function clamp(x, low, high) { return Math.min(Math.max(x, low), high); }
  function add(a, b) { return [a[0] + b[0], a[1] + b[1], a[2] + b[2]]; }
  function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  function cross(a, b) { return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]; }
  function unit(a) { const n = Math.hypot(...a) || 1; return a.map((x) => x / n); }
  function turned(m, p) { return [0, 1, 2].map((i) => m[3 * i] * p[0] + m[3 * i + 1] * p[1] + m[3 * i + 2] * p[2]); }
  function product(a, b) {
    const out = new Array(9);
    for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    return out;
  }
  function matrix([w, x, y, z]) {
    return [
      1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ];
  }
  function about(axis, angle) {
    const s = Math.sin(angle / 2);
    return matrix([Math.cos(angle / 2), s * axis[0], s * axis[1], s * axis[2]]);
  }

  window.film = { pause: () => play(false), bodiesAt: (k) => { frame = k; draw(); return posture(); } };
  draw();
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) play(true);
})();
