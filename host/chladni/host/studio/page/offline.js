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
    const um = newtons === null ? null : 1e6 * newtons * mean, threshold = this.data.levels.threshold_um;
    const level = um && threshold ? 20 * Math.log10(um / threshold) : null;
    return {
      focal_error_mm: Math.hypot(peak[0] - place[0], peak[1] - place[1]),
      finger_um: um,
      sensation_db: level,
      maximum_mm: peak,
      ...(second && { second_finger_db: second.db }),
      second_finger_mm: second?.at ?? null,
      words: [this.here(mean, um, level), this.there(second?.db)].filter(Boolean).join(" "),
    };
  }

  // As press_score.py chooses.
  here(mean, um, level) {
    const { pressing_db: pressing, sure_db: sure } = this.data.levels;
    let kind = "no threshold";
    if (mean === 0) kind = "still";
    else if (um === null) kind = "unknown";
    else if (level !== null && level < 0) kind = level < -pressing ? "unfelt" : "pressed";
    else if (level !== null) kind = level < sure ? "hardly" : "felt";
    const moved = um >= 0.01 ? `${Number(um?.toPrecision(2))} µm` : "less than 0.01 µm";
    return this.say(kind, { um: moved, hz: Number(this.data.board.frequency_hz.toPrecision(6)), db: Math.round(Math.abs(level)) });
  }

  there(db) {
    const { alike_db: alike, most_db: most } = this.data.levels;
    if (this.data.board.objective === "loudest") return this.say("loudest", {});
    if (db === undefined || db >= most) return "";
    const kind = Math.abs(db) < alike ? "alike" : db < 0 ? "louder" : "quieter";
    return this.say(kind, { db: Math.round(Math.abs(db)) });
  }

  say(kind, values) {
    return this.data.words[kind].replace(/\{(\w+)\}/g, (_, name) => values[name]);
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
