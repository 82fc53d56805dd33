// The page: what was heard from the server, shown; what the teacher asks, sent.

import { Card } from "./card.js";
import { Graph } from "./graph.js";
import { Link } from "./link.js";
import { element, set, Side } from "./side.js";
import { Stage } from "./stage.js";
import { Stream } from "./stream.js";
import { Tree } from "./tree.js";

const find = (selector) => document.querySelector(selector);
const root = document.documentElement;

const world = {
  primitives: new Map(), names: new Map(), edges: [], nodes: [], waiting: null, revision: -1,
  forecast: [], segments: [], status: {}, robot: {}, processes: {}, stream: null,
  chosen: null, present: null, paused: false,
};
const label = (id) => world.primitives.get(id)?.name ?? world.names.get(id) ?? (id == null ? "something new" : `P${id}`);

const stage = new Stage(find("#stage canvas"));
const stream = new Stream(find("#stream canvas"));
const tree = new Tree(find("#tree svg"), choose);
const graph = new Graph(find("#graph svg"), choose);
const side = new Side(find("#side"), label);
const link = new Link(heard);
const card = new Card(find("#card"), { world, label, ask, choose, pick, text: (t) => side.text(t) });

// ---- what is heard

function heard(message) {
  if (message.kind !== "tick" && message.kind !== "status") wake();
  switch (message.kind) {
    case "open": find("#lost").hidden = true; break;
    case "closed": lost(message.code); break;
    case "tick":
      if (stage.pose("person", message.person) + stage.pose("robot", message.robot) + message.n > 0) wake();
      stream.take(message);
      break;
    case "clip": if (message.ref === asked) { stage.show(message); root.dataset.shown = asked; } break;
    case "bodies": stage.setBodies(message); if (message.robot.length) root.dataset.figures = "there"; break;
    case "stream": begin(message); break;
    case "knowledge": learn(message); break;
    case "forecast": world.forecast = message.next; present(); break;
    case "status": world.status = message; status(); break;
    case "robot": world.robot = message; robot(); break;
    case "processes": world.processes = message; status(); robot(); break;
    case "past":
      world.segments = message.segments;
      stream.segments = world.segments;
      side.log.replaceChildren();
      side.tell(message.events);
      present();
      break;
    case "segment":
      world.segments.push(message);
      if (world.segments.length > 80) world.segments.shift();
      present();
      break;
    case "event": side.tell([message]); break;
    default: break;
  }
}

function lost(code) {
  const bar = find("#lost");
  bar.textContent = code === 4403 || code === 1006 && !world.stream && performance.now() > 4000
    ? "This page may not look on: open the address that was printed when it was started."
    : "The connection is lost; trying again …";
  bar.hidden = false;
}

function begin(message) {
  if (world.stream && JSON.stringify(world.stream) === JSON.stringify(message)) return;
  world.stream = message;
  world.segments = [];
  stream.reset(message);
  stream.segments = world.segments;
}

function learn({ primitives, nodes, edges, waiting, revision }) {
  world.primitives = new Map(primitives.map((p) => [p.id, p]));
  for (const p of primitives) world.names.set(p.id, p.name);
  Object.assign(world, { nodes, edges, waiting, revision });
  if (world.chosen !== null && !world.primitives.has(world.chosen)) choose(null);
  if (world.chosen !== null) stage.captions.shown = label(world.chosen);
  tree.set(nodes, world.primitives);
  graph.set(world.primitives, edges);
  side.learning(world.primitives, waiting);
  side.rename();
  card.update();
  present();
  pressed();
  root.dataset.primitives = primitives.length;
}

// What is present is the last motion, if it was recognised.
function present() {
  stream.forecast = world.forecast;
  const moved = world.segments.findLast((s) => s.state !== "still");
  const last = world.segments[world.segments.length - 1];
  const id = moved?.primitive ?? null;
  world.present = id !== null && world.primitives.has(id) ? id : null;
  if (!moved) side.now({ text: world.stream ? "watching" : "waiting", lit: false, why: world.stream ? "no motion has ended yet" : world.status.state ?? "" });
  else if (id !== null) {
    const still = last.state === "still";
    side.now({ text: label(id), lit: true, why: still ? "and stands still since" : moved.state === "new" ? "seen often enough to be a primitive now" : "" });
  } else side.now({ text: "not recognised", lit: false, why: side.text(moved.why) });
  mark();
}

function mark() {
  const next = world.forecast[0]?.id ?? null, matched = matches();
  tree.mark(world);
  graph.mark({ present: world.present, chosen: world.chosen, next, matched });
}

function matches() {
  const wanted = find("#search").value.trim().toLowerCase();
  if (!wanted) return null;
  return new Set([...world.primitives.values()].filter((p) => p.name.toLowerCase().includes(wanted) || String(p.id) === wanted).map((p) => p.id));
}

function status() {
  const s = world.status, p = world.processes;
  const stopped = p.learner === "stopped" || p.learner === "starting";
  set(find("#state .source"), stopped ? "" : s.source ?? "");
  set(find("#state .doing"), stopped ? `the learner is ${p.learner}` : ` — ${s.paused ? "learning is paused" : s.state ?? "starting"}`);
  root.dataset.frames = s.frames;
  find("#state").dataset.live = !stopped && s.state === "live" && !s.paused ? "yes" : "no";
  undoable(s);
  world.paused = Boolean(s.paused);
  set(find("#pause"), world.paused ? "Resume" : "Pause");
  find("#pause").classList.toggle("main", world.paused);
  const faults = Object.entries(s.faults ?? {}).map(([name, n]) => `${n} ${name}`).join(", ");
  figures([
    ["", s.person ? `person ${s.person}${s.people > 1 ? ` of ${s.people}` : ""}` : "nobody yet", ""],
    ["rate", s.rate_hz ? `${s.rate_hz.toFixed(0)} Hz` : "–", ""],
    ["delay", s.delay_ms == null ? "–" : `${s.delay_ms.toFixed(0)} ms`, s.delay_99_ms == null ? "" : `99 of 100 within ${s.delay_99_ms.toFixed(0)} ms`, s.delay_ms > 100],
    ["lost", `${s.lost ?? 0}`, faults || "nothing was lost", s.lost > 0],
    ...(s.problem ? [["store", "not kept", s.problem, true]] : []),
    ...(s.behind_s > 0.3 ? [["waiting", `${s.behind_s.toFixed(1)} s of motion`, "the learner is slower than the stream; nothing is dropped", true]] : []),
    ...(p.clients > 1 ? [["", `${p.clients} look on`, ""]] : []),
  ]);
  stage.captions.person = s.person ? `person ${s.person}` : "";
  if (!world.stream) present();
}

// Only what can be undone, by whoever did it, can be asked to be.
function undoable({ undoable: list = [], redoable = [], entry = 0 }) {
  find("#undo").disabled = !list.length;
  find("#redo").disabled = !redoable.length;
  for (const box of document.querySelectorAll("#notes [data-entry]")) {
    const number = Number(box.dataset.entry);
    if (number && number <= entry && !list.includes(number)) box.querySelector("button")?.remove();
  }
}

function figures(list) {
  const box = find("#figures");
  while (box.childElementCount > list.length) box.lastElementChild.remove();
  list.forEach(([name, value, title, odd], k) => {
    const item = box.children[k] ?? box.appendChild(element("div", {}, element("dt"), element("dd")));
    set(item.children[0], name);
    set(item.children[1], value);
    item.title = title;
    item.classList.toggle("odd", Boolean(odd));
  });
}

function robot() {
  const r = world.robot, state = world.processes.robot;
  let text = "robot", left = "";
  if (state === "none") text = "no robot";
  else if (state === "stopped") text = "robot: starting again";
  else if (r.primitive != null) { text = label(r.primitive); left = r.left ? `, ${r.left} more` : ""; }
  else if (r.cannot) text = "robot: cannot perform this";
  else if (r.left) text = "robot: planning";
  stage.captions.robot = text;
  stage.captions.left = left;
  root.dataset.robot = r.primitive ?? "";
  find("#stop").disabled = r.primitive == null && !r.left;
  find("#walk").disabled = state === "none" || Boolean(r.cannot);
}

// ---- what is asked

let asked = null;      // number of the request for the figure that is shown
let picking = null;    // what to do with the next primitive that is chosen
let question = null;   // the note that asks for it

async function ask(what, values, { quiet = false, undo = false } = {}) {
  const reply = await link.ask(what, values);
  if (!reply.ok) note(side.text(reply.text));
  else if (!quiet) note(side.text(reply.text), undo ? ["Undo", () => ask("undo", { entry: reply.entry })] : null).dataset.entry = undo ? reply.entry : "";
  return reply;
}

function choose(id) {
  if (picking && id !== null) { const take = picking; pick(null); take(id); return; }
  world.chosen = id;
  stage.captions.shown = id === null ? "" : label(id);
  if (id === null) { asked = null; stage.show(null); } else show(id);
  card.open(id);
  find("#log").hidden = id !== null && window.innerHeight < 900;
  mark();
}

// Let figure and robot perform a primitive.
function show(id) {
  asked = link.ref;
  link.ask("show", { id }).then((reply) => { if (!reply.ok) note(side.text(reply.text)); });
  if (world.processes.robot !== "none") link.ask("perform", { id });
}

// Let the next primitive that is chosen be the answer to a question.
function pick(take, text) {
  picking = take;
  root.classList.toggle("choosing", Boolean(take));
  question?.remove();
  question = take ? note(text, ["Cancel", () => pick(null)], Infinity) : null;
}

function note(text, action = null, lasts = 4500) {
  const box = element("div", {}, element("span", { textContent: text }));
  if (action) box.append(element("button", { textContent: action[0], onclick: () => { box.remove(); action[1](); } }));
  const notes = find("#notes");
  notes.append(box);
  while (notes.childElementCount > 3) notes.firstElementChild.remove();
  if (lasts < Infinity) setTimeout(() => box.remove(), lasts);
  return box;
}

// ---- keys and buttons

const search = find("#search");
const does = {
  pause: () => ask(world.paused ? "resume" : "pause", {}),
  undo: () => ask("undo", {}),
  redo: () => ask("redo", {}),
  walk: () => ask("walk", { length: Number(find("#length").value) || 8 }),
  stop: () => ask("stop", {}),
  screen: () => { root.classList.toggle("screen"); remember("screen", root.classList.contains("screen") ? "yes" : ""); resized(); },
  theme: () => themed(root.dataset.theme === "dark" ? "light" : "dark", true),
  whole: () => around("whole"),
  around: () => around("around"),
  fold: () => tree.foldAll(),
  help: () => find("#keys").showModal(),
};
for (const [id, act] of Object.entries(does)) find(`#${id}`).addEventListener("click", act);
search.addEventListener("input", () => searched(search.value));
search.addEventListener("keydown", (e) => {
  if (e.key !== "Enter") return;
  const first = matches()?.values().next().value;
  if (first !== undefined) choose(first);
});

function searched(text) {
  if (search.value !== text) search.value = text;
  tree.search(text);
  mark();
}

// Do something with the chosen primitive; where none is (another teacher may have merged it), say so.
const chosen = (what) => (world.chosen === null ? note("Choose a primitive first, in tree or graph.") : card.does(what));

const KEYS = [
  ["/", "search a primitive", () => { search.focus(); search.select(); }],
  ["P", "pause or resume learning", does.pause],
  ["U", "undo", does.undo],
  ["R", "do again what was undone", does.redo],
  ["N", "name the chosen primitive", () => chosen("name")],
  ["S", "show it once more", () => world.chosen !== null && show(world.chosen)],
  ["M", "this and another are one", () => chosen("merge")],
  ["D", "this is two", () => chosen("split")],
  ["Delete", "forget this", () => chosen("forget")],
  ["W", "let the robot walk", does.walk],
  ["O", "let the robot go to the chosen one", () => chosen("path")],
  ["X", "stop the robot", does.stop],
  ["G", "the whole graph, or around one", () => around(graph.around ? "whole" : "around")],
  ["L", "go to the tree", () => find("#tree [tabindex='0']")?.focus()],
  ["F", "screen mode, to be read from afar", does.screen],
  ["T", "light or dark", does.theme],
  ["?", "these keys", does.help],
  ["Escape", "let go of the chosen one", () => (picking ? pick(null) : choose(null))],
];
for (const [key, text] of KEYS) {
  find("#keys dl").append(element("dt", {}, element("kbd", { textContent: key })), element("dd", { textContent: text }));
}
addEventListener("keydown", (e) => {
  const typing = e.target.closest?.("input, textarea");
  if (e.key === "Escape" && typing) { typing.blur(); if (typing === search) searched(""); return; }
  if (typing || find("#keys").open) return;
  if ((e.ctrlKey || e.metaKey) && e.key.toLowerCase() === "z") { (e.shiftKey ? does.redo : does.undo)(); e.preventDefault(); return; }
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  const found = KEYS.find(([key]) => key.toLowerCase() === e.key.toLowerCase());
  if (found) { e.preventDefault(); found[2](); }
});

function around(mode) {
  graph.setMode(mode);
  pressed();
}

function pressed() {
  find("#whole").setAttribute("aria-pressed", !graph.around);
  find("#around").setAttribute("aria-pressed", graph.around);
}

function themed(theme, keep) {
  root.dataset.theme = theme;
  set(find("#theme"), theme === "dark" ? "Light" : "Dark");
  if (keep) remember("theme", theme);
  colours = null;
}

function remember(name, value) { localStorage.setItem(name, value); }

function resized() {
  colours = null;
  tree.draw();
  side.fit();
  graph.stale = true;
}

// ---- drawing

let colours = null;
function style() {
  if (colours) return colours;
  const read = getComputedStyle(root), value = (name) => read.getPropertyValue(name).trim();
  const size = parseFloat(getComputedStyle(find("#state")).fontSize);
  return (colours = {
    ink: value("--ink"), soft: value("--soft"), line: value("--line"), pale: value("--pale"), panel: value("--panel"),
    accent: value("--accent"), onAccent: value("--on-accent"), size, font: getComputedStyle(document.body).fontFamily,
  });
}

// While nothing moves, comes or is touched, a few pictures a second do.
const AWAKE = 2000, IDLE = 250;   // ms
let awake = performance.now(), painted = 0;
function wake() { awake = performance.now(); }
for (const kind of ["pointerdown", "pointermove", "wheel", "keydown", "input", "focusin", "resize"]) {
  addEventListener(kind, wake, { capture: true, passive: true });
}

let frames = 0, since = performance.now();
function draw(now) {
  requestAnimationFrame(draw);
  if (now - awake > AWAKE && !stage.shown && now - painted < IDLE) return;
  painted = now;
  frames++;
  if (now - since > 1000) {
    root.dataset.fps = ((1000 * frames) / (now - since)).toFixed(1);
    frames = 0;
    since = now;
    pressed();
  }
  stage.draw(root.dataset.theme, style());
  stream.draw(style(), label);
  if (graph.draw()) wake();
  side.coming(world.forecast, (frame) => stream.seconds(frame) - stream.now);
}

const wished = localStorage.getItem("theme") || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
themed(wished, false);
if (localStorage.getItem("screen")) root.classList.add("screen");
addEventListener("resize", resized);
new ResizeObserver(resized).observe(find("#tree .scroll"));
requestAnimationFrame(draw);
