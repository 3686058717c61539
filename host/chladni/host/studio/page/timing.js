// How fast the page is: frames a second, and from a press to its picture.

const KEPT = 1000;

export class Timing {
  constructor() {
    this.frames = [];
    this.pictures = [];
  }

  frame(now) {
    this.frames.push(now);
    while (this.frames[0] < now - 1000) this.frames.shift();
  }

  // `begun`: of the event. Counted from here once the frame is handed on: that is after this task.
  picture(begun) {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      this.pictures.push(performance.now() - begun);
      if (this.pictures.length > KEPT) this.pictures.shift();
      port1.close();
    };
    port2.postMessage(null);
  }

  text() {
    const parts = [];
    if (this.frames.length > 1) parts.push(`${this.frames.length} frames a second`);
    if (this.pictures.length > 0) {
      const order = [...this.pictures].sort((one, two) => one - two);
      const at = (share) => order[Math.min(order.length - 1, Math.floor(share * order.length))].toFixed(0);
      parts.push(`press to picture ${this.pictures.at(-1).toFixed(0)} ms, half within ${at(0.5)}, 99 % within ${at(0.99)} ms of ${order.length}`);
    }
    return parts.join(" · ");
  }
}
