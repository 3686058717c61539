// What is on the page: which board, best at what, at which frequency; files in and out.

import { savePicture, saveText } from "./saving.js";

const MOST_BYTES = 65536; // of a board file; the server refuses more
const OWN = ""; // an objective: what the board file says
const PLAYED = "phasor"; // the method of tables
const NAMES = { ssim: "an image like the target's (ssim)", contrast: "contrast", balanced: "both, balanced", focus: "a focus" };

export class Setup {
  // `view`: has parts, section, source and say(text).
  constructor(view) {
    this.view = view;
    const { parts, section } = view;
    parts.choose.addEventListener("submit", (event) => {
      event.preventDefault();
      this.choose();
    });
    parts.board.addEventListener("change", () => {
      parts.frequency.value = ""; // of the board before
      parts.objective.value = OWN;
    });
    parts.open.addEventListener("change", () => this.open(parts.open.files[0]));
    for (const name of ["dragenter", "dragover"]) {
      section.addEventListener(name, (event) => event.preventDefault());
    }
    section.addEventListener("drop", (event) => {
      event.preventDefault();
      this.open(event.dataTransfer.files[0]);
    });
    parts.saveBoard.addEventListener("click", () => view.source.send({ type: "save", what: "board" }));
    parts.saveTable.addEventListener("click", () => view.source.send({ type: "save", what: "table" }));
    parts.savePicture.addEventListener("click", () => savePicture(view));
  }

  // A server has all of it; the page of a file only a picture to save.
  hello({ boards, objectives, methods, board, objective, method, frequency_hz: frequency }) {
    const { parts } = this.view;
    parts.choose.hidden = parts.files.hidden = false;
    parts.saveBoard.hidden = parts.saveTable.hidden = false;
    const own = boards.includes(board) ? boards : [board, ...boards];
    fill(parts.board, own.map((name) => [name, name]), board);
    const known = objectives.map((name) => [name, NAMES[name] ?? name]);
    fill(parts.objective, [[OWN, "what the board is made for"], ...known], objective);
    fill(parts.method, methods.map((name) => [name, name === PLAYED ? `${name}, by the device` : name]), method);
    parts.frequency.value = frequency;
    this.shown = board;
  }

  // A board's shape, the places on it, and what can be saved of it.
  fit({ size_mm: size, corner_radius_mm: corner, has_table: hasTable }) {
    const { parts, section } = this.view;
    section.classList.toggle("wide", size[0] > size[1]);
    parts.frame.style.setProperty("--ratio", size[0] / size[1]);
    ["x", "y"].forEach((axis, k) => {
      const most = Math.floor(5 * size[k]) / 10;
      parts.plate.style.setProperty(`--corner-${axis}`, `${(100 * corner) / size[k]}%`);
      Object.assign(parts[axis], { min: -most, max: most });
    });
    parts.saveTable.disabled = !hasTable;
  }

  choose() {
    const { parts, source } = this.view, board = parts.board.value;
    const frequency = parts.frequency.valueAsNumber;
    source.send({
      type: "choose",
      board: board === this.shown ? null : board, // the one that is shown may be no shipped one
      objective: parts.objective.value || null,
      method: parts.method.value,
      frequency_hz: Number.isFinite(frequency) ? frequency : null,
    });
  }

  async open(file) {
    if (!file) return;
    if (file.size > MOST_BYTES) {
      this.view.say(`${file.name}: expected a board file of at most ${MOST_BYTES} bytes, got ${file.size} bytes`);
      return;
    }
    this.view.source.send({ type: "open", name: file.name, text: await file.text() });
    this.view.parts.open.value = "";
  }

  static file({ name, data }) {
    saveText(name, Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0)));
  }
}

function fill(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value, false, value === chosen)));
}
