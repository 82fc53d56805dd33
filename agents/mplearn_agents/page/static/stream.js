// The last ten seconds: channels run by from right to left, with cuts, what was recognised, and what
// comes next. What was drawn is moved, not drawn again: a ring of pixels holds it.

import { clipped, fitted } from "./stage.js";

const PAST = 10, COMING = 2.2;   // seconds
const ROWS = 2048;
const TOGETHER = 3;              // rows that are drawn at once
const LANES = [
  ["trunk", (n) => /^(base|lumbar|thorax|neck|waist)/.test(n)],
  ["left arm", (n) => /^(clavicle|shoulder|elbow|forearm|wrist).*_l$/.test(n)],
  ["right arm", (n) => /^(clavicle|shoulder|elbow|forearm|wrist).*_r$/.test(n)],
  ["left leg", (n) => /^(hip|knee|ankle|toe).*_l$/.test(n)],
  ["right leg", (n) => /^(hip|knee|ankle|toe).*_r$/.test(n)],
];

export class Stream {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false }); // cheaper to put on the page
    this.ring = document.createElement("canvas");
    this.ink = this.ring.getContext("2d");
    this.segments = [];
    this.forecast = [];
    this.reset({ channels: [], rate_hz: 100, stride: 2, frame: 0 });
  }

  reset({ channels, rate_hz, stride, frame }) {
    this.rate = rate_hz / stride;
    this.frameRate = rate_hz;
    this.stride = stride;
    this.firstFrame = frame;
    this.width = channels.length;
    this.rows = new Float32Array(ROWS * this.width);
    this.n = 0;            // rows seen
    this.from = 0;         // first row that is kept
    this.drawn = 0;        // first row that is not drawn yet
    this.segments = [];
    this.forecast = [];
    this.clock = null;     // which row came when: [s of the stream], on the page's clock [s]
    this.lanes = lanesOf(channels);
    this.low = new Float32Array(this.width).fill(Infinity);
    this.high = new Float32Array(this.width).fill(-Infinity);
    this.centre = new Float32Array(this.width);
    this.spans = this.lanes.map(() => 0);
    this.stale = true;
  }

  take({ first, n, width, rows }) {
    if (!n || width !== this.width) return;
    if (first !== this.n) { this.from = first; this.drawn = first; this.stale = true; this.clock = null; }
    for (let k = 0; k < n; k++) {
      const at = ((first + k) % ROWS) * width;
      for (let d = 0; d < width; d++) {
        const value = rows[k * width + d];
        this.rows[at + d] = value;
        if (value < this.low[d]) this.low[d] = value;
        if (value > this.high[d]) this.high[d] = value;
      }
    }
    this.n = first + n;
    this.tell(performance.now() / 1000, this.n / this.rate);
  }

  // Learn how the stream's time goes by on the page's clock, so that it runs by evenly.
  tell(page, stream) {
    const clock = this.clock;
    if (!clock || Math.abs(this.now - stream) > Math.max(0.6, 0.3 * clock.pace)) {
      this.clock = { page, stream, pace: clock?.pace ?? 1, past: [[page, stream]] };
      return;
    }
    clock.past.push([page, stream]);
    while (page - clock.past[0][0] > 3) clock.past.shift();
    const [page0, stream0] = clock.past[0];
    const error = stream - this.now;
    clock.stream = this.now + 0.05 * error;
    clock.page = page;
    if (page - page0 > 0.7) clock.pace += 0.1 * ((stream - stream0) / (page - page0) - clock.pace);
  }

  // Time of the stream that should be seen now [s]; it stands still where nothing comes.
  get now() {
    if (!this.clock) return 0;
    const { page, stream, pace } = this.clock;
    return stream + Math.min(performance.now() / 1000 - page, 0.4) * pace;
  }

  seconds(frame) { return (frame - this.firstFrame) / this.frameRate; }

  draw(style, label) {
    const c = this.context, { width, height, ratio } = fitted(this.canvas, c);
    c.fillStyle = style.panel;
    c.fillRect(0, 0, width, height);
    const font = parseFloat(style.size);
    if (!this.width || width < 50) {
      c.font = `${font}px ${style.font}`;
      c.fillStyle = style.soft;
      c.textAlign = "left";
      c.textBaseline = "top";
      c.fillText("what is seen runs by here", 2, 12);
      return;
    }
    const strip = Math.round(font * 2.5), left = 0;
    const perSecond = (width - left) / (PAST + COMING);
    const nowX = left + PAST * perSecond, lanesHeight = height - strip - 6;
    const now = Math.max(this.now, 0), x = (s) => nowX + (s - now) * perSecond;
    this.lines(lanesHeight, perSecond, ratio, style);
    const shift = (now - this.drawn / this.rate) * perSecond; // how far the newest drawn row lies back
    this.blit(c, nowX - shift, nowX, lanesHeight, ratio);
    c.font = `${Math.round(font * 0.85)}px ${style.font}`;
    c.textAlign = "left";
    c.textBaseline = "top";
    const each = lanesHeight / this.lanes.length;
    this.lanes.forEach(({ name }, k) => {
      if (k) line(c, 0, k * each, width, k * each, style.line, 1);
      const w = c.measureText(name).width;
      c.globalAlpha = 0.85; c.fillStyle = style.panel; c.fillRect(0, k * each + 3, w + 8, font * 1.2); c.globalAlpha = 1;
      c.fillStyle = style.soft;
      c.fillText(name, 2, k * each + 4);
    });
    this.strip(x, now, nowX, lanesHeight + 6, strip, style, label, font);
    line(c, nowX, 0, nowX, height, style.accent, 1.5);
  }

  strip(x, now, nowX, top, strip, style, label, font) {
    const c = this.context;
    c.textBaseline = "middle";
    let end = null;
    for (const segment of this.segments) {
      const a = Math.max(x(this.seconds(segment.start)), -4), b = x(this.seconds(segment.end));
      end = this.seconds(segment.end);
      if (b < 0) continue;
      line(c, b, 0, b, top - 6, style.line, 1.2);
      if (segment.state === "still") {
        line(c, a + 3, top + strip / 2, b - 3, top + strip / 2, style.line, 2);
        continue;
      }
      const last = segment === this.segments.findLast((s) => s.primitive !== null);
      const known = segment.primitive !== null;
      box(c, a + 1, top, b - a - 2, strip, 6);
      c.fillStyle = known ? (last ? style.accent : style.pale) : style.panel;
      c.fill();
      c.setLineDash(known ? [] : [4, 4]);
      c.lineWidth = 1;
      c.strokeStyle = known ? (last ? style.accent : style.line) : style.soft;
      c.stroke();
      c.setLineDash([]);
      c.fillStyle = known ? (last ? style.onAccent : style.ink) : style.soft;
      c.textAlign = "left";
      const text = known ? label(segment.primitive) : "not recognised";
      words(c, text, Math.max(a, 0) + 6, top + strip / 2 + 1, b - Math.max(a, 0) - 10, font, style.font, known ? 600 : 400);
    }
    if (end !== null && end < now) { // what goes on now
      const a = Math.max(x(end), 0);
      box(c, a + 1, top, Math.max(nowX - a - 2, 1), strip, 6);
      c.globalAlpha = 0.5; c.fillStyle = style.pale; c.fill(); c.globalAlpha = 1;
    }
    const next = this.forecast[0];
    if (next?.frame != null && this.seconds(next.frame) > now - 1.5) {
      const a = Math.max(x(this.seconds(next.frame)), nowX + 4);
      box(c, a, top, Math.max(this.canvas.clientWidth - a + 20, 10), strip, 6);
      c.setLineDash([4, 4]);
      c.strokeStyle = style.accent;
      c.lineWidth = 1.2;
      c.stroke();
      c.setLineDash([]);
      c.fillStyle = style.accent;
      words(c, `${label(next.id)} ${next.p.toFixed(2)}`, a + 7, top + strip / 2 + 1, this.canvas.clientWidth - a - 10, font, style.font, 600);
    }
  }

  // Draw the rows that came into the ring; everything where scales have changed.
  lines(height, perSecond, ratio, style) {
    const w = Math.ceil((PAST + 1.5) * perSecond * ratio), h = Math.max(1, Math.round(height * ratio));
    const step = (perSecond * ratio) / this.rate, key = `${w} ${h} ${style.ink} ${step}`;
    this.step = step;
    if (this.key !== key) { this.key = key; this.ring.width = w; this.ring.height = h; this.stale = true; }
    this.rescale();
    if (this.stale) {
      this.stale = false;
      this.ink.clearRect(0, 0, w, h);
      this.drawn = Math.max(this.from, this.n - Math.floor((PAST + 1) * this.rate), this.n - ROWS + 1);
    }
    if (this.n - this.drawn < TOGETHER) return;
    const c = this.ink, laneHeight = h / this.lanes.length;
    const begin = Math.max(this.drawn - 1, this.from), x0 = (begin * step) % w;
    const span = (this.n - 1 - begin) * step;
    for (const wrap of [0, -w]) { // what crosses the ring's end is drawn at its beginning, too
      c.clearRect(x0 + wrap + 0.5, 0, span + 0.35 * perSecond * ratio, h);
    }
    c.lineWidth = Math.max(1, 0.9 * ratio);
    c.strokeStyle = style.ink;
    c.globalAlpha = 0.55;
    this.lanes.forEach(({ channels }, k) => {
      const middle = (k + 0.5) * laneHeight, gain = (0.84 * laneHeight) / (this.spans[k] || 1);
      for (const wrap of x0 + span > w ? [0, -w] : [0]) {
        c.beginPath();
        for (const d of channels) {
          const centre = this.centre[d];
          let open = false;
          for (let r = begin; r < this.n; r++) {
            const value = this.rows[(r % ROWS) * this.width + d];
            if (Number.isNaN(value)) { open = false; continue; }
            const px = x0 + (r - begin) * step + wrap, py = middle - (value - centre) * gain;
            if (open) c.lineTo(px, py); else c.moveTo(px, py);
            open = true;
          }
        }
        c.stroke();
      }
    });
    c.globalAlpha = 1;
    this.drawn = this.n;
  }

  // Copy the ring so that its newest row lies at x, and nothing beyond `limit`; pixel by pixel,
  // for anything between them would be worked out anew in every frame.
  blit(c, x, limit, height, ratio) {
    const w = this.ring.width, h = this.ring.height;
    const newest = (Math.max(this.drawn - 1, 0) * this.step) % w, at = Math.min(Math.ceil(newest), w);
    const end = at + Math.round(x * ratio - newest), long = Math.max(Math.min(end, w), 0);
    c.save();
    c.beginPath();
    c.rect(0, 0, limit, height);
    c.clip();
    const first = Math.min(at, long);
    c.setTransform(1, 0, 0, 1, 0, 0);
    if (first > 0) c.drawImage(this.ring, at - first, 0, first, h, end - first, 0, first, h);
    const rest = Math.floor(Math.min(long - first, w - at - 0.3 * this.step * this.rate));
    if (rest > 0) c.drawImage(this.ring, w - rest, 0, rest, h, end - first - rest, 0, rest, h);
    c.restore();
  }

  // See that all fits its lane: scales grow in steps, for with each all is drawn again.
  rescale() {
    this.lanes.forEach(({ channels }, k) => {
      let most = 1e-6, moved = 0;
      for (const d of channels) {
        if (!(this.high[d] >= this.low[d])) continue;
        most = Math.max(most, this.high[d] - this.low[d]);
        moved = Math.max(moved, Math.abs((this.low[d] + this.high[d]) / 2 - this.centre[d]));
      }
      if (most <= this.spans[k] && moved <= 0.12 * this.spans[k]) return;
      this.spans[k] = Math.max(this.spans[k], 1.25 * most);
      for (const d of channels) if (this.high[d] >= this.low[d]) this.centre[d] = (this.low[d] + this.high[d]) / 2;
      this.stale = true;
    });
  }
}

function lanesOf(channels) {
  const lanes = LANES.map(([name, is]) => ({ name, channels: channels.flatMap((n, d) => (is(n) ? [d] : [])) }));
  const held = lanes.reduce((n, lane) => n + lane.channels.length, 0);
  if (held && held === channels.length) return lanes.filter((lane) => lane.channels.length);
  const n = Math.min(5, channels.length), out = [];
  for (let k = 0; k < n; k++) {
    const a = Math.floor((k * channels.length) / n), b = Math.floor(((k + 1) * channels.length) / n);
    const name = b - a > 1 ? `${channels[a]} … ${channels[b - 1]}` : channels[a];
    out.push({ name, channels: Array.from({ length: b - a }, (_, i) => a + i) });
  }
  return out;
}

// Write a text in a box: in one line, or in two smaller ones, shortened where it must be.
function words(c, text, x, y, width, size, family, weight) {
  if (width < 14) return;
  c.font = `${weight} ${size}px ${family}`;
  if (c.measureText(text).width <= width || !text.includes(" ")) { c.fillText(clipped(c, text, width), x, y); return; }
  let [first, rest] = ["", ""];
  for (const scale of [0.84, 0.72]) { // smaller before it is cut
    c.font = `${weight} ${scale * size}px ${family}`;
    [first, rest] = halves(c, text, width);
    if (Math.max(c.measureText(first).width, c.measureText(rest).width) <= width) break;
  }
  c.fillText(clipped(c, first, width), x, y - 0.55 * size);
  c.fillText(clipped(c, rest, width), x, y + 0.5 * size);
}

// Parts of a text in two lines: how it begins, and how it ends, which tells more than its middle.
function halves(c, text, width) {
  const parts = text.split(" ");
  let first = parts.shift();
  while (parts.length > 1 && c.measureText(`${first} ${parts[0]}`).width <= width) first += ` ${parts.shift()}`;
  let rest = parts.join(" ");
  while (parts.length > 1 && c.measureText(rest).width > width) { parts.shift(); rest = parts.join(" "); }
  return [first, rest];
}

function line(c, x1, y1, x2, y2, colour, width) {
  c.beginPath();
  c.moveTo(x1, y1);
  c.lineTo(x2, y2);
  c.lineWidth = width;
  c.strokeStyle = colour;
  c.stroke();
}

function box(c, x, y, w, h, r) {
  c.beginPath();
  c.roundRect(x, y, Math.max(w, 0), h, Math.min(r, Math.max(w, 0) / 2));
}
