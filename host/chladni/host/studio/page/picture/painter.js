// A field's sum on a canvas of one pixel a point; CSS scales it, smoothly, to the board's size.

import { MAPS } from "./colours.js";

export class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
  }

  get works() {
    return this.context !== null;
  }

  // The points lie from edge to edge, so half a pixel goes beyond each edge.
  fit(field) {
    const { canvas } = this, { columns, rows } = field;
    canvas.width = columns;
    canvas.height = rows;
    canvas.style.width = `${(100 * columns) / (columns - 1)}%`;
    canvas.style.height = `${(100 * rows) / (rows - 1)}%`;
    canvas.style.left = `${-50 / (columns - 1)}%`;
    canvas.style.top = `${-50 / (rows - 1)}%`;
    if (!this.works) return;
    this.image = this.context.createImageData(columns, rows);
    this.pixels = new Uint32Array(this.image.data.buffer);
  }

  clear() {
    if (this.works) this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  // |W| over its largest value.
  energy(field) {
    const { real, imaginary, count } = field, { pixels } = this, map = MAPS.energy;
    const scale = field.peak > 0 ? 255 / field.peak : 0;
    for (let k = 0; k < count; k += 1) {
      const size = Math.sqrt(real[k] * real[k] + imaginary[k] * imaginary[k]);
      pixels[k] = map[(scale * size + 0.5) | 0];
    }
    this.context.putImageData(this.image, 0, 0);
  }

  // Re(W exp(i phase)) over the largest |W|.
  displacement(field, phase) {
    const { real, imaginary, count } = field, { pixels } = this, map = MAPS.displacement;
    const scale = field.peak > 0 ? 127.5 / field.peak : 0;
    const across = scale * Math.cos(phase), behind = scale * Math.sin(phase);
    for (let k = 0; k < count; k += 1) {
      pixels[k] = map[(128 + across * real[k] - behind * imaginary[k]) | 0];
    }
    this.context.putImageData(this.image, 0, 0);
  }

  // All colours of a map, from the least to the most.
  static bar(canvas, name) {
    const context = canvas.getContext("2d");
    if (context === null) return;
    const image = context.createImageData(256, 1);
    new Uint32Array(image.data.buffer).set(MAPS[name]);
    context.putImageData(image, 0, 0);
  }
}
