// The coils' fields of a board, and their sum for a drive.

export class Field {
  // `data`: float32, (coils, 2, rows from the top, columns), metres per newton.
  constructor(board, data) {
    this.columns = board.x_mm.length;
    this.rows = board.y_mm.length;
    this.xMm = board.x_mm;
    this.yMm = board.y_mm;
    this.count = this.columns * this.rows;
    this.coils = board.actuators.length;
    const values = new Float32Array(data);
    if (values.length !== this.coils * 2 * this.count) throw new Error("fields of another board");
    this.planes = [];
    for (let k = 0; k < 2 * this.coils; k += 1) {
      this.planes.push(values.subarray(k * this.count, (k + 1) * this.count));
    }
    this.real = new Float32Array(this.count);
    this.imaginary = new Float32Array(this.count);
    this.peak = 0;
    this.peakAt = 0;
  }

  // W = sum of drive × field, and where |W| is largest. `drive`: [real, imaginary] of every coil.
  add(drive) {
    const { real, imaginary, count } = this;
    real.fill(0);
    imaginary.fill(0);
    drive.forEach(([re, im], coil) => {
      const across = this.planes[2 * coil], behind = this.planes[2 * coil + 1];
      for (let k = 0; k < count; k += 1) {
        real[k] += re * across[k] - im * behind[k];
        imaginary[k] += re * behind[k] + im * across[k];
      }
    });
    let most = -1;
    for (let k = 0; k < count; k += 1) {
      const power = real[k] * real[k] + imaginary[k] * imaginary[k];
      if (power > most) {
        most = power;
        this.peakAt = k;
      }
    }
    this.peak = Math.sqrt(most);
  }

  // |mean of W| over a disc, all in mm.
  meanAround([x, y], radius) {
    let re = 0, im = 0, number = 0;
    for (let k = 0; k < this.count; k += 1) {
      const row = Math.floor(k / this.columns);
      const away = Math.hypot(this.xMm[k % this.columns] - x, this.yMm[this.rows - 1 - row] - y);
      if (away > radius) continue;
      re += this.real[k];
      im += this.imaginary[k];
      number += 1;
    }
    return number > 0 ? Math.hypot(re, im) / number : 0;
  }

  peakMm() {
    const row = Math.floor(this.peakAt / this.columns);
    return [this.xMm[this.peakAt % this.columns], this.yMm[this.rows - 1 - row]];
  }
}
