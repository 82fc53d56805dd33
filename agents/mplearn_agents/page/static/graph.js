// The motion primitive graph: all of it, laid out by springs; or what is around one primitive.

import { Keyed, make, set, shortened, write } from "./tree.js";

const WHOLE_MOST = 40;      // primitives up to which the whole graph is shown by itself
const LABELS_MOST = 44;     // edges up to which each has its probability beside it
const NAMED_MOST = 90;      // primitives up to which each has its name below it
const AROUND_MOST = 9;      // primitives in a column
const APART_MOST = 60;      // primitives up to which names lie apart, and edges go around others
const FULL = 0.45;          // share of the panel that primitives and names can take and still lie apart
const LETTERS = [18, 14, 12]; // of a name: as many as there is room for

export class Graph {
  constructor(svg, choose) {
    this.svg = svg;
    this.choose = choose;
    this.mode = "auto";
    this.places = new Map();
    this.heat = 0;
    this.letters = LETTERS[0];
    this.ids = [];
    this.edges = [];
    this.primitives = new Map();
    this.marks = {};
    this.lines = make("g");
    this.nodes = new Keyed(make("g"));
    this.texts = make("g", { class: "texts" });
    svg.append(this.lines, this.nodes.root, this.texts);
    svg.addEventListener("click", (e) => {
      const node = e.target.closest("[data-id]");
      if (node) this.choose(Number(node.dataset.id));
    });
    svg.addEventListener("keydown", (e) => {
      const node = e.target.closest?.("[data-id]");
      if (node && (e.key === "Enter" || e.key === " ")) { this.choose(Number(node.dataset.id)); e.preventDefault(); e.stopPropagation(); }
    });
  }

  get around() { return this.mode === "around" || (this.mode === "auto" && (this.ids.length > WHOLE_MOST || !this.letters)); }

  // How many letters of each name there is room for; 0 where names could not lie apart.
  fitting(width, height, size) {
    if (this.ids.length > APART_MOST) return this.ids.length > NAMED_MOST ? 0 : 8;
    const r = radius(this.ids.length, width, height, size), high = 2 * r + 1.35 * size;
    const taken = (letters) => this.ids.reduce((sum, id) => sum + high * (Math.max(2 * r, 0.6 * size * Math.min(letters, this.primitives.get(id).name.length)) + 6), 0);
    return LETTERS.find((letters) => taken(letters) <= FULL * width * height) ?? 0;
  }

  set(primitives, edges) {
    const ids = [...primitives.keys()], before = `${this.ids} ${this.edges.map((e) => e.slice(0, 2))}`;
    this.primitives = primitives;
    this.ids = ids;
    this.edges = edges;
    for (const id of [...this.places.keys()]) if (!primitives.has(id)) this.places.delete(id);
    for (const id of ids) if (!this.places.has(id)) this.places.set(id, this.birthplace(id));
    if (before !== `${ids} ${edges.map((e) => e.slice(0, 2))}`) this.heat = 1;
    this.stale = true;
  }

  setMode(mode) { this.mode = mode; this.stale = true; this.heat = Math.max(this.heat, 0.3); }
  mark(marks) { this.marks = marks; this.stale = true; }

  birthplace(id) {
    const near = this.edges.filter((e) => e[0] === id || e[1] === id).map((e) => this.places.get(e[0] === id ? e[1] : e[0])).find(Boolean);
    const angle = id * 2.399963; // the golden angle: no two at one place
    return near ? { x: near.x + 0.08 * Math.cos(angle), y: near.y + 0.08 * Math.sin(angle) }
      : { x: 0.5 + 0.3 * Math.cos(angle), y: 0.5 + 0.3 * Math.sin(angle) };
  }

  // One step of the layout, in a unit square of the panel's shape [Fruchterman 1991].
  settle(aspect) {
    const ids = this.ids, n = ids.length;
    if (n < 2 || this.heat < 0.01) return false;
    const places = ids.map((id) => this.places.get(id)), index = new Map(ids.map((id, k) => [id, k]));
    const k = 0.82 * Math.sqrt(aspect / n), fx = new Float64Array(n), fy = new Float64Array(n);
    for (let i = 0; i < n; i++) {
      for (let j = i + 1; j < n; j++) {
        let dx = (places[i].x - places[j].x) * aspect, dy = places[i].y - places[j].y;
        const square = dx * dx + dy * dy + 1e-6, force = (k * k) / square;
        dx *= force; dy *= force;
        fx[i] += dx; fy[i] += dy; fx[j] -= dx; fy[j] -= dy;
      }
      fx[i] += 0.9 * (0.5 - places[i].x) * aspect * Math.min(1, 6 / n + 0.25);
      fy[i] += 0.9 * (0.5 - places[i].y) * Math.min(1, 6 / n + 0.25);
    }
    for (const [from, to, , p] of this.edges) {
      const i = index.get(from), j = index.get(to);
      if (i === undefined || j === undefined || i === j) continue;
      const dx = (places[j].x - places[i].x) * aspect, dy = places[j].y - places[i].y;
      const pull = (Math.hypot(dx, dy) / k) * (0.35 + 0.65 * p);
      fx[i] += dx * pull; fy[i] += dy * pull; fx[j] -= dx * pull; fy[j] -= dy * pull;
    }
    const step = 0.05 * this.heat;
    for (let i = 0; i < n; i++) {
      const length = Math.hypot(fx[i], fy[i]) || 1, go = Math.min(length, step);
      places[i].x = Math.min(0.95, Math.max(0.05, places[i].x + ((fx[i] / length) * go) / aspect));
      places[i].y = Math.min(0.95, Math.max(0.05, places[i].y + (fy[i] / length) * go));
    }
    this.heat *= 0.97;
    return true;
  }

  // Draw what has changed; return whether it is still finding its place.
  draw() {
    const width = this.svg.clientWidth, height = this.svg.clientHeight;
    if (!width || !height) return false;
    if (this.size !== `${width} ${height}`) { this.size = `${width} ${height}`; this.stale = true; }
    const size = parseFloat(getComputedStyle(this.svg).fontSize) || 13;
    if (this.stale) this.letters = this.fitting(width, height, size);
    let moved = false;
    if (!this.around) {
      const rounds = this.ids.length > 60 ? 12 : 2;
      for (let k = 0; k < rounds; k++) moved = this.settle(width / height) || moved;
      if (!moved && !this.stale) return false;
      if (this.ids.length > 60 && this.heat > 0.05 && !this.stale) return moved; // large ones are drawn when they lie
    } else if (!this.stale) return false;
    this.stale = false;
    set(this.svg, { viewBox: `0 0 ${width} ${height}` });
    this.lines.replaceChildren();
    this.texts.replaceChildren();
    this.used = new Set();
    if (!this.ids.length) {
      const text = make("text", { x: 2, y: 24, class: "soft" });
      text.textContent = "a primitive appears here when it has been shown a few times";
      this.texts.append(text);
    } else if (this.around) this.drawAround(width, height, size);
    else this.drawWhole(width, height, size);
    this.nodes.keep(this.used);
    return moved;
  }

  drawWhole(width, height, size) {
    const n = this.ids.length, r = radius(n, width, height, size), { letters } = this;
    const loops = this.edges.some((e) => e[0] === e[1]); // they rise above their primitive
    const named = letters > 0;
    const margin = named ? { x: 4.2 * size, y: (loops ? 3.6 : 2) * size, below: r + 1.7 * size } : { x: 2 * size, y: 3 * r + size, below: 3 * r + size };
    const xs = this.ids.map((id) => this.places.get(id).x), ys = this.ids.map((id) => this.places.get(id).y);
    const box = { x: Math.min(...xs), y: Math.min(...ys), w: Math.max(Math.max(...xs) - Math.min(...xs), 0.25), h: Math.max(Math.max(...ys) - Math.min(...ys), 0.25) };
    const place = (id) => {
      const p = this.places.get(id);
      return { x: n === 1 ? width / 2 : margin.x + ((p.x - box.x) / box.w) * (width - 2 * margin.x), y: n === 1 ? height / 2 : margin.y + ((p.y - box.y) / box.h) * (height - margin.y - margin.below) };
    };
    const at = new Map(this.ids.map((id) => [id, place(id)]));
    for (const [id, p] of at) Object.assign(p, { width, w: named ? 0.6 * size * Math.min(letters, this.primitives.get(id).name.length) : 0 });
    const room = [...at.values()].map((p) => ({ at: p, w: p.w }));
    if (n <= APART_MOST) apart(room, r, size, { x0: margin.x, x1: width - margin.x, y0: margin.y, y1: height - margin.below });
    const pairs = new Set(this.edges.map((e) => `${e[0]} ${e[1]}`));
    const { texts } = this;
    const labels = this.edges.length <= LABELS_MOST;
    for (const edge of this.edges) {
      if (!at.has(edge[0]) || !at.has(edge[1])) continue;
      const lit = edge[0] === this.marks.present, dim = this.dims(edge[0], edge[1]);
      const from = at.get(edge[0]), to = at.get(edge[1]), bent = pairs.has(`${edge[1]} ${edge[0]}`);
      const bend = n <= APART_MOST ? clearing(from, to, bent, [...at.values()], r) : bending(from, to, bent);
      this.edge(from, to, r, edge, { lit, dim, bend, label: (labels || lit) && !dim, size });
    }
    for (const id of this.ids) this.node(id, at.get(id), r, size, letters, named, width);
    uncovered(texts, room.flatMap(({ at: { x, y }, w }) => [
      { x: x - r, y: y - r, w: 2 * r, h: 2 * r }, { x: x - w / 2, y: y + r, w, h: 1.3 * size }]), size);
    if (!named) this.over(at, r, size);
  }

  // Among many, write the names of those near the present and the chosen one, above all others.
  over(at, r, size) {
    const { present, chosen } = this.marks, taken = [];
    const first = (id) => (id === chosen || id === present ? 0 : 1);
    for (const id of this.ids.filter((id) => this.near(id)).sort((a, b) => first(a) - first(b))) {
      const { x, y } = at.get(id), words = shortened(this.primitives.get(id).name, 18), w = 0.6 * size * words.length;
      if (taken.some((t) => Math.abs(t.x - x) < (t.w + w) / 2 && Math.abs(t.y - y) < 1.2 * size)) continue;
      taken.push({ x, y, w });
      const text = make("text", { class: `over${id === present ? " lit" : ""}`, x: f(x), y: f(y + r + 1.05 * size) });
      text.textContent = words;
      this.texts.append(text);
    }
  }

  // Is a pair out of what a chosen primitive is about?
  dims(from, to) {
    const { chosen } = this.marks;
    return chosen != null && this.ids.length > 12 && from !== chosen && to !== chosen;
  }

  near(id) {
    const { present, chosen } = this.marks;
    return id === present || id === chosen || this.edges.some((e) => (e[0] === id && (e[1] === chosen)) || (e[1] === id && (e[0] === chosen || e[0] === present)));
  }

  // One primitive, what comes before it on the left, and what follows on the right.
  drawAround(width, height, size) {
    const id = this.marks.chosen ?? this.marks.present ?? this.ids[0];
    const after = this.edges.filter((e) => e[0] === id && e[1] !== id).sort((a, b) => b[3] - a[3]);
    const follows = new Set(after.map((e) => e[1])), back = new Map();
    const before = this.edges.filter((e) => e[1] === id && e[0] !== id).sort((a, b) => b[2] - a[2]);
    for (const edge of before) if (follows.has(edge[0])) back.set(edge[0], edge);
    const itself = this.edges.find((e) => e[0] === id && e[1] === id);
    const top = 2.1 * size, most = Math.max(1, Math.min(AROUND_MOST, Math.floor((height - top) / (3.4 * size))));
    const r = 0.95 * size, letters = Math.max(6, Math.min(16, Math.floor((0.3 * width) / (0.6 * size))));
    const room = (id, most) => 0.6 * size * Math.min(most, this.primitives.get(id)?.name.length ?? 3);
    const centre = { x: width / 2, y: (height + top) / 2 - 0.6 * size, w: room(id, letters + 3), width }, taken = [];
    const put = (id, at, r, letters) => {
      this.node(id, at, r, size, letters, true, width);
      taken.push({ x: at.x - r, y: at.y - r, w: 2 * r, h: 2 * r }, { x: at.x - at.w / 2, y: at.y + r, w: at.w, h: 1.3 * size });
    };
    const draw = (edge, from, to, bent) => this.edge(from, to, r, edge, { lit: edge[0] === this.marks.present, dim: false, bend: bending(from, to, bent), label: true, size, late: edge[0] === id });
    const column = (list, x, end, head) => {
      const shown = list.slice(0, most), step = Math.min((height - top) / Math.max(shown.length, 1), 5 * size);
      if (!list.length) return;
      const text = make("text", { class: "head", x, y: 1.4 * size });
      text.textContent = list.length > shown.length ? `${head}: ${shown.length} of ${list.length}` : head;
      this.texts.append(text);
      shown.forEach((edge, k) => {
        const at = { x, y: centre.y + (k - (shown.length - 1) / 2) * step, w: room(edge[end], letters), width }, other = back.get(edge[1]);
        if (end === 0) draw(edge, at, centre, false);
        else draw(edge, centre, at, Boolean(other));
        if (end === 1 && other) draw(other, at, centre, true);
        put(edge[end], at, r, letters);
      });
    };
    column(before.filter((e) => !follows.has(e[0])), 0.16 * width, 0, "before");
    column(after, 0.84 * width, 1, "after");
    if (itself) draw(itself, centre, centre, false);
    put(id, centre, 1.4 * r, letters + 3);
    uncovered(this.texts, taken, size);
  }

  edge(from, to, r, [source, target, count, p], { lit, dim, bend, label, size, late = false }) {
    const dx = to.x - from.x, dy = to.y - from.y, length = Math.hypot(dx, dy);
    const kind = `${lit ? " lit" : ""}${dim ? " dim" : ""}`;
    const weight = Math.max(0.8, 0.28 * r * (0.12 + p)), opacity = 0.25 + 0.6 * p;
    let d, tip, way, middle;
    if (source === target) {
      const s = 1.9 * r;
      d = `M${from.x - 0.6 * r} ${from.y - 0.8 * r}C${from.x - s} ${from.y - 2 * s} ${from.x + s} ${from.y - 2 * s} ${from.x + 0.6 * r} ${from.y - 0.9 * r}`;
      tip = { x: from.x + 0.55 * r, y: from.y - 0.9 * r }; way = { x: -0.3, y: 1 }; middle = { x: from.x, y: from.y - 1.6 * s };
    } else {
      if (length < 2.2 * r) return;
      const ux = dx / length, uy = dy / length;
      const cx = (from.x + to.x) / 2 - uy * bend * 2, cy = (from.y + to.y) / 2 + ux * bend * 2;
      const out = unit(cx - from.x, cy - from.y); way = unit(to.x - cx, to.y - cy);
      const head = 2.2 + 2.2 * weight;
      let begin = beyond(from, out.x, out.y, r, size), end = beyond(to, -way.x, -way.y, r, size);
      if (begin + end > length - 2 * head) begin = r + 1; // rather the tail under a name than the tip
      if (begin + end > length - 2 * head) end = r + 2;
      tip = { x: to.x - way.x * end, y: to.y - way.y * end };
      const sx = from.x + out.x * begin, sy = from.y + out.y * begin;
      d = `M${f(sx)} ${f(sy)}Q${f(cx)} ${f(cy)} ${f(tip.x - way.x * head)} ${f(tip.y - way.y * head)}`;
      const near = late ? 0.22 : 0.3; // names lie at the middle of what is around one: away from it
      middle = { x: near * sx + 0.5 * cx + (0.5 - near) * tip.x, y: near * sy + 0.5 * cy + (0.5 - near) * tip.y };
    }
    const path = make("path", { class: `edge${kind}`, d, "stroke-width": f(weight) });
    if (!dim) path.setAttribute("stroke-opacity", f(lit ? 0.95 : opacity));
    const title = make("title");
    title.textContent = `${p.toFixed(2)}, seen ${count} times`;
    path.append(title);
    const head = 2.4 + 2.3 * weight, nx = -way.y, ny = way.x, w = 0.62 * head;
    const arrow = make("path", { class: `tip${kind}`, "data-to": target, d: `M${f(tip.x)} ${f(tip.y)}L${f(tip.x - way.x * head + nx * w)} ${f(tip.y - way.y * head + ny * w)}L${f(tip.x - way.x * head - nx * w)} ${f(tip.y - way.y * head - ny * w)}Z` });
    if (!dim) arrow.setAttribute("fill-opacity", f(lit ? 0.95 : opacity));
    this.lines.append(path, arrow);
    if (label && length > 5.5 * size || (label && source === target)) {
      const text = make("text", { class: `p${lit ? " lit" : ""}`, x: f(middle.x), y: f(middle.y), "data-p": lit ? 1 + p : p });
      text.textContent = p.toFixed(2);
      this.texts.append(text);
    }
  }

  node(id, at, r, size, letters, named, width) {
    const { present, chosen, next, matched } = this.marks, primitive = this.primitives.get(id);
    const off = id !== present && id !== chosen && ((chosen != null && !this.around && this.ids.length > 12 && !this.near(id)) || (matched && !matched.has(id)));
    const kind = ["node", id === present && "lit", id === chosen && "chosen", id === next && "next", primitive?.of > 0 && "provisional", off && "dim"].filter(Boolean).join(" ");
    const g = this.nodes.get(id, () => {
      const made = make("g", { "data-id": id, tabindex: 0, role: "button" });
      made.append(make("circle"), make("text"), make("title"));
      return made;
    });
    this.used.add(id);
    const [circle, text, title] = g.children;
    const words = named ? shortened(primitive?.name ?? `P${id}`, letters) : "", half = 0.3 * size * words.length;
    set(g, { class: kind, transform: `translate(${f(at.x)} ${f(at.y)})` });
    set(circle, { r: f(r) });
    set(text, { x: f(aside(at.x, half, width)), y: f(r + 1.05 * size) });
    write(text, words);
    write(title, primitive?.name ?? "");
  }
}

// How large primitives are drawn, of so many.
function radius(n, width, height, size) {
  return Math.max(5, Math.min(1.05 * size, 0.24 * Math.sqrt((width * height) / (n * 6))));
}

// How far from the middle of a primitive an edge is seen: beyond its circle, and the name below it.
function beyond({ x, w = 0, width }, ux, uy, r, size) {
  const middle = aside(x, w / 2, width), half = w / 2 + 3, top = ((r + 0.25 * size) / uy) * ux;
  if (uy <= 0 || !w || Math.abs(top - middle) > half) return r + 2;
  const side = (middle + Math.sign(ux || 1) * half) / (ux || 1e-6);
  return Math.max(r + 2, Math.min(side, (r + 1.4 * size) / uy) + 1);
}

// How far to the side of a primitive its name lies, so that all of it is in the panel.
function aside(x, half, width) { return Math.max(half - x, Math.min(0, width - half - x)); }

// How far an edge leaves the straight line: both ways between two are seen [px].
function bending(from, to, bent) {
  const length = Math.hypot(to.x - from.x, to.y - from.y);
  return bent ? Math.min(0.16 * length, 26) : 0.03 * length;
}

// The same, but so that it goes behind no other primitive where that can be avoided.
function clearing(from, to, bent, places, r) {
  const plain = bending(from, to, bent), dx = to.x - from.x, dy = to.y - from.y, length = Math.hypot(dx, dy);
  if (length < 4 * r) return plain;
  const others = places.filter((p) => p !== from && p !== to);
  const nearest = (bend) => {
    let least = 1.3 * r;
    for (const t of [0.15, 0.25, 0.35, 0.5, 0.65, 0.75, 0.85]) {
      const off = 4 * t * (1 - t) * bend, x = from.x + t * dx - (dy / length) * off, y = from.y + t * dy + (dx / length) * off;
      for (const p of others) least = Math.min(least, Math.hypot(p.x - x, p.y - y));
    }
    return least;
  };
  const turns = bent ? [plain, 2.2 * r, 3.5 * r] : [plain, -plain, 1.7 * r, -1.7 * r, 3 * r, -3 * r];
  let best = plain, most = -1;
  for (const bend of turns) {
    const least = nearest(bend);
    if (least > most + 0.01) { best = bend; most = least; }
    if (most >= 1.3 * r) break;
  }
  return best;
}

// Move primitives so far that their names do not cover each other, where there is room.
function apart(room, r, size, { x0, x1, y0, y1 }) {
  const wide = ({ w }) => Math.max(2 * r, w) + 6, h = 2 * r + 1.35 * size;
  for (let round = 0; round < 40; round++) {
    let moved = false;
    for (let i = 0; i < room.length; i++) {
      for (let j = i + 1; j < room.length; j++) {
        const a = room[i].at, b = room[j].at, dx = b.x - a.x, dy = b.y - a.y;
        const ox = (wide(room[i]) + wide(room[j])) / 2 - Math.abs(dx), oy = h - Math.abs(dy);
        if (ox <= 0 || oy <= 0) continue;
        moved = true;
        if (ox < oy) { const go = Math.sign(dx || 1) * 0.5 * ox; a.x -= go; b.x += go; }
        else { const go = Math.sign(dy || 1) * 0.5 * oy; a.y -= go; b.y += go; }
        for (const p of [a, b]) { p.x = Math.min(x1, Math.max(x0, p.x)); p.y = Math.min(y1, Math.max(y0, p.y)); }
      }
    }
    if (!moved) return;
  }
}

// Leave out the probabilities that would cover a node or a likelier one.
function uncovered(texts, taken, size) {
  const w = 2.1 * size, h = 0.95 * size;
  for (const text of [...texts.querySelectorAll(".p")].sort((a, b) => b.dataset.p - a.dataset.p)) {
    const box = { x: text.getAttribute("x") - w / 2, y: text.getAttribute("y") - h / 2, w, h };
    const covers = taken.some((t) => box.x < t.x + t.w && t.x < box.x + w && box.y < t.y + t.h && t.y < box.y + h);
    if (covers) text.remove(); else taken.push(box);
  }
}

function unit(x, y) { const length = Math.hypot(x, y) || 1; return { x: x / length, y: y / length }; }
function f(value) { return Math.round(value * 10) / 10; }
