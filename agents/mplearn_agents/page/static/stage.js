// Person, robot and a primitive's figure, drawn on a plain canvas: no graphics card is needed.
//
// Bodies are made of ellipsoids, capsules, cylinders and boxes. Seen from far away the outline of an
// ellipsoid is an ellipse (of the matrix P A P^T), that of a capsule a stroke with round ends; they
// are drawn from the back to the front, each with two lighter shapes towards the light.

const HEIGHT = 2.5;        // metres that are to be seen: raised arms, too
const TURN = 0.42;         // first azimuth of the camera [rad]
const ELEVATION = 0.1;
const BETWEEN = 30;        // ms over which a pose goes over to the next
const FOLLOW = 0.02;       // how fast the place below a figure follows it
const PLAIN = 3;           // px: what is narrower has neither edge nor light

const LOOKS = {
  light: {
    shirt: ["#7d8797", "#98a1af"], trousers: ["#525a68", "#687080"], skin: ["#cba98f", "#dfc3ad"],
    hair: ["#3a3d46", "#4e525c"], shoe: ["#30343c", "#454a54"],
    shell: ["#cfccc3", "#e9e7e1"], frame: ["#5f646e", "#7a808b"], visor: ["#1d2027", "#3b404b"],
    other: ["#8a8f99", "#a5aab3"], edge: "rgba(30,26,20,.28)", floor: "#efede6", ring: "#dcd8cd",
    shadow: "rgba(50,44,34,.16)",
  },
  dark: {
    shirt: ["#5f6a7d", "#7b879b"], trousers: ["#3f4755", "#545d6d"], skin: ["#b8967d", "#d0b097"],
    hair: ["#22252c", "#363a43"], shoe: ["#25282f", "#393e47"],
    shell: ["#b9b7b0", "#d8d6cf"], frame: ["#555b66", "#707783"], visor: ["#0c0e12", "#2c313b"],
    other: ["#7b818c", "#969ca7"], edge: "rgba(0,0,0,.5)", floor: "#20242b", ring: "#30353e",
    shadow: "rgba(0,0,0,.35)",
  },
};
const SEEN = 5e-4; // metres, or in a quaternion: by less nobody sees a figure move from tick to tick
const LIGHT = [-0.34, 0.44]; // towards the light, on the screen, in radii

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false }); // cheaper to put on the page
    this.turn = TURN;
    this.elevation = ELEVATION;
    this.figures = { person: null, robot: null };
    this.moving = {};
    this.shown = null;
    this.captions = { person: "", robot: "", shown: "", left: "" }; // left: what ends the robot's
    this.still = new Map();
    canvas.addEventListener("pointerdown", (e) => this.drag(e));
    canvas.addEventListener("dblclick", () => { this.turn = TURN; this.elevation = ELEVATION; });
  }

  setBodies({ person, robot }) {
    this.figures = { person: person.map(prepared), robot: robot.map(prepared) };
  }

  // Take the latest pose of a figure, 7 numbers a body; return whether that is to be seen.
  pose(name, poses) {
    const now = performance.now(), known = this.moving[name];
    if (!poses.length) { delete this.moving[name]; return Boolean(known); }
    if (known && known.to.length === poses.length) {
      const moved = poses.some((value, k) => Math.abs(value - known.to[k]) > SEEN);
      known.from = blended(known, now);
      known.to = poses;
      known.at = now;
      return moved;
    }
    this.moving[name] = { from: poses, to: poses, at: now, x: poses[0], y: poses[1] };
    return true;
  }

  // Show a primitive: the motion itself, with its demonstrations around it.
  show(clip) { this.shown = clip && { ...clip, began: performance.now() }; }

  drag(e) {
    const { turn, elevation } = this, x = e.clientX, y = e.clientY;
    const move = (m) => {
      this.turn = turn - (m.clientX - x) / 160;
      this.elevation = Math.max(-0.1, Math.min(1.1, elevation + (m.clientY - y) / 260));
    };
    const end = () => { window.removeEventListener("pointermove", move); window.removeEventListener("pointerup", end); };
    window.addEventListener("pointermove", move);
    window.addEventListener("pointerup", end);
  }

  draw(theme, style) {
    const { context: c, canvas } = this;
    const { width, height } = fitted(canvas, c);
    c.fillStyle = style.panel;
    c.fillRect(0, 0, width, height);
    const looks = { ...LOOKS[theme], light: [style.accent, style.accent] };
    const places = this.shown ? { person: 0.2, shown: 0.5, robot: 0.8 } : { person: 0.29, robot: 0.71 };
    const font = Math.max(12, Math.min(height * 0.045, parseFloat(style.size) * 1.05));
    const scale = Math.min((height - 2.6 * font) / HEIGHT, width / (this.shown ? 3.6 : 2.5));
    const ground = height - 1.9 * font - 0.16 * scale;
    const camera = cameraOf(this.turn, this.elevation);
    const now = performance.now();
    for (const [name, share] of Object.entries(places)) {
      const x = share * width;
      this.floor(x, ground, scale, looks, camera, name === "shown" ? style.accent : looks.ring);
      c.font = `600 ${font}px ${style.font}`;
      c.textAlign = "center";
      c.fillStyle = name === "shown" ? style.accent : style.soft;
      c.fillText(clipped(c, this.captions[name] ?? "", width / Object.keys(places).length - 12, name === "robot" ? this.captions.left : ""), x, height - 0.55 * font);
      if (name === "shown") { this.drawShown(x, ground, scale, looks, camera, style, now); continue; }
      const moving = this.moving[name];
      if (!moving || !this.figures[name]) continue;
      const poses = blended(moving, now);
      moving.x += FOLLOW * (poses[0] - moving.x);
      moving.y += FOLLOW * (poses[1] - moving.y);
      this.figure(this.figures[name], poses, 0, x, ground, scale, looks, camera, moving.x, moving.y);
    }
  }

  floor(x, y, scale, looks, camera, ring) {
    const c = this.context, flat = Math.max(0.06, Math.abs(camera.sin));
    c.beginPath();
    c.ellipse(x, y, 0.52 * scale, 0.52 * scale * flat, 0, 0, 7);
    c.fillStyle = looks.floor;
    c.fill();
    c.lineWidth = 1.2;
    c.strokeStyle = ring;
    c.stroke();
    c.beginPath();
    c.ellipse(x, y, 0.27 * scale, 0.27 * scale * flat, 0, 0, 7);
    c.fillStyle = looks.shadow;
    c.fill();
  }

  drawShown(x, ground, scale, looks, camera, style, now) {
    const { motions, rate, bodies, began } = this.shown, shapes = this.figures.person;
    if (!shapes) return;
    const main = motions[0], span = main.length / rate, pause = 0.5;
    const at = Math.min(((now - began) / 1000) % (span + pause), span) / span;
    const c = this.context;
    const pose = (motion) => Math.min(motion.length - 1, Math.floor(at * motion.length)) * bodies * 7;
    c.globalAlpha = 0.26;
    for (const motion of motions.slice(1)) {
      const flat = Object.fromEntries(Object.keys(looks).map((k) => [k, [style.accent, style.accent]]));
      this.figure(shapes, motion.poses, pose(motion), x, ground, scale, { ...flat, edge: null }, camera, 0, 0);
    }
    c.globalAlpha = 1;
    this.figure(shapes, main.poses, pose(main), x, ground, scale, looks, camera, 0, 0);
  }

  figure(shapes, poses, offset, x, y, scale, looks, camera, x0, y0) {
    const seen = [];
    for (const shape of shapes) {
      const at = offset + 7 * shape.body;
      if (at + 7 > poses.length) continue;
      const turn = matrix(poses[at + 3], poses[at + 4], poses[at + 5], poses[at + 6]);
      const place = [poses[at] - x0, poses[at + 1] - y0, poses[at + 2]];
      const centre = moved(turn, shape.pos, place);
      seen.push({ shape, turn: product(turn, shape.turn), centre, depth: dot(camera.towards, centre) });
    }
    seen.sort((a, b) => a.depth - b.depth);
    for (const each of seen) this.shape(each, x, y, scale, looks, camera);
  }

  shape({ shape, turn, centre }, x, y, scale, looks, camera) {
    const c = this.context;
    const [dark, bright] = looks[shape.material] ?? looks.other;
    const px = x + scale * dot(camera.right, centre), py = y - scale * dot(camera.up, centre);
    const s = shape.size;
    if (shape.kind === "box") { this.box(shape, turn, px, py, scale, dark, looks.edge, camera); return; }
    if (shape.kind === "capsule" || shape.kind === "cylinder") {
      const axis = column(turn, 2), r = s[0] * scale;
      const h = shape.kind === "capsule" ? s[1] : Math.max(0.001, s[1] - 0.35 * s[0]);
      const dx = scale * h * dot(camera.right, axis), dy = -scale * h * dot(camera.up, axis);
      c.lineCap = "round";
      const plain = r < PLAIN;
      if (looks.edge && !plain) this.stroke(px, py, dx, dy, 2 * r + 1.6, looks.edge);
      this.stroke(px, py, dx, dy, 2 * r, dark);
      if (bright !== dark && !plain) this.stroke(px + LIGHT[0] * 0.5 * r, py - LIGHT[1] * 0.5 * r, dx, dy, 1.15 * r, bright);
      return;
    }
    const radii = shape.kind === "sphere" ? [s[0], s[0], s[0]] : s;
    const a = [0, 1, 2].map((k) => radii[k] * dot(camera.right, column(turn, k)));
    const b = [0, 1, 2].map((k) => radii[k] * dot(camera.up, column(turn, k)));
    const aa = dot(a, a), bb = dot(b, b), ab = dot(a, b);
    const mean = (aa + bb) / 2, half = Math.hypot((aa - bb) / 2, ab);
    const long = scale * Math.sqrt(mean + half), short = scale * Math.sqrt(Math.max(mean - half, 1e-9));
    const tilt = -0.5 * Math.atan2(2 * ab, aa - bb);
    this.ellipse(px, py, long, short, tilt, dark, looks.edge);
    if (bright !== dark) {
      const [lx, ly] = [LIGHT[0] * 0.62 * scale * Math.sqrt(aa), -LIGHT[1] * 0.62 * scale * Math.sqrt(bb)];
      this.ellipse(px + lx, py + ly, 0.6 * long, 0.6 * short, tilt, bright, null);
    }
  }

  stroke(x, y, dx, dy, width, colour) {
    const c = this.context;
    c.beginPath();
    c.moveTo(x - dx, y - dy);
    c.lineTo(x + dx, y + dy);
    c.lineWidth = width;
    c.strokeStyle = colour;
    c.stroke();
  }

  ellipse(x, y, long, short, tilt, fill, edge) {
    const c = this.context;
    c.beginPath();
    c.ellipse(x, y, long, short, tilt, 0, 7);
    c.fillStyle = fill;
    c.fill();
    if (edge) { c.lineWidth = 0.8; c.strokeStyle = edge; c.stroke(); }
  }

  box({ size }, turn, x, y, scale, fill, edge, camera) {
    const c = this.context;
    const corners = [];
    for (const i of [-1, 1]) for (const j of [-1, 1]) for (const k of [-1, 1]) {
      const p = moved(turn, [i * size[0], j * size[1], k * size[2]], [0, 0, 0]);
      corners.push([x + scale * dot(camera.right, p), y - scale * dot(camera.up, p)]);
    }
    c.beginPath();
    hull(corners).forEach(([px, py], k) => (k ? c.lineTo(px, py) : c.moveTo(px, py)));
    c.closePath();
    c.fillStyle = fill;
    c.fill();
    if (edge) { c.lineWidth = 0.8; c.strokeStyle = edge; c.stroke(); }
  }
}

function prepared(shape) { return { ...shape, turn: matrix(...shape.quat) }; }

function blended({ from, to, at }, now) {
  const share = Math.min(1, (now - at) / BETWEEN);
  if (share >= 1) return to;
  const out = new Float32Array(to.length);
  for (let b = 0; b < to.length; b += 7) {
    for (let k = 0; k < 3; k++) out[b + k] = from[b + k] + share * (to[b + k] - from[b + k]);
    let cosine = 0, norm = 0;
    for (let k = 3; k < 7; k++) cosine += from[b + k] * to[b + k];
    const sign = cosine < 0 ? -1 : 1;
    for (let k = 3; k < 7; k++) {
      out[b + k] = (1 - share) * sign * from[b + k] + share * to[b + k];
      norm += out[b + k] ** 2;
    }
    for (let k = 3; k < 7; k++) out[b + k] /= Math.sqrt(norm) || 1;
  }
  return out;
}

function cameraOf(azimuth, elevation) {
  const ca = Math.cos(azimuth), sa = Math.sin(azimuth), ce = Math.cos(elevation), se = Math.sin(elevation);
  return { towards: [ca * ce, sa * ce, se], right: [-sa, ca, 0], up: [-ca * se, -sa * se, ce], sin: se };
}

function matrix(w, x, y, z) {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
    2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
  ];
}
function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function column(m, k) { return [m[k], m[3 + k], m[6 + k]]; }
function moved(m, p, t) {
  return [0, 1, 2].map((i) => m[3 * i] * p[0] + m[3 * i + 1] * p[1] + m[3 * i + 2] * p[2] + t[i]);
}
function product(a, b) {
  const out = new Array(9);
  for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  return out;
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

// Give a canvas as many pixels as it is seen with; drawing goes on in the page's own.
export function fitted(canvas, context) {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { width, height, ratio };
}

// Shorten a text to a width.
export function clipped(context, text, width, tail = "") {
  if (context.measureText(text + tail).width <= width) return text + tail;
  let n = text.length;
  while (n > 1 && context.measureText(`${text.slice(0, n)}…${tail}`).width > width) n--;
  return `${text.slice(0, n)}…${tail}`;
}
