// A design that the server runs: begun and stopped here, its front drawn as it grows.

import { micrometres } from "./scorecard.js";

const MOST_BYTES = 65536; // of a SPEC; the server refuses more
const SPACE = "http://www.w3.org/2000/svg";
const LEFT = 44, RIGHT = 310, TOP = 10, BOTTOM = 162;
const RUNNING = "running";

export class Design {
  // `view`: has parts and source.
  constructor(view) {
    this.view = view;
    const { parts } = view;
    parts.begin.addEventListener("submit", (event) => {
      event.preventDefault();
      this.begin(parts.spec.value, null);
    });
    parts.stop.addEventListener("click", () => {
      view.source.send({ type: "stop" });
      this.say("Stopping: the boards that are looked at are finished first.");
    });
    parts.ownSpec.addEventListener("change", () => this.open(parts.ownSpec.files[0]));
  }

  hello({ specs }) {
    const { parts } = this.view, chosen = parts.spec.value;
    parts.design.hidden = false;
    parts.spec.replaceChildren(...specs.map((name) => new Option(name, name, false, name === chosen)));
  }

  async open(file) {
    if (!file) return;
    if (file.size > MOST_BYTES) {
      this.say(`${file.name}: expected a SPEC of at most ${MOST_BYTES} bytes, got ${file.size} bytes`);
      return;
    }
    this.begin(file.name, await file.text());
    this.view.parts.ownSpec.value = "";
  }

  begin(name, text) {
    this.view.source.send({ type: "design", name, text });
  }

  shown({ name, state, done, all, fingers, clicks, boards, front }) {
    const { parts } = this.view;
    parts.stop.disabled = state !== RUNNING;
    const none = boards.length === 0 ? ", none of them within the limits" : "";
    const count = `${done} of ${all} boards looked at${none}`;
    if (state === RUNNING) this.say(done > 0 ? `${name}: ${count}.` : `${name}: comparing layouts.`);
    else if (state === "done" || state === "stopped") this.say(`${name}: ${state}; ${count}.`);
    else this.say(state);
    const apart = clicks ? `a click, ${fingers} fingers apart` : `${fingers} fingers apart`;
    this.draw(fingers, apart, boards, front);
    this.list(fingers, apart, boards, front);
  }

  // How far apart fingers are against micrometres, or against coils on a board without [coil].
  draw(fingers, apart, boards, front) {
    const { parts } = this.view, svg = parts.front;
    svg.toggleAttribute("hidden", boards.length === 0);
    if (boards.length === 0) return;
    const hasUm = boards.every(([um]) => um !== null);
    const across = range(boards.map(([um, , coils]) => (hasUm ? um : coils)));
    const up = range(boards.map(([, db]) => db));
    const x = (value) => LEFT + (RIGHT - LEFT) * across.share(value);
    const y = (value) => BOTTOM - (BOTTOM - TOP) * up.share(value);
    const onFront = new Set(front);
    const dots = boards.map(([um, db, coils], index) => element("circle", {
      cx: x(hasUm ? um : coils), cy: y(db), r: onFront.has(index) ? 4.5 : 2.5,
      class: onFront.has(index) ? "kept" : "seen", "data-index": index, "data-db": db,
    }));
    const texts = [
      [x(across.low), BOTTOM + 14, "middle", across.low], [x(across.high), BOTTOM + 14, "middle", across.high],
      [LEFT - 4, y(up.low) + 4, "end", up.low], [LEFT - 4, y(up.high) + 4, "end", up.high],
    ].map(([left, top, anchor, value]) => label(left, top, anchor, `${Number(value.toPrecision(3))}`.replace("-", "−")));
    svg.replaceChildren(
      element("path", { class: "axes", d: `M${LEFT} ${TOP}V${BOTTOM}H${RIGHT}` }), ...texts,
      label((LEFT + RIGHT) / 2, BOTTOM + 30, "middle", hasUm ? `under ${fingers > 1 ? "each" : "the"} finger, µm` : "coils"),
      label(LEFT + 6, TOP, "start", fingers > 1 ? `${apart}, dB` : "second finger 20 mm away, dB less"),
      ...dots,
    );
    const best = Math.max(...boards.map(([, db]) => db)).toFixed(1);
    const most = fingers > 1 ? `the best keeps ${fingers} fingers ${best} dB apart` : `the best second finger gets ${best} dB less`;
    svg.setAttribute("aria-label", `${boards.length} boards found; ${most}`);
  }

  list(fingers, apart, boards, front) {
    const { source, parts } = this.view;
    parts.foundApart.textContent = fingers > 1 ? apart : "second finger, 20 mm away";
    parts.foundUm.textContent = fingers > 1 ? "under each finger" : "under the finger";
    parts.found.tBodies[0].replaceChildren(...front.map((index) => {
      const [um, db, coils, score] = boards[index];
      const row = document.createElement("tr"), button = document.createElement("button");
      button.type = "button";
      button.textContent = "Show";
      button.setAttribute("aria-label", `Show the board with ${coils} coils and ${db.toFixed(1)} dB`);
      button.addEventListener("click", () => source.send({ type: "take", index }));
      const cells = [coils, `${db.toFixed(1)} dB${fingers > 1 ? "" : " less"}`, micrometres(um), score.toFixed(2), button];
      row.append(...cells.map((content) => {
        const cell = document.createElement("td");
        cell.append(content);
        return cell;
      }));
      return row;
    }));
  }

  // The server has gone, and with it the search.
  lost() {
    this.view.parts.stop.disabled = true;
  }

  say(text) {
    this.view.parts.searchSaid.textContent = text;
  }
}

// A range with room, and where in it a value lies.
function range(values) {
  const low = Math.min(...values), high = Math.max(...values);
  const room = 0.05 * (high - low) || 0.5;
  const share = (value) => (value - low + room) / (high - low + 2 * room);
  return { low, high, share };
}

function element(name, attributes) {
  const own = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) own.setAttribute(key, value);
  return own;
}

function label(x, y, anchor, text) {
  const own = element("text", { x, y, "text-anchor": anchor });
  own.textContent = text;
  return own;
}
