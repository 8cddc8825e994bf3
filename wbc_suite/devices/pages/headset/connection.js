// The socket to the robot: frames out, poses and texts in. It reconnects by itself.

const RETRY = 250;  // ms
const CHECK = 300;  // ms; the server sends at least ten times a second
// Checks without a message. They are counted, not timed: neither runs while the page draws.
const SILENCE = 10, ATTEMPT = 5;  // once connected, and before
const MAX_WAITING = 16384;  // bytes; a frame that would wait behind them is dropped

export class Connection {
  /** `onPoses(Float32Array)`, `onStatus(object)` and `onChange(connected)` are called. */
  constructor({ onPoses, onStatus, onChange }) {
    this.onPoses = onPoses;
    this.onStatus = onStatus;
    this.onChange = onChange;
    this.connected = false;
    this.open();
    setInterval(() => this.check(), CHECK);
  }

  open() {
    const socket = new WebSocket(location.origin.replace("http", "ws") + "/frames");
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.silent = 0;
    let ended = false;
    const end = () => {
      if (ended) return;
      ended = true;
      this.change(false);
      if (this.socket === socket) setTimeout(() => this.open(), RETRY);
    };
    socket.onopen = () => this.change(true);
    socket.onclose = end;
    socket.end = end;
    socket.onmessage = event => {
      this.silent = 0;
      if (typeof event.data === "string") this.onStatus(JSON.parse(event.data));
      else this.onPoses(new Float32Array(event.data));
    };
  }

  // A network that is gone closes no socket: silence tells.
  check() {
    this.silent += 1;
    if (this.silent < (this.connected ? SILENCE : ATTEMPT)) return;
    this.silent = 0;
    const lost = this.socket;
    lost.close();
    lost.end();
  }

  change(connected) {
    if (this.connected === connected) return;
    this.connected = connected;
    this.onChange(connected);
  }

  send(frame) {
    const ready = this.socket.readyState === WebSocket.OPEN;
    if (ready && this.socket.bufferedAmount < MAX_WAITING) this.socket.send(JSON.stringify(frame));
  }
}
