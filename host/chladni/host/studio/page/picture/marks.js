// What is drawn over the field, in millimetres with y upwards: screws, coils, places.

const MOST_FINGERS = 5;
const SVG = "http://www.w3.org/2000/svg";

// Of coils by what is wrong with them, on a circle of radius r: arrows both ways beside it, or a line across it.
const SIGNS = {
  reversed: (r, u) => `M${r + 2 * u} ${-r}h${5 * u}l${-1.5 * u} ${1.5 * u}m${1.5 * u} ${-3.5 * u}h${-5 * u}l${1.5 * u} ${-1.5 * u}`,
  dead: (r) => `M${-0.7 * r} ${0.7 * r}L${0.7 * r} ${-0.7 * r}`,
};

export class Marks {
  constructor(svg) {
    this.svg = svg;
  }

  fit(board) {
    const [width, height] = board.size_mm;
    this.svg.setAttribute("viewBox", `${-width / 2} ${-height / 2} ${width} ${height}`);
    this.unit = Math.max(width, height) / 100; // so marks look alike on boards of any size
    this.all = group(this.svg, { transform: "scale(1 -1)" });
    this.svg.replaceChildren(this.all);
    const { unit } = this;
    for (const { at_mm: [x, y] } of board.screws) {
      draw(this.all, "path", { d: `M${x - unit} ${y - unit}l${2 * unit} ${2 * unit}m0 ${-2 * unit}l${-2 * unit} ${2 * unit}` });
    }
    for (const [x, y] of board.feet_mm) {
      draw(this.all, "path", { d: `M${x} ${y + unit}L${x + unit} ${y - unit}H${x - unit}Z` });
    }
    this.reach = Math.max(board.magnet_radius_mm, 3 * unit);
    this.coils = board.actuators.map(({ at_mm: [x, y], fault }) => {
      draw(this.all, "circle", { cx: x, cy: y, r: this.reach });
      if (fault?.kind in SIGNS) this.faulty([x, y], fault);
      return { x, y, arrow: draw(this.all, "path", { d: "" }, "phasor") };
    });
    const radius = board.fingertip_mm;
    // Of a finger that would lie half off the board, what lies on it is seen.
    Marks.made = (Marks.made ?? 0) + 1;
    const clip = element(this.all, "clipPath", { id: `board-${Marks.made}` });
    element(clip, "rect", { x: -width / 2, y: -height / 2, width, height });
    const onBoard = group(this.all, { "clip-path": `url(#board-${Marks.made})` });
    this.second = this.place("second", [["circle", { r: radius, "stroke-dasharray": "6 5" }]], onBoard);
    const d = 2 * unit;
    this.maximum = this.place("maximum", [["path", { d: `M0 ${d}L${d} 0L0 ${-d}L${-d} 0Z` }]]);
    this.finger = this.place("finger", [
      ["path", { d: `M${-2 * d} 0H${2 * d}M0 ${-2 * d}V${2 * d}` }],
      ["circle", { r: radius }],
    ]);
    const others = [...Array(MOST_FINGERS - 1).keys()].map((k) =>
      this.place(k === 0 ? "other" : `other-${k + 1}`, [["circle", { r: radius, "stroke-dasharray": "2 5" }]]));
    this.fingers = [this.finger, ...others];
    this.fingers.forEach((mark, k) => {
      const [x, y] = [0.75 * radius, 0.75 * radius];
      const attributes = { transform: `translate(${x} ${y}) scale(1 -1)`, "font-size": 4 * unit };
      for (const text of draw(mark, "text", attributes)) text.textContent = k + 1;
    });
  }

  // A second ring round a coil and a sign, beside it towards the board's middle; in words where a pointer rests.
  faulty([x, y], { kind, said }) {
    const own = group(this.all, { class: "fault", "data-kind": kind, transform: `translate(${x} ${y})` });
    const side = x > 0 ? -1 : 1;
    element(own, "title", {}).textContent = said;
    draw(own, "circle", { r: this.reach + this.unit });
    draw(own, "path", { d: SIGNS[kind](side * this.reach, side * this.unit) });
  }

  place(name, shapes, parent = this.all) {
    const own = group(parent, { class: `place-${name}`, visibility: "hidden" });
    for (const [kind, attributes] of shapes) draw(own, kind, attributes);
    return own;
  }

  // Numbers are seen where there are several fingers, and which of them keys move.
  select(finger, areSeveral) {
    this.svg.classList.toggle("several", areSeveral);
    this.fingers?.forEach((mark, k) => mark.classList.toggle("selected", k === finger));
  }

  // Puts a mark at a place in mm, or takes it away.
  static put(mark, at) {
    mark.setAttribute("visibility", at ? "visible" : "hidden");
    if (!at) return;
    mark.setAttribute("transform", `translate(${at[0]} ${at[1]})`);
    mark.dataset.xMm = at[0];
    mark.dataset.yMm = at[1];
  }

  // An arrow a coil: as long as its gain over the largest one, turned by its phase.
  phasors(drive, phase) {
    const most = Math.max(...drive.map(([re, im]) => Math.hypot(re, im)), 1e-300);
    this.coils.forEach(({ x, y, arrow }, k) => {
      const [re, im] = drive[k];
      const size = (this.reach * Math.hypot(re, im)) / most, angle = Math.atan2(im, re) + phase;
      const tip = [x + size * Math.cos(angle), y + size * Math.sin(angle)];
      const turns = size > 0.15 * this.reach ? [2.6, -2.6] : []; // a short arrow has no room for a head
      const barb = turns.map((turn) =>
        `M${tip[0]} ${tip[1]}l${0.35 * size * Math.cos(angle + turn)} ${0.35 * size * Math.sin(angle + turn)}`);
      for (const line of arrow) line.setAttribute("d", `M${x} ${y}L${tip[0]} ${tip[1]}${barb.join("")}`);
    });
  }
}

function element(parent, kind, attributes) {
  const own = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) own.setAttribute(name, value);
  parent.append(own);
  return own;
}

function group(parent, attributes) {
  return element(parent, "g", attributes);
}

// Twice: a dark line under a light one is seen on every colour.
function draw(parent, kind, attributes, name = "") {
  return ["under", "over"].map((layer) => element(parent, kind, { ...attributes, class: `${layer} ${name}` }));
}
