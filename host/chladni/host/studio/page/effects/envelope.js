// An envelope that is drawn: by a pointer, or as numbers.

const SPACE = "http://www.w3.org/2000/svg";
const WIDTH = 320, HEIGHT = 90, COLUMNS = 64;

export class Envelope {
  // `parts`: drawing (an svg), points (a text), lasts and tone (numbers); `changed` is called.
  constructor(parts, changed) {
    Object.assign(this, { parts, changed });
    parts.drawing.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
    parts.drawing.addEventListener("pointerdown", (event) => {
      parts.drawing.setPointerCapture(event.pointerId);
      this.columns = this.sampled();
      this.last = undefined;
      this.draw(event);
    });
    parts.drawing.addEventListener("pointermove", (event) => {
      if (parts.drawing.hasPointerCapture(event.pointerId)) this.draw(event);
    });
    parts.points.addEventListener("change", () => this.read());
    parts.lasts.addEventListener("change", () => this.stretch());
    parts.tone.addEventListener("change", () => this.changed());
    this.points = [[0, 0], [0.1, 1], [0.5, 0.4], [1, 0]]; // time and height, both from 0 to 1
    this.show();
  }

  get lasts() {
    return this.parts.lasts.valueAsNumber || 300;
  }

  // Heights at even times.
  sampled() {
    return Array.from({ length: COLUMNS + 1 }, (_, k) => at(this.points, k / COLUMNS));
  }

  draw(event) {
    const box = this.parts.drawing.getBoundingClientRect();
    const column = Math.round(COLUMNS * within((event.clientX - box.left) / box.width));
    const height = within(1 - (event.clientY - box.top) / box.height);
    // A fast pointer leaves columns out: those between are joined.
    const [from, start] = this.last ?? [column, height];
    for (let k = Math.min(from, column); k <= Math.max(from, column); k += 1) {
      const share = column === from ? 1 : (k - from) / (column - from);
      this.columns[k] = start + share * (height - start);
    }
    this.last = [column, height];
    this.points = straightened(this.columns.map((value, k) => [k / COLUMNS, value]));
    this.show();
    this.changed();
  }

  // The numbers, once they are some.
  read() {
    const rows = this.parts.points.value.split(",").map((own) => own.trim().split(/\s+/).map(Number));
    const isGood = rows.length > 1 && rows.every(([ms, share], k) => rows[k].length === 2 && ms >= 0 &&
      share >= 0 && share <= 1 && (k === 0 || ms > rows[k - 1][0]));
    this.parts.points.setCustomValidity(isGood ? "" : "Milliseconds that rise, each with a share from 0 to 1: 0 0, 20 1, 300 0");
    if (!this.parts.points.reportValidity()) return;
    this.parts.lasts.value = rows.at(-1)[0];
    this.points = rows.map(([ms, share]) => [ms / this.lasts, share]);
    this.show();
    this.changed();
  }

  stretch() {
    this.show();
    this.changed();
  }

  show() {
    const line = document.createElementNS(SPACE, "path");
    line.setAttribute("d", `M${this.points.map(([t, share]) => `${(WIDTH * t).toFixed(1)} ${(HEIGHT * (1 - share)).toFixed(1)}`).join("L")}`);
    line.setAttribute("class", "own");
    this.parts.drawing.replaceChildren(line);
    this.parts.points.setCustomValidity("");
    this.parts.points.value = this.rows().map(([ms, share]) => `${ms} ${share}`).join(", ");
  }

  rows() {
    return this.points.map(([t, share]) => [Number((t * this.lasts).toFixed(1)), Number(share.toFixed(3))]);
  }

  toml() {
    const amplitude = this.rows().map(([ms, share]) => `[${ms.toFixed(1)}, ${share}]`).join(", ");
    return `name = "drawn"\n[[tone]]\nat_ms = 0\nlasts_ms = ${this.lasts}\namplitude = [${amplitude}]\nfrequency_hz = ${this.parts.tone.valueAsNumber || 160}\n`;
  }
}

function within(share) {
  return Math.min(Math.max(share, 0), 1);
}

function at(points, t) {
  const k = Math.max(points.findLastIndex(([own]) => own <= t), 0), [from, start] = points[k];
  const [to, end] = points[k + 1] ?? points[k];
  return to === from ? start : start + ((t - from) / (to - from)) * (end - start);
}

// Without the points that lie on the line of those beside them, within a hundredth.
function straightened(points) {
  const kept = [points[0]];
  for (let k = 1; k < points.length - 1; k += 1) {
    if (Math.abs(at([kept.at(-1), points[k + 1]], points[k][0]) - points[k][1]) > 0.01) kept.push(points[k]);
  }
  return [...kept, points.at(-1)];
}
