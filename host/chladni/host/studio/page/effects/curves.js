// Three curves over time: what was asked for, what the finger feels, and what another has of it.

const SPACE = "http://www.w3.org/2000/svg";
const WIDTH = 320, LEFT = 6, RIGHT = 314, ROW = 76, TOP = 16, HEIGHT = 50, COLUMNS = 480;
const AFTER_MS = 60; // of rest that is drawn behind

export function drawCurves(svg, { asked, own_um: own, other_um: other, rate_hz: rate }) {
  const count = heard(asked, own, Math.round((AFTER_MS * rate) / 1000)), ms = (1000 * count) / rate;
  const rows = [["asked for", asked, "asked"], ["under the finger, µm", own, "own"]];
  if (other) rows.push(["under the other, µm (rms of its disc)", other, "other"]);
  svg.setAttribute("viewBox", `0 0 ${WIDTH} ${rows.length * ROW + 16}`);
  svg.setAttribute("aria-label", `Curves over ${ms.toFixed(0)} ms: ${rows.map(([label]) => label).join("; ")}`);
  svg.replaceChildren(...rows.flatMap(([label, values, kind], k) => row(label, values.slice(0, count), kind, k * ROW)),
    text(LEFT, rows.length * ROW + 10, "0 ms, the touch"), text(RIGHT, rows.length * ROW + 10, `${ms.toFixed(0)} ms`, "end"));
}

// How many values: to where nothing is left of either curve.
function heard(asked, own, after) {
  const last = (values) => {
    const least = 0.01 * most(values);
    return values.findLastIndex((value) => Math.abs(value) > least);
  };
  return Math.min(Math.max(last(asked), last(own)) + after, own.length);
}

function most(values) {
  return values.reduce((found, value) => Math.max(found, Math.abs(value)), 0);
}

function row(label, values, kind, top) {
  const peak = most(values) || 1, isBoth = values.some((value) => value < 0);
  const zero = top + TOP + (isBoth ? HEIGHT / 2 : HEIGHT), scale = (isBoth ? HEIGHT / 2 : HEIGHT) / peak;
  const line = document.createElementNS(SPACE, "path"), axis = document.createElementNS(SPACE, "path");
  line.setAttribute("class", kind);
  line.setAttribute("d", pathOf(values, (value) => zero - scale * value));
  axis.setAttribute("class", "axes");
  axis.setAttribute("d", `M${LEFT} ${zero}H${RIGHT}`);
  return [axis, line, text(LEFT, top + 11, label), text(RIGHT, top + 11, `most ${Number(peak.toPrecision(3))}`, "end")];
}

// From the least to the most of each column, so that no peak is lost.
function pathOf(values, y) {
  const each = Math.max(1, values.length / COLUMNS), points = [];
  for (let begin = 0; begin < values.length; begin += each) {
    const own = values.slice(Math.floor(begin), Math.max(Math.floor(begin + each), Math.floor(begin) + 1));
    const x = LEFT + ((RIGHT - LEFT) * begin) / values.length;
    for (const value of own.length > 1 ? [Math.min(...own), Math.max(...own)] : own) points.push(`${x.toFixed(1)} ${y(value).toFixed(1)}`);
  }
  return `M${points.join("L")}`;
}

function text(x, y, own, anchor = "start") {
  const made = document.createElementNS(SPACE, "text");
  made.setAttribute("x", x);
  made.setAttribute("y", y);
  made.setAttribute("text-anchor", anchor);
  made.textContent = own;
  return made;
}
