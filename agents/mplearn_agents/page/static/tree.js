// The tree of primitives, growing from left to right: leaves are primitives, each on a line.

const SVG = "http://www.w3.org/2000/svg";

export class Tree {
  constructor(svg, choose) {
    this.svg = svg;
    this.scroll = svg.parentElement;
    this.choose = choose;
    this.folded = new Set();
    this.wanted = "";
    this.lines = make("g");
    this.marks = new Keyed(make("g"));
    svg.append(this.lines, this.marks.root);
    this.nodes = [];
    this.primitives = new Map();
    svg.addEventListener("click", (e) => this.clicked(e));
    svg.addEventListener("keydown", (e) => this.key(e));
  }

  set(nodes, primitives) {
    this.nodes = nodes;
    this.primitives = primitives;
    this.draw();
  }

  search(text) { this.wanted = text.trim().toLowerCase(); this.draw(); }

  // Fold all that can be folded, or unfold it.
  foldAll() {
    const inner = this.inner();
    const all = inner.every((id) => this.folded.has(id));
    this.folded = new Set(all ? [] : inner);
    this.draw();
  }

  inner() {
    const parents = new Set(this.nodes.map((n) => n.parent));
    return this.nodes.filter((n) => parents.has(n.id) && n.parent !== null).map((n) => n.id);
  }

  // Mark what is present, next, and chosen.
  mark({ present, chosen }) {
    this.present = present;
    this.chosen = chosen;
    for (const row of this.svg.querySelectorAll(".row")) {
      const id = Number(row.dataset.id);
      row.classList.toggle("lit", id === present);
      row.classList.toggle("chosen", id === chosen);
      row.setAttribute("aria-selected", id === chosen);
    }
  }

  clicked(e) {
    const row = e.target.closest("[data-id]"), fold = e.target.closest("[data-fold]");
    if (fold) this.toggle(Number(fold.dataset.fold));
    else if (row) this.choose(Number(row.dataset.id));
  }

  toggle(id) {
    if (!this.folded.delete(id)) this.folded.add(id);
    this.draw();
    this.svg.querySelector(`[data-fold="${id}"]`)?.focus();
  }

  key(e) {
    const items = [...this.svg.querySelectorAll("[data-id], [data-fold]")];
    items.sort((a, b) => a.dataset.y - b.dataset.y);
    const at = items.indexOf(document.activeElement), here = items[at];
    const go = (k) => { items[Math.max(0, Math.min(items.length - 1, k))]?.focus(); e.preventDefault(); e.stopPropagation(); };
    if (e.key === "ArrowDown") go(at + 1);
    else if (e.key === "ArrowUp") go(at - 1);
    else if (e.key === "Home") go(0);
    else if (e.key === "End") go(items.length - 1);
    else if ((e.key === "Enter" || e.key === " ") && here) {
      if (here.dataset.fold) this.toggle(Number(here.dataset.fold)); else this.choose(Number(here.dataset.id));
      e.preventDefault();
      e.stopPropagation();
    }
  }

  draw() {
    const children = new Map();
    for (const node of this.nodes) {
      if (!children.has(node.parent)) children.set(node.parent, []);
      children.get(node.parent).push(node);
    }
    const root = this.nodes.find((n) => n.parent === null);
    const width = this.scroll.clientWidth, height = this.scroll.clientHeight;
    this.lines.replaceChildren();
    if (!width) { this.marks.keep(new Set()); return; }
    if (!root) { this.empty(width, height); return; }
    const leaves = (id) => (children.get(id) ?? []).reduce((n, c) => n + leaves(c.id), 0) || 1;
    const named = (id) => this.primitives.get(id)?.name ?? "";
    const matches = (id) => !this.wanted || named(id).toLowerCase().includes(this.wanted) || String(id) === this.wanted;
    const wanted = (id) => { const below = children.get(id); return below ? below.some((c) => wanted(c.id)) : matches(id); };
    const rows = [];
    const walk = (node, depth) => {
      const below = (children.get(node.id) ?? []).filter((c) => wanted(c.id));
      const folded = this.folded.has(node.id) && !this.wanted && node !== root;
      if (!below.length || folded) {
        const row = { node, depth, leaf: !children.has(node.id), at: rows.length, folded };
        if (node !== root) rows.push(row);
        return row;
      }
      const parts = below.map((c) => walk(c, depth + 1));
      return { node, depth, parts, at: (parts[0].at + parts[parts.length - 1].at) / 2 };
    };
    const top = walk(root, 0);
    if (!rows.length) { this.empty(width, height); return; }
    const size = parseFloat(getComputedStyle(document.documentElement).getPropertyValue("--size")) || 13;
    const screen = document.documentElement.classList.contains("screen") ? parseFloat(getComputedStyle(this.svg).fontSize) : size;
    const step = Math.max(1.75 * screen, Math.min(3.1 * screen, (height - 8) / rows.length));
    const depth = Math.max(...rows.map((r) => r.depth));
    const stride = Math.max(14, Math.min(3.4 * screen, (0.42 * width) / Math.max(depth, 1)));
    const x = (d) => 12 + d * stride, y = (row) => 4 + (row.at + 0.5) * step;
    const leafX = x(depth);
    this.svg.setAttribute("width", width);
    this.svg.setAttribute("height", Math.max(height - 2, rows.length * step + 8));
    const used = new Set();
    const link = (parent, child) => {
      const cx = child.parts || child.folded ? x(child.depth) : leafX;
      const mid = x(parent.depth) + 0.5 * stride;
      this.lines.append(make("path", { d: `M${x(parent.depth)} ${y(parent)}H${mid}V${y(child)}H${cx}` }));
    };
    const visit = (row) => {
      for (const part of row.parts ?? []) { link(row, part); visit(part); }
      if (row === top) this.lines.append(make("circle", { cx: x(0), cy: y(row), r: 4, class: "root" }));
      else if (row.parts || row.folded) used.add(this.innerMark(row, x(row.depth), y(row), screen, leaves));
      else used.add(this.leafMark(row.node, leafX, y(row), step, width, screen, used.size === 0));
    };
    visit(top);
    this.marks.keep(used);
    this.mark({ present: this.present, chosen: this.chosen });
  }

  empty(width, height) {
    this.marks.keep(new Set());
    set(this.svg, { width, height: height - 2 });
    const text = make("text", { x: 12, y: 24, class: "soft" });
    text.textContent = this.wanted ? "none is called that" : "nothing learned yet";
    this.lines.append(text);
  }

  innerMark(row, x, y, size, leaves) {
    const id = row.node.id, n = leaves(id), s = 0.42 * size, key = `fold ${id}`;
    const g = this.marks.get(key, () => {
      const made = make("g", { class: "inner", "data-fold": id, tabindex: -1, role: "treeitem" });
      made.append(make("rect", { rx: 2.5 }), make("text"), make("title"));
      return made;
    });
    const [rect, text, title] = g.children;
    set(g, { "data-y": y, "aria-expanded": !row.folded });
    set(rect, { x: x - s, y: y - s, width: 2 * s, height: 2 * s });
    set(text, { x: x + (row.folded ? 1.4 * size : 0), y: y + (row.folded ? 0.35 * size : 0.32 * size), "text-anchor": row.folded ? "start" : "middle" });
    write(text, row.folded ? `${n} primitives` : "−");
    write(title, row.folded ? "unfold" : `fold ${n} primitives`);
    return key;
  }

  leafMark(node, x, y, step, width, size, first) {
    const primitive = this.primitives.get(node.id), provisional = primitive?.of > 0, key = `leaf ${node.id}`;
    const g = this.marks.get(key, () => {
      const made = make("g", { class: "row fresh", "data-id": node.id, role: "treeitem" });
      made.append(make("rect", { class: "hit" }), make("circle"), make("text", { class: "name" }), make("text", { "text-anchor": "end" }), make("title"));
      return made;
    });
    const [hit, circle, name, count, title] = g.children;
    g.classList.toggle("sure", !provisional);
    set(g, { "data-y": y, tabindex: first ? 0 : -1 });
    set(hit, { x: x - 8, y: y - step / 2 + 1, width: Math.max(width - x + 4, 10), height: step - 2 });
    set(circle, { cx: x, cy: y, r: 0.36 * size });
    set(name, { x: x + 0.95 * size, y: y + 0.35 * size });
    set(count, { class: provisional ? "dots" : "soft", x: width - 8, y: y + 0.35 * size });
    write(count, provisional ? dots(primitive.n, primitive.of) : `× ${primitive?.n ?? node.n}`);
    const room = width - 8 - wide(count.textContent, size) - 0.8 * size - (x + 0.95 * size);
    write(name, fitted(primitive?.name ?? `P${node.id}`, room, size));
    write(title, `${primitive?.name ?? ""}, ${provisional ? `${primitive.n} of ${primitive.of}` : `shown ${primitive?.n ?? node.n} times`}`);
    return key;
  }
}

// Elements that stay the same ones while what they show changes, so that they can be clicked.
export class Keyed {
  constructor(root) { this.root = root; this.made = new Map(); }

  get(key, make) {
    if (!this.made.has(key)) {
      this.made.set(key, make());
      this.root.append(this.made.get(key));
    }
    return this.made.get(key);
  }

  keep(used) {
    for (const [key, element] of this.made) if (!used.has(key)) { element.remove(); this.made.delete(key); }
  }
}

export function set(element, attributes) {
  for (const [key, value] of Object.entries(attributes)) {
    const text = String(value);
    if (element.getAttribute(key) !== text) element.setAttribute(key, text);
  }
}

export function write(element, text) { if (element.textContent !== text) element.textContent = text; }

export function dots(n, of) { return "●".repeat(Math.min(n, of)) + "○".repeat(Math.max(of - n, 0)); }

export function make(tag, attributes = {}) {
  const element = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
}

// How wide a text of the tree is when its primitive is lit, and it is widest [px].
const pen = document.createElement("canvas").getContext("2d");
function wide(text, size) {
  pen.font = `650 ${size}px ${getComputedStyle(document.body).fontFamily}`;
  return pen.measureText(text).width + (/^[●○]+$/.test(text) ? 2 * text.length : 0); // dots are spaced
}

// As much of a text as there is room for [px].
function fitted(text, room, size) {
  let n = [...text].length;
  if (n <= 3 || wide(text, size) <= room) return text;
  while (n > 3 && wide(shortened(text, n), size) > room) n--;
  return shortened(text, n);
}

export function shortened(text, n) {
  const letters = [...text], most = Math.max(3, Math.floor(n));
  return letters.length <= most ? text : `${letters.slice(0, most - 1).join("")}…`;
}
