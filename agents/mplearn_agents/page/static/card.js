// The card of the primitive that was chosen: what is known of it, and what a teacher can say to it.

import { apart, element } from "./side.js";

const MOST = 6; // followers that are named

export class Card {
  constructor(root, page) {
    this.root = root;
    this.body = root.querySelector(".body");
    this.page = page;
    this.id = null;
  }

  open(id) {
    this.id = id;
    this.looks = null;
    this.root.hidden = id === null;
    this.update();
  }

  update() {
    const { world, label } = this.page, primitive = world.primitives.get(this.id);
    if (!primitive) return;
    const { activeElement } = document, typing = this.body.contains(activeElement) && activeElement.tagName === "INPUT";
    const looks = `${this.id} ${primitive.name} ${primitive.frozen}`;
    if (!typing && looks !== this.looks) { this.looks = looks; this.build(primitive); }
    const facts = `shown ${primitive.n} times, ${primitive.duration_s.toFixed(1)} s`;
    this.facts.textContent = primitive.of ? `${facts}; ${primitive.n} of ${primitive.of} until it is sure` : facts;
    const after = world.edges.filter((e) => e[0] === this.id).sort((a, b) => b[3] - a[3]).slice(0, MOST);
    this.after.replaceChildren(after.length ? "then " : "nothing was seen to follow it yet");
    after.forEach(([, to, , p], k) => {
      const go = element("button", { textContent: label(to), onclick: () => this.page.choose(to) });
      this.after.append(k ? ", " : "", go, ` ${p.toFixed(2)}`);
    });
  }

  build(primitive) {
    this.input = element("input", { value: primitive.name, maxLength: 80, title: `${primitive.name}: type another name (N)`, ariaLabel: "name", spellcheck: false });
    this.input.addEventListener("keydown", (e) => { if (e.key === "Enter") this.input.blur(); if (e.key === "Escape") this.input.value = primitive.name; });
    this.input.addEventListener("blur", () => this.name(this.input.value));
    this.facts = element("p", { className: "facts" });
    this.after = element("p", { className: "after" });
    const button = (name, text, title) => {
      const made = element("button", { textContent: text, title, onclick: () => this.does(name) });
      made.dataset.does = name;
      return made;
    };
    const close = element("button", { textContent: "×", title: "let go of it (Esc)", ariaLabel: "close", onclick: () => this.page.choose(null) });
    this.body.replaceChildren(
      element("div", { className: "head" }, this.input, close),
      this.facts,
      element("div", { className: "row" }, button("show", "Show", "see it once more (S)"), button("path", "Robot: go there", "by a path on the graph (O)")),
      element("div", { className: "row" },
        button("merge", "Same as …", "these two are one (M)"), button("split", "This is two", "(D)"), button("forget", "Forget", "(Delete)")),
      element("div", { className: "row" },
        button("freeze", primitive.frozen ? "Let it change" : "Keep as it is", "whatever comes"), button("note", "Note …", "write something down"), button("history", "History", "what happened to it, and who did it")),
      this.after,
      this.past = element("ol", { className: "past" }),
    );
  }

  name(text) {
    const { world, ask } = this.page, known = world.primitives.get(this.id)?.name;
    if (text.trim() && text.trim() !== known) ask("rename", { id: this.id, name: text }, { undo: true });
    else if (known) this.input.value = known;
  }

  // Let the teacher write something down.
  note(id) {
    const input = element("input", { maxLength: 1000, placeholder: `a note on ${this.page.label(id)}`, ariaLabel: "note" });
    input.addEventListener("keydown", (e) => {
      if (e.key === "Enter" && input.value.trim()) { this.page.ask("note", { id, text: input.value }, { undo: true }); this.history(id); }
    });
    this.past.replaceChildren(element("li", {}, input));
    input.focus();
  }

  // Show what happened to a primitive.
  async history(id) {
    const reply = await this.page.ask("history", { id }, { quiet: true });
    if (!reply.ok || this.id !== id) return;
    this.past.replaceChildren(...reply.lines.reverse().map(({ when, text }) => element("li", {},
      element("time", { textContent: new Date(1000 * when).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" }) }), " ",
      element("span", { textContent: this.page.text(text) }))));
  }

  does(what) {
    const { ask, pick, label, choose } = this.page, id = this.id;
    if (id === null) return;
    switch (what) {
      case "name": this.input.focus(); this.input.select(); break;
      case "show": choose(id); break;
      case "path": ask("path", { id }); break;
      case "merge": pick((other) => ask("merge", { id, other }, { undo: true }), `Which one is the same as ${apart(label(id))}? Choose it in tree or graph.`); break;
      case "split": ask("split", { id }, { undo: true }); break;
      case "freeze": ask(this.page.world.primitives.get(id)?.frozen ? "unfreeze" : "freeze", { id }, { undo: true }); break;
      case "note": this.note(id); break;
      case "history": this.history(id); break;
      case "forget": ask("forget", { id }, { undo: true }); break;
      default: break;
    }
  }
}
