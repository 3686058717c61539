// What a finger feels, as a sound.

const RATE_HZ = 48000, LOUDEST = 0.8;

// `values` at `rate` a second, joined by straight lines; as loud as may be.
export function listen(values, rate) {
  const context = new AudioContext(), count = Math.ceil((values.length * RATE_HZ) / rate);
  const buffer = context.createBuffer(1, count, RATE_HZ), sound = buffer.getChannelData(0);
  const most = values.reduce((found, value) => Math.max(found, Math.abs(value)), 0) || 1;
  for (let k = 0; k < count; k += 1) {
    const at = (k * rate) / RATE_HZ, low = Math.floor(at), next = values[low + 1] ?? 0;
    sound[k] = (LOUDEST / most) * (values[low] + (at - low) * (next - values[low]));
  }
  const source = new AudioBufferSourceNode(context, { buffer });
  source.connect(context.destination);
  source.addEventListener("ended", () => context.close());
  source.start();
  return sound;
}
