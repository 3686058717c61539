// The scorecard, the coils and what was measured, as tables; raw values stay with their cells.

const ROWS = [
  ["ssim", "SSIM", (n) => signed(n.ssim, 3), (n) => `still ${signed(n.baselines.silent, 2)}, nearest coil ${signed(n.baselines.nearest_actuator, 2)}, a focus elsewhere ${signed(n.baselines.misplaced, 2)}`],
  ["focal_error_mm", "Maximum off the finger", (n) => `${n.focal_error_mm.toFixed(1)} mm`, (n) => (n.diffraction_spot_mm ? `a focus of this wave is ${n.diffraction_spot_mm.toFixed(0)} mm wide` : "")],
  ["contrast_db", "Contrast", (n) => decibels(n.contrast_db), (n) => `no drive exceeds ${decibels(n.contrast_limit_db)}`],
  ["second_finger_db", "Second finger", (n) => decibels(n.second_finger_db), () => "above 2.3 dB: felt more here than elsewhere"],
  ["louder_fraction", "Moves more than the finger", (n) => `${(100 * n.louder_fraction).toFixed(0)} % of the board`, () => "none, were it a focus"],
  ["finger_um", "Under the finger", (n) => micrometres(n.finger_um), (n) => (!n.full_volts ? "" : `${n.full_volts.toFixed(2)} V peak, limited by ${n.limited_by}`)],
  ["sensation_db", "Above the threshold", (n) => decibels(n.sensation_db), () => "of a resting finger; one that presses feels 10 to 30 dB more"],
  ["finger_load", "Pressing changes", (n) => decibels(n.finger_load.level_db), (n) => `SSIM by ${signed(n.finger_load.ssim, 3)}`],
];

// On a board made to focus: what the finger gets, what the others get, and SSIM last.
const FOCUS = ["second_finger_db", "finger_um", "sensation_db", "louder_fraction", "contrast_db", "focal_error_mm", "finger_load", "ssim"];

// Of the loudest drive for one finger: what it gets, and nothing that only a focus or an image is asked for.
const LOUDEST = ["finger_um", "sensation_db", "finger_load", "second_finger_db", "focal_error_mm"];
const ORDERS = { focus: FOCUS, loudest: LOUDEST };

export function showNumbers(table, numbers, objective) {
  const order = ORDERS[objective] ?? ROWS.map(([key]) => key);
  const known = order.map((key) => ROWS.find(([own]) => own === key)).filter(([key]) => key in numbers);
  fill(table, known.map(([key, label, value, compare]) => ({
    key, raw: numbers[key], cells: [label, value(numbers), compare(numbers)],
  })));
}

export function showLatency(table, latencyMs) {
  const text = latencyMs === null ? "–" : `${latencyMs.toFixed(1)} ms`;
  const own = { key: "latency_ms", raw: latencyMs, cells: ["Touch to first duty", text, "on the device; 25 ms feels immediate"] };
  const row = makeRow(own);
  const before = table.tBodies[0].querySelector('[data-key="latency_ms"]');
  if (before) before.replaceWith(row);
  else {
    const last = table.tBodies[0].rows[table.tBodies[0].rows.length - 1];
    // Where SSIM is not what was asked for, it stays the last.
    if (last?.dataset.key === "ssim") last.before(row);
    else table.tBodies[0].append(row);
  }
}

export function showCoils(table, actuators, drive) {
  const most = Math.max(...drive.map(([re, im]) => Math.hypot(re, im)), 1e-300);
  fill(table, actuators.map(({ name }, k) => {
    const [re, im] = drive[k], gain = Math.hypot(re, im) / most;
    return {
      key: name, raw: `${re},${im}`,
      cells: [name, gain.toFixed(2), `${signed(Math.round((Math.atan2(im, re) * 180) / Math.PI) + 0, 0)}°`],
    };
  }));
}

// What was measured beside what was drawn, and the coils to look at.
export function showMeasured(parts, { measured, actuators }) {
  const faults = actuators.flatMap(({ fault }) => fault ?? []);
  const hasKind = (wanted) => faults.some(({ kind }) => kind === wanted);
  parts.reversedMark.hidden = !hasKind("reversed");
  parts.deadMark.hidden = !hasKind("dead");
  parts.measured.hidden = !measured;
  if (!measured) return;
  parts.measuredSaid.textContent = measured.said;
  fill(parts.measuredRows, measured.rows.map(({ what, unit, drawn, measured: value, low, high }) => ({
    key: what, raw: value,
    cells: [what, inUnit(short(drawn), unit), inUnit(short(value), unit), inUnit(`${short(low)} to ${short(high)}`, unit)],
  })));
  parts.lookAt.hidden = faults.length === 0;
  parts.faults.replaceChildren(...faults.map(({ said }) => {
    const own = document.createElement("li");
    own.textContent = said;
    return own;
  }));
}

export function showRows(table, rows) {
  fill(table, rows.map(([name, value]) => ({ key: name, raw: value, cells: [name, value] })));
}

export function micrometres(value) {
  if (value === null || value === undefined) return "–";
  return value >= 0.01 ? `${value.toPrecision(3)} µm` : "below 0.01 µm";
}

function short(value) {
  return String(Number(value.toPrecision(3)));
}

function inUnit(text, unit) {
  return unit === "×" ? `× ${text}` : `${text} ${unit}`.trim();
}

function decibels(value) {
  return value === null || value === undefined ? "–" : `${signed(value, 1)} dB`;
}

// With a true minus sign, as a screen reader says it.
function signed(value, digits) {
  return value.toFixed(digits).replace("-", "−");
}

function fill(table, rows) {
  table.tBodies[0].replaceChildren(...rows.map(makeRow));
}

function makeRow({ key, raw, cells }) {
  const row = document.createElement("tr");
  row.dataset.key = key;
  row.dataset.value = typeof raw === "object" ? JSON.stringify(raw) : String(raw);
  cells.forEach((text, k) => {
    const cell = document.createElement(k === 0 ? "th" : "td");
    if (k === 0) cell.scope = "row";
    cell.textContent = text;
    row.append(cell);
  });
  return row;
}
