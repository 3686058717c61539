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
    this.findPeak();
  }

  // Amplitudes of signals at tones of their own: powers add up. No phase is left, so none moves.
  addSeveral(drives) {
    const { real, imaginary, count } = this, powers = new Float32Array(count);
    for (const drive of drives) {
      this.add(drive);
      for (let k = 0; k < count; k += 1) powers[k] += real[k] * real[k] + imaginary[k] * imaginary[k];
    }
    for (let k = 0; k < count; k += 1) real[k] = Math.sqrt(powers[k]);
    imaginary.fill(0);
    this.findPeak();
  }

  findPeak() {
    const { real, imaginary, count } = this;
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
      const point = this.pointMm(k);
      if (Math.hypot(point[0] - x, point[1] - y) > radius) continue;
      re += this.real[k];
      im += this.imaginary[k];
      number += 1;
    }
    return number > 0 ? Math.hypot(re, im) / number : 0;
  }

  // Means of |W|² over a fingertip's disc at each point of the picture, as far as it is on the board.
  discs(radius) {
    const { columns, rows, count, real, imaginary } = this, width = columns + 1;
    const before = new Float64Array(rows * width); // of each row, summed from its left
    for (let k = 0; k < count; k += 1) {
      const at = Math.floor(k / columns) * width + (k % columns);
      before[at + 1] = before[at] + real[k] * real[k] + imaginary[k] * imaginary[k];
    }
    const step = [this.xMm, this.yMm].map((axis) => (axis.at(-1) - axis[0]) / (axis.length - 1));
    const half = Math.floor(radius / step[1] + 1e-9), means = new Float64Array(count);
    for (let k = 0; k < count; k += 1) {
      const row = Math.floor(k / columns), column = k % columns;
      let sum = 0, number = 0;
      for (let r = Math.max(row - half, 0); r <= Math.min(row + half, rows - 1); r += 1) {
        const reach = Math.floor(Math.sqrt(radius ** 2 - ((r - row) * step[1]) ** 2) / step[0] + 1e-9);
        const first = Math.max(column - reach, 0), last = Math.min(column + reach, columns - 1);
        sum += before[r * width + last + 1] - before[r * width + first];
        number += last - first + 1;
      }
      means[k] = sum / number;
    }
    return means;
  }

  // The fingertip that moves most, `apart` mm or more from a place: where, and how many decibels
  // less than one at the place. Undefined on a board that has none so far away.
  secondFinger([x, y], radius, apart) {
    const means = this.discs(radius);
    let own = 0, nearest = Infinity, loudest = 0, at;
    for (let k = 0; k < this.count; k += 1) {
      const point = this.pointMm(k), away = Math.hypot(point[0] - x, point[1] - y);
      if (away < nearest) [nearest, own] = [away, means[k]];
      if (away > apart && means[k] > loudest) [loudest, at] = [means[k], point];
    }
    return at && own > 0 ? { db: 10 * Math.log10(own / loudest), at } : undefined;
  }

  peakMm() {
    return this.pointMm(this.peakAt);
  }

  pointMm(index) {
    const row = Math.floor(index / this.columns);
    return [this.xMm[index % this.columns], this.yMm[this.rows - 1 - row]];
  }
}
