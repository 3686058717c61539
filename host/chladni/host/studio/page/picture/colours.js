// Colour maps made in OKLab, whose lightness is even to the eye. Colours differ along yellow and
// blue only, which eyes that confuse red with green tell apart.

const STEPS = 256;

// OKLab to gamma-encoded sRGB, 0 to 255 (B. Ottosson, "A perceptual color space", 2020).
export function fromOklab(lightness, a, b) {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ].map((linear) => {
    const part = Math.min(Math.max(linear, 0), 1);
    const encoded = part <= 0.0031308 ? 12.92 * part : 1.055 * part ** (1 / 2.4) - 0.055;
    return Math.round(255 * encoded);
  });
}

// Dark blue to light yellow, evenly: for what has no sign.
function sequential(share) {
  const blue = [0.22, -0.01, -0.1], yellow = [0.95, -0.02, 0.14];
  return fromOklab(...blue.map((from, k) => from + (yellow[k] - from) * share));
}

// Light grey in the middle, and as far from it on both sides: for what goes up and down.
function diverging(share) {
  const side = 2 * share - 1, far = Math.abs(side);
  const hue = side < 0 ? [-0.04, -0.14] : [0.045, 0.1];
  return fromOklab(0.96 - 0.53 * far, hue[0] * far, hue[1] * far);
}

// 256 pixels as the bytes of an ImageData, least significant first: red, green, blue, opaque.
function pixels(map) {
  const table = new Uint32Array(STEPS);
  const bytes = new Uint8Array(table.buffer);
  for (let k = 0; k < STEPS; k += 1) bytes.set([...map(k / (STEPS - 1)), 255], 4 * k);
  return table;
}

export const MAPS = { energy: pixels(sequential), displacement: pixels(diverging) };
