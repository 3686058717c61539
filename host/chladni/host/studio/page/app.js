// Starts the page: boards, each played by an emulated device of its own on the server.

import { Connection } from "./connection.js";
import { startTheme } from "./theme.js";
import { View } from "./view.js";

const address = new URL("socket", location.href);
address.protocol = address.protocol.replace("http", "ws");
const parent = document.getElementById("views"), button = document.getElementById("second");
const views = [];

function open() {
  const connect = (listener) => new Connection(address, listener);
  views.push(new View(document.getElementById("view"), parent, connect));
}

startTheme(document.getElementById("theme"));
parent.replaceChildren();
open();
button.hidden = false;
button.addEventListener("click", () => {
  if (views.length > 1) views.pop().close();
  else open();
  parent.classList.toggle("two", views.length > 1);
  button.setAttribute("aria-pressed", views.length > 1);
});
