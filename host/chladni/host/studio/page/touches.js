// Fingers on the board: pointers and keys become presses, moves and lifts, in millimetres.

const STEP_MM = 1;
const LONG_STEP_MM = 5;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const LEAST_FINGERS = 2; // a panel reports two at least, if only the first one plays
const APART_MM = 20; // fingertips side by side are 16 to 20 mm apart
const STILL_PX = 4; // a pointer that moves less has clicked
const BESIDE = [[0, 1], [0, -1], [1, 0], [-1, 0]];

export class Touches {
  // `listener`: down(finger, place, time), up(finger), aimed(place), selected(finger), partAt(place),
  // moved(part, place, time).
  constructor(plate, listener) {
    this.plate = plate;
    this.listener = listener;
    this.parts = new Map();
    this.place = [0, 0];
    this.letGo();
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
    this.reach = board.fingertip_mm;
    this.canAdd = board.most_fingers > 1;
    this.most = Math.max(board.most_fingers, LEAST_FINGERS);
  }

  // Whether the finger that keys move is down.
  get isDown() {
    return this.places.has(this.selected);
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
    const place = this.placeOf(event), part = this.listener.partAt(place);
    if (part) {
      this.parts.set(event.pointerId, part);
      this.plate.setPointerCapture(event.pointerId);
      return;
    }
    const held = this.stayingAt(place), isAdded = event.shiftKey && this.canAdd;
    const finger = held ?? this.free(isAdded);
    if (finger === undefined) return;
    const from = [event.clientX, event.clientY];
    this.pointers.set(event.pointerId, { finger, from, isClick: held !== undefined });
    this.plate.setPointerCapture(event.pointerId);
    if (isAdded && held === undefined) this.staying.add(finger);
    if (this.staying.has(finger) || !this.isDown) this.select(finger);
    if (held === undefined) this.go(finger, place, event.timeStamp);
  }

  // The lowest number that is free. A pointer may take over the finger that keys have put down.
  free(isAdded) {
    const pointed = [...this.pointers.values()].map(({ finger }) => finger);
    const used = new Set([...pointed, ...this.staying, ...(isAdded ? this.places.keys() : [])]);
    return [...Array(this.most).keys()].find((one) => !used.has(one));
  }

  // The finger that stays under a place.
  stayingAt(place) {
    const pointed = [...this.pointers.values()].map(({ finger }) => finger);
    const away = (finger) => distance(this.places.get(finger), place);
    const near = [...this.staying].filter((one) => !pointed.includes(one) && away(one) <= this.reach);
    return near.sort((one, two) => away(one) - away(two))[0];
  }

  move(event) {
    const pointer = this.pointers.get(event.pointerId), part = this.parts.get(event.pointerId);
    if (part) this.listener.moved(part, this.placeOf(event), event.timeStamp);
    if (!pointer) return;
    if (pointer.isClick && distance(pointer.from, [event.clientX, event.clientY]) < STILL_PX) return;
    pointer.isClick = false;
    this.go(pointer.finger, this.placeOf(event), event.timeStamp);
  }

  end(event) {
    this.parts.delete(event.pointerId);
    const pointer = this.pointers.get(event.pointerId);
    if (!pointer) return;
    this.pointers.delete(event.pointerId);
    const isRemoved = pointer.isClick && event.type === "pointerup";
    if (isRemoved || !this.staying.has(pointer.finger)) this.lift(pointer.finger);
  }

  key(event) {
    if (!this.size || event.ctrlKey || event.altKey || event.metaKey) return;
    const arrow = ARROWS[event.key];
    if (arrow) {
      const step = event.shiftKey ? LONG_STEP_MM : STEP_MM;
      this.place = this.within(this.place.map((value, k) => value + step * arrow[k]));
      this.listener.aimed(this.place);
      if (this.isDown) this.go(this.selected, this.place, event.timeStamp);
    } else if (event.key === " " || event.key === "Enter") {
      if (this.isDown) this.lift(this.selected);
      else this.go(this.selected, this.place, event.timeStamp);
    } else if (event.key === "Escape") {
      this.lift(this.selected);
    } else if (!this.severalKey(event)) {
      return;
    }
    event.preventDefault();
  }

  // Keys for more than one finger; whether this is one. Tab leaves the board after the last finger.
  severalKey(event) {
    if (!this.canAdd) return false;
    if (event.key === "a" || event.key === "A" || event.key === "+") {
      this.add(this.beside(this.place), event.timeStamp);
    } else if (event.key === "Delete" || event.key === "Backspace") {
      if (this.isDown) this.lift(this.selected);
    } else if (event.key === "Tab") {
      const all = this.numbers(), at = all.indexOf(this.selected) + (event.shiftKey ? -1 : 1);
      if (all.length < 2 || !(at in all)) return false;
      this.select(all[at]);
    } else {
      return false;
    }
    return true;
  }

  // A finger that stays; undefined if there are as many as there may be.
  add(place, time) {
    const finger = this.free(true);
    if (finger === undefined) return undefined;
    this.staying.add(finger);
    this.go(finger, place, time);
    this.select(finger);
    return finger;
  }

  // A place, or one beside it where other fingers leave no room.
  beside(place) {
    const room = (one) => Math.min(...[...this.places.values()].map((other) => distance(one, other)));
    const around = [1, 2, 3].flatMap((k) =>
      BESIDE.map(([x, y]) => this.within([place[0] + k * APART_MM * x, place[1] + k * APART_MM * y])));
    const all = [place, ...around];
    return all.find((one) => room(one) >= APART_MM - 1) ?? all.sort((one, two) => room(two) - room(one))[0];
  }

  numbers() {
    return [...this.places.keys()].sort((one, two) => one - two);
  }

  // The finger that keys, and the form's numbers, move.
  select(finger) {
    this.selected = finger;
    this.place = this.places.get(finger) ?? this.place;
    this.listener.selected(finger);
    if (this.isDown) this.listener.aimed(this.place);
  }

  // Forget who is down: the device has.
  letGo() {
    this.pointers = new Map();
    this.places = new Map();
    this.staying = new Set();
    this.parts.clear();
    this.selected = 0;
  }

  // From here, too: a form's place and its button.
  go(finger, place, time) {
    this.places.set(finger, place);
    if (finger === this.selected) this.place = place;
    this.listener.down(finger, place, time);
  }

  lift(finger) {
    this.places.delete(finger);
    this.staying.delete(finger);
    this.listener.up(finger);
    if (finger === this.selected) this.select(this.numbers()[0] ?? 0);
  }
}

function distance(one, other) {
  return Math.hypot(one[0] - other[0], one[1] - other[1]);
}
