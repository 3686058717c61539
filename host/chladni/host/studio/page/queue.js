// Requests on their way to the device: one at a time, and of those that wait with one key the newest.

export class Queue {
  // `send`: takes a message.
  constructor(send) {
    this.send = send;
    this.number = 0;
    this.reset();
  }

  reset() {
    this.waiting = [];
    this.underWay = null;
  }

  get isBusy() {
    return this.underWay !== null || this.waiting.length > 0;
  }

  // `key`: of what the next message replaces, as a finger that moves; null for what must not be lost.
  put(message, key, time) {
    if (key !== null && this.waiting.at(-1)?.key === key) this.waiting.pop();
    this.waiting.push({ message, key, time });
    this.next();
  }

  next() {
    if (this.underWay || this.waiting.length === 0) return;
    this.number += 1;
    this.underWay = { ...this.waiting.shift(), number: this.number };
    this.send({ ...this.underWay.message, number: this.number });
  }

  // An answer has come: what it is to, if it is to what is under way.
  answered(number) {
    if (!this.underWay || this.underWay.number !== number) return null;
    const done = this.underWay;
    this.underWay = null;
    return done;
  }
}
