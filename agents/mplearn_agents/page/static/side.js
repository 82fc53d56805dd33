// The column beside: what is present and next, what is being learned, what happened; and the card of
// the primitive that was chosen. Names are always text, never markup.

import { dots } from "./tree.js";

export function element(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

export class Side {
  constructor(root, label) {
    this.label = label;
    const find = (s) => root.querySelector(s);
    this.present = find(".present");
    this.why = find(".why");
    this.next = find(".next");
    this.sum = find(".sum");
    this.list = find("#progress ul");
    set(this.sum, "nothing learned yet");
    this.log = find("#log ol");
    this.items = [...Array(3)].map(() => {
      const item = element("li", { hidden: true });
      item.append(element("i"), element("span", { className: "name" }), element("span", { className: "p" }), element("span", { className: "when" }));
      this.next.append(item);
      return item;
    });
  }

  // Say what is present: the last motion that was recognised, or that none was.
  now({ text, lit, why }) {
    set(this.present, text);
    this.fit();
    this.present.dataset.lit = lit ? "yes" : "no";
    set(this.why, why);
  }

  // Write what is present as large as there is room for it in a line.
  fit() {
    const { style } = this.present;
    style.fontSize = "";
    const { scrollWidth, clientWidth } = this.present;
    if (scrollWidth > clientWidth) style.fontSize = `${Math.max(0.5, clientWidth / (scrollWidth + 2)) * parseFloat(getComputedStyle(this.present).fontSize)}px`;
  }

  coming(forecast, seconds) {
    this.items.forEach((item, k) => {
      const next = forecast[k];
      item.hidden = !next;
      if (!next) return;
      const [bar, name, p, when] = item.children;
      bar.style.width = `${Math.round(100 * next.p)}%`;
      set(name, next.id === null ? "something new" : this.label(next.id));
      set(p, next.p.toFixed(2));
      const left = next.frame === null ? null : seconds(next.frame);
      set(when, left === null || left < -3 ? "" : left > 0.05 ? `in ${left.toFixed(1)} s` : "now");
    });
  }

  learning(primitives, waiting) {
    const all = [...primitives.values()], young = all.filter((p) => p.of > 0);
    const sure = all.length - young.length;
    set(this.sum, all.length ? `${sure} learned${young.length ? `, ${young.length} to be confirmed` : ""}` : "nothing learned yet");
    const rows = young.map((p) => [p.name, p.n, p.of]);
    if (waiting?.times > 1 && waiting.times < waiting.of) rows.unshift(["a new motion", waiting.times, waiting.of]);
    this.list.replaceChildren(...rows.map(([name, n, of]) => element("li", {}, element("span", { textContent: name, title: name }), element("span", { className: "dots", textContent: dots(n, of) }), element("span", { className: "count", textContent: `${n} of ${of}` }))));
  }

  // Write what happened, the latest first.
  tell(events) {
    const stay = this.log.scrollTop > 4;
    for (const event of events) {
      const time = element("time", { textContent: clock(event.time_s) });
      const item = element("li", { className: event.what }, time, element("span", { textContent: this.text(event.text) }));
      item.dataset.text = event.text;
      this.log.prepend(item);
      if (stay) this.log.scrollTop += item.offsetHeight;
    }
    while (this.log.childElementCount > 200) this.log.lastElementChild.remove();
  }

  // Primitives may be called otherwise by now.
  rename() {
    for (const item of this.log.children) set(item.lastElementChild, this.text(item.dataset.text));
  }

  // A text with the names of primitives in it; two braces are one that stands for none.
  text(text) { return text.replace(/\{\{|\{(\d+)\}/g, (_, id) => (id === undefined ? "{" : apart(this.label(Number(id))))); }
}

// A name within a text: where it is written from right to left, the rest stays where it was.
export function apart(name) {
  return /[\u0590-\u08ff\u200f\u202a-\u202e\u2066-\u2069\ufb1d-\ufdff\ufe70-\ufeff]/.test(name) ? `\u2068${name.replace(/[\u2066-\u2069]/g, "")}\u2069` : name;
}

export function set(node, text) { if (node.textContent !== text) node.textContent = text; }

export function clock(seconds) {
  if (!seconds) return "";
  const s = Math.floor(seconds % 60), m = Math.floor(seconds / 60) % 60, h = Math.floor(seconds / 3600);
  return `${h ? `${h}:${String(m).padStart(2, "0")}` : m}:${String(s).padStart(2, "0")}`;
}
