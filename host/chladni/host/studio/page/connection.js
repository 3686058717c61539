// The wire to the server: opens, opens again when it breaks, and hands messages on.

const FIRST_WAIT_MS = 300;
const LONGEST_WAIT_MS = 5000;

export class Connection {
  // `listener`: heard(message), data(bytes), opened(), lost(reason).
  constructor(address, listener) {
    this.address = address;
    this.listener = listener;
    this.wait = FIRST_WAIT_MS;
    this.open();
  }

  open() {
    const socket = new WebSocket(this.address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.wait = FIRST_WAIT_MS;
      this.listener.opened();
    };
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") this.listener.heard(JSON.parse(data));
      else this.listener.data(data);
    };
    socket.onclose = ({ reason }) => {
      this.listener.lost(reason);
      if (this.isClosed) return;
      this.timer = setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT_MS);
    };
    this.socket = socket;
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  send(message) {
    if (this.isOpen) this.socket.send(JSON.stringify(message));
  }

  close() {
    this.isClosed = true;
    clearTimeout(this.timer);
    this.socket.close();
  }
}
