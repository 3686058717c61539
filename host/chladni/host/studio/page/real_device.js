// A real device at a port of the server's machine: attach it, ask it, give it orders.

import { showRows } from "./scorecard.js";

export class RealDevice {
  // `view`: has parts, section and source.
  constructor(view) {
    this.view = view;
    this.port = null;
    const { parts, section } = view;
    parts.attach.addEventListener("submit", (event) => {
      event.preventDefault();
      view.source.send({ type: "attach", port: this.port ? null : parts.port.value });
      this.say(this.port ? "" : "Asking who is there.");
    });
    for (const button of section.querySelectorAll("[data-order]")) {
      button.addEventListener("click", () => this.order(button.dataset.order, ""));
    }
    parts.setting.addEventListener("change", () => this.showValue());
    parts.set.addEventListener("submit", (event) => {
      event.preventDefault();
      this.order("set", `${parts.setting.value}=${parts.value.value}`);
    });
  }

  hello({ ports }) {
    const { parts } = this.view;
    parts.device.hidden = false;
    if (this.port) return;
    parts.port.replaceChildren(...ports.map((name) => new Option(name)));
    parts.attachButton.disabled = ports.length === 0;
    this.say(ports.length === 0 ? "No port was found. Name one when you start the studio: --device PORT." : "");
  }

  order(what, text) {
    const warning = "This sets pins and limits from the board file and restarts the device. Go on?";
    if (what === "configure" && !confirm(warning)) return;
    this.view.source.send({ type: "order", what, text });
    this.say("At work.");
  }

  doing({ what, done, all }) {
    this.say(all > 0 ? `${what}: ${done} of ${all}` : `${what} begins`);
  }

  shown({ port, said, rows, settings }) {
    const { parts } = this.view;
    this.port = port;
    parts.attachButton.textContent = port ? "Let go" : "Attach";
    parts.port.disabled = port !== null;
    parts.connected.hidden = port === null;
    this.say(said);
    if (!port) return;
    showRows(parts.deviceRows, rows);
    const chosen = parts.setting.value;
    this.settings = new Map(settings);
    parts.setting.replaceChildren(...[...this.settings.keys()].map((name) => new Option(name)));
    if (this.settings.has(chosen)) parts.setting.value = chosen;
    this.showValue();
  }

  showValue() {
    const { parts } = this.view;
    parts.value.value = this.settings.get(parts.setting.value);
  }

  // The server has gone, and with it the port.
  lost() {
    this.shown({ port: null, said: "" });
  }

  say(text) {
    this.view.parts.deviceSaid.textContent = text;
  }
}
