// Fingers on the board: pointers and keys become presses, moves and lifts, in millimetres.

const STEP_MM = 1;
const LONG_STEP_MM = 5;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const FINGERS = 2; // a panel reports more, but only the first one plays

export class Touches {
  // `listener`: down(finger, place, time), up(finger), aimed(place), partAt(place),
  // moved(part, place, time).
  constructor(plate, listener) {
    this.plate = plate;
    this.listener = listener;
    this.pointers = new Map();
    this.parts = new Map();
    this.place = [0, 0];
    this.isDown = false;
    plate.addEventListener("pointerdown", (event) => this.begin(event));
    plate.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) {
      plate.addEventListener(name, (event) => this.end(event));
    }
    plate.addEventListener("keydown", (event) => this.key(event));
    plate.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  fit(board) {
    this.size = board.size_mm;
  }

  placeOf(event) {
    const box = this.plate.getBoundingClientRect(), [width, height] = this.size;
    const x = ((event.clientX - box.left) / box.width - 0.5) * width;
    const y = (0.5 - (event.clientY - box.top) / box.height) * height;
    return this.within([x, y]);
  }

  within(place) {
    return place.map((value, k) => Math.min(Math.max(value, -this.size[k] / 2), this.size[k] / 2));
  }

  begin(event) {
    if (!this.size || event.button > 0) return;
    const part = this.listener.partAt(this.placeOf(event));
    if (part) {
      this.parts.set(event.pointerId, part);
      this.plate.setPointerCapture(event.pointerId);
      return;
    }
    const used = new Set(this.pointers.values());
    const finger = [...Array(FINGERS).keys()].find((one) => !used.has(one));
    if (finger === undefined) return;
    this.pointers.set(event.pointerId, finger);
    this.plate.setPointerCapture(event.pointerId);
    this.go(finger, this.placeOf(event), event.timeStamp);
  }

  move(event) {
    const finger = this.pointers.get(event.pointerId), part = this.parts.get(event.pointerId);
    if (part) this.listener.moved(part, this.placeOf(event), event.timeStamp);
    if (finger !== undefined) this.go(finger, this.placeOf(event), event.timeStamp);
  }

  end(event) {
    this.parts.delete(event.pointerId);
    const finger = this.pointers.get(event.pointerId);
    if (finger === undefined) return;
    this.pointers.delete(event.pointerId);
    this.lift(finger);
  }

  key(event) {
    const arrow = ARROWS[event.key];
    if (!this.size) return;
    if (arrow) {
      const step = event.shiftKey ? LONG_STEP_MM : STEP_MM;
      this.place = this.within(this.place.map((value, k) => value + step * arrow[k]));
      this.listener.aimed(this.place);
      if (this.isDown) this.go(0, this.place, event.timeStamp);
    } else if (event.key === " " || event.key === "Enter") {
      if (this.isDown) this.lift(0);
      else this.go(0, this.place, event.timeStamp);
    } else if (event.key === "Escape") {
      this.lift(0);
    } else {
      return;
    }
    event.preventDefault();
  }

  // Forget who is down: the device has.
  letGo() {
    this.pointers.clear();
    this.parts.clear();
    this.isDown = false;
  }

  // From here, too: a form's place and its button.
  go(finger, place, time) {
    if (finger === 0) {
      this.place = place;
      this.isDown = true;
    }
    this.listener.down(finger, place, time);
  }

  lift(finger) {
    if (finger === 0) this.isDown = false;
    this.listener.up(finger);
  }
}
