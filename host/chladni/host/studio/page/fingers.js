// Several fingers: a row for each with its tone and level, and what each gets of every signal.

import { Marks } from "./picture/marks.js";
import { micrometres } from "./scorecard.js";

export class Fingers {
  // `view`: has parts, marks, queue, touches and pictured().
  constructor(view) {
    this.view = view;
    this.reset();
  }

  reset() {
    this.all = [];
    this.rows = new Map();
    this.areSeveral = false;
    this.alone = null; // whose signal the picture shows; null for all of them
    const { parts } = this.view;
    parts.fingers.hidden = true;
    parts.fingerRows.tBodies[0].replaceChildren();
    this.caption("");
  }

  // A drive plays. Of several fingers the rest of the page has that of the first one that sounds.
  played(message) {
    const { view } = this, { fingers } = message;
    this.areSeveral = Boolean(fingers);
    view.marks.select(view.touches.selected, this.areSeveral);
    const first = fingers?.find(({ place_mm: at }) => at.every((value, k) => value === message.place_mm[k]));
    this.caption(first ? ` of finger ${first.finger + 1}’s signal, as if alone` : "");
    if (!fingers) return;
    this.shown(message);
    view.marks.fingers.forEach((mark, k) => Marks.put(mark, fingers.find(({ finger }) => finger === k)?.place_mm));
    view.parts.words.textContent = this.words();
    if (fingers.some(({ level }) => level > 0)) return;
    view.scoredPress = message.number; // there is nothing to score
    view.waits();
  }

  caption(whose) {
    const { parts } = this.view;
    parts.scoreCaption.textContent = `Scorecard${whose}`;
    parts.coilsCaption.textContent = `Coils${whose}`;
  }

  selected(finger) {
    this.view.marks.select(finger, this.areSeveral);
    this.mark();
    if (this.areSeveral) this.view.say(`Finger ${finger + 1} is selected.`);
  }

  // The rows, and the matrix: its rows are who feels, its columns whose signal.
  shown({ fingers, matrix_db: matrix }) {
    const { parts } = this.view, body = parts.fingerRows.tBodies[0];
    this.all = fingers;
    parts.fingers.hidden = false;
    for (const [finger, row] of this.rows) {
      if (fingers.some((one) => one.finger === finger)) continue;
      row.element.remove();
      this.rows.delete(finger);
    }
    if (!fingers.some((one) => one.finger === this.alone)) this.alone = null;
    for (const [k, one] of fingers.entries()) {
      if (!this.rows.has(one.finger)) this.rows.set(one.finger, this.makeRow(one.finger));
      const { element } = this.rows.get(one.finger);
      // One that is at its place keeps the focus it may have.
      if (body.rows[k] !== element) body.insertBefore(element, body.rows[k] ?? null);
    }
    this.restore();
    showMatrix(parts.matrix, fingers, matrix);
    parts.matrix.dataset.value = JSON.stringify(matrix);
  }

  // What the device plays, also where something else was asked for and refused.
  restore() {
    for (const one of this.all) {
      const { tone, level, own, others } = this.rows.get(one.finger);
      if (tone !== document.activeElement) tone.value = one.tone_hz;
      if (level !== document.activeElement) level.value = Math.round(1000 * one.level) / 10;
      own.textContent = one.level > 0 ? micrometres(one.finger_um) : "silent";
      others.textContent = { true: "not felt", false: "felt" }[one.is_spared] ?? "–";
    }
    this.mark();
  }

  // Which finger keys move, and whose signal is seen.
  mark() {
    for (const [finger, { element, alone }] of this.rows) {
      element.classList.toggle("selected", finger === this.view.touches.selected);
      alone.setAttribute("aria-pressed", finger === this.alone);
    }
  }

  makeRow(finger) {
    const element = document.createElement("tr"), name = `finger ${finger + 1}`;
    element.dataset.finger = finger;
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = finger + 1;
    const tone = number(`Tone of ${name}, Hz`, 20, 250), level = number(`Level of ${name}, %`, 0, 100);
    for (const input of [tone, level]) input.addEventListener("change", (event) => this.ask(finger, event.timeStamp));
    const alone = button("Show alone", `Show ${name} alone`, () => {
      this.alone = this.alone === finger ? null : finger;
      this.mark();
      this.view.pictured();
    });
    const remove = button("Remove", `Remove ${name}`, () => this.view.touches.lift(finger));
    const own = document.createElement("td"), others = document.createElement("td");
    element.append(head, cell(tone), cell(level), own, others, cell(alone, remove));
    return { element, tone, level, own, others, alone };
  }

  // An empty tone is the table's.
  ask(finger, time) {
    const { tone, level } = this.rows.get(finger), hertz = tone.valueAsNumber;
    const message = {
      type: "voice", finger, tone_hz: Number.isNaN(hertz) ? null : hertz, level: level.valueAsNumber / 100,
    };
    this.view.say("");
    this.view.queue.put(message, `voice ${finger}`, time);
    this.view.waits();
  }

  // Those whose signals the picture adds up: one, or all that sound.
  seen() {
    const own = this.all.filter(({ finger }) => finger === this.alone);
    const sounding = this.all.filter(({ level }) => level > 0);
    return own.length > 0 ? own : sounding;
  }

  words() {
    const felt = this.all.filter(({ is_spared: isSpared }) => isSpared === false);
    if (this.all.length < 2) return "";
    if (felt.length > 0) return `A resting finger feels others’ signals at: ${felt.map(({ finger }) => finger + 1).join(", ")}.`;
    const isKnown = this.all.every(({ is_spared: isSpared }) => isSpared === true);
    return isKnown ? "No resting finger feels the others’ signals." : "";
  }
}

function showMatrix(table, fingers, matrix) {
  const heads = [["finger", "col"], ...fingers.map(({ finger }) => [`signal ${finger + 1}`, "col"])];
  table.tHead.replaceChildren(tableRow(heads.map(([text, scope]) => headCell(text, scope))));
  table.tBodies[0].replaceChildren(...fingers.map(({ finger }, j) => tableRow([
    headCell(`finger ${finger + 1}`, "row"),
    ...fingers.map((signal, k) => levelCell(matrix[j][k], finger, signal.finger)),
  ])));
}

// Decibels for eyes, and a sentence for those who hear the page.
function levelCell(level, finger, signal) {
  const own = document.createElement("td"), seen = document.createElement("span"), told = document.createElement("span");
  seen.setAttribute("aria-hidden", "true");
  seen.textContent = level === null ? "–" : `${level.toFixed(0).replace("-", "−")} dB`;
  told.className = "unseen";
  if (level === null) told.textContent = `Signal ${signal + 1} is silent.`;
  else if (finger === signal) told.textContent = "Its own signal.";
  else {
    const size = Math.abs(level).toFixed(0), side = level > 0 ? "more" : "less";
    told.textContent = `Gets ${size} decibels ${side} of signal ${signal + 1} than finger ${signal + 1} does.`;
  }
  own.append(seen, told);
  return own;
}

function number(label, least, most) {
  const input = document.createElement("input");
  Object.assign(input, { type: "number", min: least, max: most, step: "any" });
  input.setAttribute("aria-label", label);
  return input;
}

function button(text, label, clicked) {
  const own = document.createElement("button");
  own.type = "button";
  own.textContent = text;
  own.setAttribute("aria-label", label);
  own.addEventListener("click", clicked);
  return own;
}

function cell(...content) {
  const own = document.createElement("td");
  own.append(...content);
  return own;
}

function headCell(text, scope) {
  const own = document.createElement("th");
  own.scope = scope;
  own.textContent = text;
  return own;
}

function tableRow(cells) {
  const row = document.createElement("tr");
  row.append(...cells);
  return row;
}
