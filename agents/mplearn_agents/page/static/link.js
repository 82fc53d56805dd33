// The socket to the page server: messages in, requests out, opened again when it is lost.

const TICK = 1, CLIP = 2;
const SOONEST = 400, LATEST = 5000;

export class Link {
  constructor(heard) {
    this.heard = heard;
    this.pause = SOONEST;
    this.ref = 1;
    this.waiting = new Map();
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(`${scheme}//${location.host}/socket`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => { this.pause = SOONEST; this.heard({ kind: "open" }); };
    this.socket.onmessage = ({ data }) => this.take(data);
    this.socket.onclose = ({ code }) => {
      for (const answer of this.waiting.values()) answer({ ok: false, text: "the connection was lost" });
      this.waiting.clear();
      this.heard({ kind: "closed", code });
      setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(2 * this.pause, LATEST);
    };
  }

  // Ask for something; resolves to the reply.
  ask(what, values = {}) {
    const ref = this.ref++;
    if (this.socket.readyState !== WebSocket.OPEN) {
      return Promise.resolve({ ok: false, text: "there is no connection", ref });
    }
    this.socket.send(JSON.stringify({ do: what, ref, by: localStorage.getItem("name") ?? "", ...values }));
    return new Promise((resolve) => this.waiting.set(ref, (reply) => resolve({ ref, ...reply })));
  }

  take(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      if (message.kind === "reply") {
        this.waiting.get(message.ref)?.(message);
        this.waiting.delete(message.ref);
      }
      this.heard(message);
      return;
    }
    const view = new DataView(data);
    if (view.getUint8(0) === TICK) this.heard(tick(data, view));
    else if (view.getUint8(0) === CLIP) this.heard(clip(data, view));
  }
}

function tick(data, view) {
  const [person, robot, width] = [2, 4, 6].map((at) => view.getUint16(at, true));
  const first = view.getUint32(8, true), n = view.getUint32(12, true);
  let at = 16;
  const next = (count) => {
    const part = new Float32Array(data, at, count);
    at += 4 * count;
    return part;
  };
  return { kind: "tick", person: next(7 * person), robot: next(7 * robot), first, n, width, rows: next(n * width) };
}

function clip(data, view) {
  const bodies = view.getUint16(2, true), ref = view.getUint32(4, true);
  const rate = view.getFloat32(8, true), n = view.getUint32(12, true);
  let at = 16 + 4 * n;
  const motions = [];
  for (let k = 0; k < n; k++) {
    const length = view.getUint32(16 + 4 * k, true);
    motions.push({ length, poses: new Float32Array(data, at, length * bodies * 7) });
    at += length * bodies * 28;
  }
  return { kind: "clip", ref, rate, bodies, motions };
}
