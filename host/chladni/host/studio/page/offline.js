// The page as a file: no server plays, so it has drives for places all over the board and works the
// numbers out that it can.

import { startTheme } from "./theme.js";
import { View } from "./view.js";

class ExportedBoard {
  // `data`: as export.py writes it. `listener`: as of a connection.
  constructor(data, listener) {
    this.data = data;
    this.listener = listener;
    this.drives = new Int16Array(bytesOf(data.drives));
    this.newtons = new Float32Array(bytesOf(data.newtons));
    this.down = new Map();
    setTimeout(() => {
      listener.parts.moving.hidden = true; // there is no one to solve the plate
      listener.heard(data.board);
      listener.data(bytesOf(data.fields));
    });
  }

  send({ type, number, finger, x_mm: x, y_mm: y }) {
    if (type === "press") this.down.set(finger, [x, y]);
    else this.down.delete(finger);
    setTimeout(() => this.answer(number));
  }

  // As the firmware does: the first finger plays.
  answer(number) {
    const [place] = this.down.values();
    if (!place) {
      this.listener.heard({ type: "lifted", number });
      return;
    }
    const { x_mm: xMm, y_mm: yMm } = this.data.places;
    const column = nearest(xMm, place[0]), row = nearest(yMm, place[1]);
    const at = row * xMm.length + column, coils = this.data.board.actuators.length;
    const unit = this.data.full_scale_gain / 32767;
    const drive = [...Array(coils).keys()].map((coil) =>
      [0, 1].map((part) => unit * this.drives[2 * (at * coils + coil) + part]));
    const newtons = Number.isFinite(this.newtons[at]) ? this.newtons[at] : null;
    const own = [xMm[column], yMm[row]];
    this.listener.heard({
      type: "played", number, place_mm: own, drive, newtons_per_gain: newtons, latency_ms: null, state: "playing",
    });
    this.listener.heard({ type: "scored", number, ...this.count(own, newtons) });
  }

  count(place, newtons) {
    const { field } = this.listener, peak = field.peakMm();
    const { fingertip_mm: radius, second_finger_mm: apart } = this.data.board;
    const mean = field.meanAround(place, radius), second = field.secondFinger(place, radius, apart);
    return {
      focal_error_mm: Math.hypot(peak[0] - place[0], peak[1] - place[1]),
      finger_um: newtons === null ? null : 1e6 * newtons * mean,
      maximum_mm: peak,
      ...(second && { second_finger_db: second.db }),
      second_finger_mm: second?.at ?? null,
      words: "",
    };
  }
}

function nearest(axis, value) {
  const step = (axis.at(-1) - axis[0]) / (axis.length - 1);
  return Math.min(Math.max(Math.round((value - axis[0]) / step), 0), axis.length - 1);
}

function bytesOf(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}

startTheme(document.getElementById("theme"));
const data = JSON.parse(document.getElementById("data").textContent);
const views = document.getElementById("views");
views.replaceChildren();
new View(document.getElementById("view"), views, (listener) => new ExportedBoard(data, listener));
