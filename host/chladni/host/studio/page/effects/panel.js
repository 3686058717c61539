// Effects: one of those that come with Chladni, a file, or an envelope that is drawn here, under the
// selected finger. The server plays it on an emulated device and says what fingers feel over time.

import { micrometres, showRows } from "../scorecard.js";
import { drawCurves } from "./curves.js";
import { Envelope } from "./envelope.js";
import { listen } from "./sound.js";

const MOST_BYTES = 98304; // of a file: in base64 a third more; the server refuses more
const FIRST_NUMBER = 2 ** 40; // presses are counted from 1 on
const DRAWN = "drawn.toml";

export class Effects {
  // `view`: has parts, source, touches and asked().
  constructor(view) {
    this.view = view;
    this.number = FIRST_NUMBER;
    const { parts } = view;
    this.envelope = new Envelope(parts, () => {
      parts.effect.value = DRAWN;
    });
    parts.playEffect.addEventListener("submit", (event) => {
      event.preventDefault();
      this.play();
    });
    parts.effectFile.addEventListener("change", () => this.open(parts.effectFile.files[0]));
    parts.listen.addEventListener("click", () => listen(this.felt.own_um, this.felt.rate_hz));
    this.forget();
  }

  // A server plays effects; the page of a file has none.
  hello({ effects }) {
    const { parts } = this.view, chosen = parts.effect.value;
    parts.effects.hidden = false;
    this.files = new Map();
    const options = [...effects.map((name) => [name, name]), [DRAWN, "as drawn below"]];
    parts.effect.replaceChildren(...options.map(([value, text]) => new Option(text, value, false, value === chosen)));
    this.forget();
  }

  // What was played on the board before.
  forget() {
    const { parts } = this.view;
    this.felt = null;
    this.asked = undefined;
    parts.feltBy.hidden = true;
    this.say("");
  }

  async open(file) {
    if (!file) return;
    const { parts } = this.view;
    if (file.size > MOST_BYTES) {
      this.say(`${file.name}: expected a file of at most ${MOST_BYTES} bytes, got ${file.size} bytes`);
      return;
    }
    this.files.set(file.name, new Uint8Array(await file.arrayBuffer()));
    if (![...parts.effect.options].some(({ value }) => value === file.name)) parts.effect.add(new Option(file.name, file.name));
    parts.effect.value = file.name;
    parts.effectFile.value = "";
  }

  play() {
    const { parts, touches, source } = this.view, name = parts.effect.value;
    const at = touches.places.get(touches.selected) ?? this.view.asked();
    const others = touches.numbers().filter((finger) => finger !== touches.selected);
    this.number += 1;
    this.asked = this.number;
    source.send({
      type: "effect",
      number: this.number,
      name,
      data: this.dataOf(name),
      at_mm: at,
      other_mm: touches.places.get(others[0]) ?? null,
      level: parts.effectLevel.valueAsNumber / 100,
    });
    this.say("The emulated device plays it.");
  }

  dataOf(name) {
    if (name === DRAWN) return btoa(this.envelope.toml());
    const bytes = this.files.get(name);
    return bytes ? btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join("")) : null;
  }

  solving({ number, done, all }) {
    if (number === this.asked) this.say(`Solving the plate at ${done} of ${all} frequencies, once for each board.`);
  }

  // Whether a refusal is of an effect.
  refused(number, text) {
    if (!(number > FIRST_NUMBER)) return false;
    if (number === this.asked) this.say(text);
    return true;
  }

  shown(felt) {
    if (felt.number !== this.asked) return;
    const { parts } = this.view;
    this.felt = felt;
    parts.feltBy.hidden = false;
    drawCurves(parts.curves, felt);
    this.say([sentence(felt), ...felt.left_out.map((one) => `Left out: ${one}.`)].join(" "));
    showRows(parts.feltRows, rowsOf(felt));
    parts.effects.dataset.felt = felt.number;
  }

  say(text) {
    this.view.parts.effectSaid.textContent = text;
  }
}

function sentence({ name, peak_um: peak, other_peak_um: other, just_felt_um: least, isolation_db: apart }) {
  const own = `${name}: the finger gets ${micrometres(peak)} at most`;
  if (other === null) return `${own}.`;
  const isFelt = least !== null && other > least;
  return `${own}, the other ${apart.toFixed(0)} dB less, which a resting finger ${isFelt ? "feels" : "does not feel"}.`;
}

function rowsOf(felt) {
  return [
    ["just felt by a resting finger", felt.just_felt_um === null ? "–" : micrometres(felt.just_felt_um)],
    ["most under the other, rms of its disc", felt.other_peak_um === null ? "–" : micrometres(felt.other_peak_um)],
    ["a switch’s bias, as it comes and goes", felt.bias_um === null ? "none: bridges" : micrometres(felt.bias_um)],
    ["from the panel’s report to the first duty", `${felt.first_ms.toFixed(1)} ms`],
    ["from there to 90 % of the most", `${felt.rise_ms.toFixed(1)} ms`],
    ["the envelope is met within", `${felt.envelope_error_db.toFixed(1)} dB at 95 of 100 moments`],
  ];
}
