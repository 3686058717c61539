// Coils and screws that are moved, by a pointer or by numbers; the score follows.

const KINDS = [["actuators", "coil"], ["screws", "screw"]];

export class MovableParts {
  // `view`: has parts, queue and waits().
  constructor(view) {
    this.view = view;
    this.all = [];
    const { parts } = view;
    parts.which.addEventListener("change", () => this.showPlace());
    parts.move.addEventListener("submit", (event) => {
      event.preventDefault();
      const part = this.all[parts.which.selectedIndex];
      this.move(part, [parts.partX.valueAsNumber, parts.partY.valueAsNumber], event.timeStamp);
    });
  }

  fit(board) {
    const { which } = this.view.parts, chosen = Math.max(which.selectedIndex, 0);
    this.all = KINDS.flatMap(([part, word]) => board[part].map((own, index) => ({
      part, index, at: own.at_mm, name: `${word} ${own.name ?? index + 1}`,
    })));
    which.replaceChildren(...this.all.map(({ name }) => new Option(name)));
    which.selectedIndex = Math.min(chosen, this.all.length - 1);
    this.showPlace();
  }

  showPlace() {
    const { parts } = this.view, part = this.all[parts.which.selectedIndex];
    if (!part) return;
    parts.partX.value = part.at[0].toFixed(2);
    parts.partY.value = part.at[1].toFixed(2);
  }

  // The part under a place, if parts are to be moved.
  at(place, reach) {
    if (!this.view.parts.moving.open) return undefined;
    const away = ({ at }) => Math.hypot(at[0] - place[0], at[1] - place[1]);
    const [nearest] = [...this.all].sort((one, two) => away(one) - away(two));
    return nearest && away(nearest) <= reach ? nearest : undefined;
  }

  move(part, [x, y], time) {
    const { view } = this;
    view.parts.which.selectedIndex = this.all.indexOf(part);
    const { part: kind, index } = part;
    view.queue.put({ type: "move", part: kind, index, x_mm: x, y_mm: y }, `${kind} ${index}`, time);
    view.waits();
  }
}
