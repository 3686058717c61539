// One board on the page: its picture, its marks and its numbers.

import { Design } from "./design.js";
import { Effects } from "./effects/panel.js";
import { RealDevice } from "./real_device.js";
import { micrometres, showCoils, showLatency, showMeasured, showNumbers } from "./scorecard.js";
import { MovableParts } from "./movable_parts.js";
import { Fingers } from "./fingers.js";
import { Field } from "./picture/field.js";
import { Marks } from "./picture/marks.js";
import { Painter } from "./picture/painter.js";
import { Queue } from "./queue.js";
import { Setup } from "./setup.js";
import { Timing } from "./timing.js";
import { Touches } from "./touches.js";

const TOLD_EVERY_MS = 500;
const KEYS = "Board. Arrow keys move a finger by 1 mm, with Shift by 5 mm. Space puts it down or lifts it. Escape lifts it.";
const AIMS = { loudest: "for several fingers, one alone with the loudest drive" };
const SEVERAL_KEYS = "A adds a finger that stays. Tab selects the next finger, Delete removes it.";

// Messages that are a part's own.
const OF_PARTS = {
  device: ["realDevice", "shown"], doing: ["realDevice", "doing"], search: ["design", "shown"],
  solving: ["effects", "solving"], felt: ["effects", "shown"],
};

export class View {
  // `source`: a class made with a view as listener, with send(message).
  constructor(template, parent, connect) {
    const copy = template.content.cloneNode(true);
    this.section = copy.querySelector("section");
    this.parts = {};
    for (const part of copy.querySelectorAll("[data-part]")) this.parts[part.dataset.part] ??= part;
    this.radios = [...copy.querySelectorAll('[data-part="show"]')];
    parent.append(copy);
    const { parts } = this;
    this.painter = new Painter(parts.canvas);
    this.marks = new Marks(parts.marks);
    this.timing = new Timing();
    this.touches = new Touches(parts.plate, this);
    this.isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.show = this.isStill ? "energy" : "displacement";
    this.phase = 0;
    View.made = (View.made ?? 0) + 1;
    this.number = View.made;
    this.startControls();
    this.queue = new Queue((message) => this.source.send(message));
    this.setup = new Setup(this);
    this.movable = new MovableParts(this);
    this.fingers = new Fingers(this);
    this.realDevice = new RealDevice(this);
    this.design = new Design(this);
    this.effects = new Effects(this);
    this.source = connect(this);
    parts.nocanvas.hidden = this.painter.works;
  }

  startControls() {
    const { parts } = this;
    for (const radio of this.radios) {
      radio.name = `show-${this.number}`;
      radio.checked = radio.value === this.show;
      radio.addEventListener("change", () => {
        this.show = radio.value;
        this.look();
      });
    }
    parts.pause.addEventListener("click", () => {
      this.isStill = !this.isStill;
      this.look();
    });
    parts.speed.addEventListener("input", () => this.look());
    parts.place.addEventListener("submit", (event) => {
      event.preventDefault();
      if (!this.board) return;
      this.touches.go(this.touches.selected, this.asked(), event.timeStamp);
    });
    parts.lift.addEventListener("click", () => this.touches.lift(this.touches.selected));
    // The form says itself which places are on the board.
    parts.add.addEventListener("click", ({ timeStamp }) => parts.place.reportValidity() && this.touches.add(this.asked(), timeStamp));
  }

  // The place in the form's fields.
  asked() {
    return [this.parts.x.valueAsNumber, this.parts.y.valueAsNumber];
  }

  close() {
    this.source.close();
    this.drive = null;
    this.section.remove();
  }

  // From the source.

  opened() {
    this.say("");
  }

  lost(reason) {
    this.queue.reset();
    this.touches.letGo();
    this.realDevice.lost();
    this.design.lost();
    const why = reason ? ` It said: ${reason}.` : "";
    this.say(`No connection to the studio; trying again.${why} If it was started again, it may have another address.`);
  }

  heard(message) {
    const [part, method] = OF_PARTS[message.type] ?? [];
    if (part) this[part][method](message);
    else this[`on_${message.type}`]?.(message);
  }

  on_hello(message) {
    this.queue.reset();
    this.touches.letGo();
    this.say("");
    this.setup.hello(message);
    this.realDevice.hello(message);
    this.design.hello(message);
    this.effects.hello(message);
  }

  on_file(message) {
    Setup.file(message);
  }

  on_progress({ board, done, all }) {
    this.parts.making.hidden = false;
    this.parts.name.textContent = board;
    if (all > 0) this.parts.progress.value = done / all;
    else this.parts.progress.removeAttribute("value");
    this.say(all > 0 ? "Building the board’s table." : "Solving the board’s plate.");
    this.parts.progress.title = `${done} of ${all}`;
  }

  on_board(board) {
    this.board = board;
    this.parts.making.hidden = true;
    const { parts } = this;
    const size = board.size_mm.map((side) => side.toFixed(1)).join(" × ");
    parts.name.textContent = board.name;
    this.section.setAttribute("aria-label", `Board ${board.name}, view ${this.number}`);
    parts.about.textContent = `${size} mm, ${board.actuators.length} coils at ${board.frequency_hz} Hz, ${AIMS[board.objective] ?? `drives best at ${board.objective}`}. ${board.source}`;
    this.setup.fit(board);
    this.marks.fit(board);
    parts.screwMark.hidden = !board.screws.length;
    parts.footMark.hidden = !board.feet_mm.length;
    showMeasured(parts, board);
    this.touches.fit(board);
    // Where a finger may be, to begin with: half-way up the board.
    if (!this.touches.isDown) [parts.x.value, parts.y.value] = [0, (board.size_mm[1] / 4).toFixed(1)];
    parts.add.hidden = parts.severalHint.hidden = board.most_fingers < 2;
    parts.plate.setAttribute("aria-label", board.most_fingers < 2 ? KEYS : `${KEYS} ${SEVERAL_KEYS}`);
    this.movable.fit(board);
    this.drive = null;
    if (!board.is_draft) this.forget();
  }

  // Of the board before.
  forget() {
    const { parts } = this;
    this.say("");
    this.shownPress = this.scoredPress = 0;
    this.latency = undefined;
    this.fingers.reset();
    this.effects.forget();
    this.isSum = false;
    this.tone = undefined;
    parts.hint.textContent = "Press the board.";
    parts.words.textContent = "";
    for (const table of [parts.numbers, parts.coils]) table.tBodies[0].replaceChildren();
    this.painter.clear();
  }

  data(bytes) {
    this.field = new Field(this.board, bytes);
    this.painter.fit(this.field);
    this.section.dataset.board = this.board.name;
    delete this.section.dataset.scored;
    this.look();
  }

  on_played(message) {
    const done = this.queue.answered(message.number);
    this.shownPress = message.number;
    this.drive = message.drive;
    this.newtons = message.newtons_per_gain;
    this.begun = done?.time;
    const { parts } = this;
    parts.hint.textContent = "";
    Marks.put(this.marks.finger, message.place_mm);
    this.fingers.played(message);
    this.pictured();
    Marks.put(this.marks.second, null);
    showCoils(parts.coils, this.board.actuators, message.drive);
    if (message.latency_ms !== null) this.latency = message.latency_ms;
    if (message.state === "computed") this.latency = undefined;
    else if (message.state !== "playing") this.say(`The device does not play: ${message.state}.`);
    this.queue.next();
  }

  // What the picture shows: the drive that plays, or of several fingers all signals or the chosen one.
  pictured() {
    if (!this.drive) return;
    const seen = this.fingers.areSeveral ? this.fingers.seen() : [];
    const drives = this.fingers.areSeveral ? seen.map(({ drive }) => drive) : [this.drive];
    this.tone = seen[0]?.tone_hz ?? this.board.frequency_hz;
    this.isSum = drives.length !== 1;
    this.arrows = this.isSum ? this.drive.map(() => [0, 0]) : drives[0];
    if (this.isSum) this.field.addSeveral(drives);
    else this.field.add(drives[0]);
    Marks.put(this.marks.maximum, this.field.peak > 0 ? this.field.peakMm() : null);
    this.look();
  }

  on_scored(numbers) {
    Marks.put(this.marks.maximum, this.fingers.areSeveral ? this.field.peakMm() : numbers.maximum_mm);
    Marks.put(this.marks.second, this.fingers.areSeveral ? null : numbers.second_finger_mm);
    showNumbers(this.parts.numbers, numbers, this.board.objective);
    if (this.latency !== undefined) showLatency(this.parts.numbers, this.latency);
    this.section.dataset.scored = numbers.number;
    this.scoredPress = Math.max(this.scoredPress, numbers.number);
    this.waits();
    this.parts.words.textContent = this.fingers.areSeveral ? this.fingers.words() : numbers.words;
  }

  on_lifted({ number }) {
    this.queue.answered(number);
    this.queue.next();
    this.waits();
  }

  // Whether numbers are still to come.
  waits() {
    this.parts.numbers.setAttribute("aria-busy", this.queue.isBusy || this.scoredPress < this.shownPress);
  }

  on_refused({ number, text }) {
    if (this.effects.refused(number, text)) return;
    this.queue.answered(number);
    this.scoredPress = Math.max(this.scoredPress, number ?? 0);
    this.say(text);
    this.fingers.restore();
    this.queue.next();
    this.waits();
  }

  // From the fingers.

  down(finger, place, time) {
    this.say("");
    this.queue.put({ type: "press", finger, x_mm: place[0], y_mm: place[1] }, `finger ${finger}`, time);
    this.waits();
    if (finger === this.touches.selected) this.aimed(place);
    if (finger > 0) Marks.put(this.marks.fingers[finger], place);
  }

  up(finger) {
    this.queue.put({ type: "lift", finger }, null, performance.now());
    this.waits();
    if (finger > 0) Marks.put(this.marks.fingers[finger], null);
  }

  selected(finger) {
    this.fingers.selected(finger);
  }

  partAt(place) {
    return this.board ? this.movable.at(place, this.marks.reach) : undefined;
  }

  moved(part, place, time) {
    this.say("");
    this.movable.move(part, place, time);
  }

  aimed(place) {
    this.parts.x.value = place[0].toFixed(1);
    this.parts.y.value = place[1].toFixed(1);
    if (!this.touches.isDown) Marks.put(this.marks.finger, place);
  }

  // The picture.

  say(text) {
    if (this.parts.status.textContent !== text) this.parts.status.textContent = text;
  }

  // Of several signals no moment is that of all, so their energy is shown.
  get kind() {
    return this.isSum ? "energy" : this.show;
  }

  // What is shown has changed: draw it, and go on if it moves.
  look() {
    const { parts } = this, isMoving = this.kind === "displacement";
    const waves = Number(parts.speed.value);
    parts.pause.disabled = parts.speed.disabled = !isMoving;
    parts.pause.textContent = this.isStill ? "Play" : "Pause";
    if (this.board) {
      const factor = (this.tone ?? this.board.frequency_hz) / waves;
      parts.factor.textContent = isMoving ? `slowed ${Number(factor.toPrecision(3))} times` : this.isSum ? "rms of all signals" : "rms over a wave";
    }
    this.drawScale();
    if (!this.isAwaited) {
      this.isAwaited = true;
      requestAnimationFrame((now) => this.paint(now));
    }
  }

  drawScale() {
    Painter.bar(this.parts.bar, this.kind);
    const { low, high } = this.parts, isEnergy = this.kind === "energy";
    if (!this.drive) {
      low.textContent = high.textContent = "";
      return;
    }
    const most = this.newtons ? this.field.peak * this.newtons * (isEnergy ? Math.SQRT1_2 : 1) : null;
    const text = most === null ? "most" : micrometres(1e6 * most);
    high.textContent = text;
    low.textContent = isEnergy ? "0" : `−${text}`;
  }

  paint(now) {
    this.isAwaited = false;
    if (!this.drive || !this.painter.works) return;
    const isMoving = this.kind === "displacement" && !this.isStill;
    if (isMoving) {
      this.phase += 2 * Math.PI * Number(this.parts.speed.value) * Math.min((now - (this.at ?? now)) / 1000, 0.1);
      this.timing.frame(now);
      this.isAwaited = true;
      requestAnimationFrame((next) => this.paint(next));
    }
    this.at = isMoving ? now : undefined;
    if (this.kind === "energy") this.painter.energy(this.field);
    else this.painter.displacement(this.field, this.phase);
    this.marks.phasors(this.arrows, this.kind === "energy" ? 0 : this.phase);
    if (this.begun !== undefined) this.timing.picture(this.begun);
    this.begun = undefined;
    if (!(now < this.toldAt + TOLD_EVERY_MS)) {
      this.toldAt = now;
      this.parts.timing.textContent = this.timing.text();
    }
  }
}
