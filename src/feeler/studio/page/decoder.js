// @ts-check
/** The studio's decoder (feeler.decoding.StreamDecoder, as feeler.studio.study sets it up), with what thirty touches of one antenna taught it. */

const LOUDNESS = 0.2, ONSET = 0.02 * LOUDNESS, FLOOR = 0.004, CONFIRM = 3, BASELINE = 300, LAGS = [0, 2, 4, 6, 8], MAX_LAG = 4;

/** Angles of the sensors, sample after sample. @typedef {{n: number, samples: number, data: Float64Array}} Felt */

/** Where contact is noticed (−1: nowhere), and the resting level of each sensor then. @param {Felt} felt @param {number} factor */
export function findOnset({ n, samples, data }, factor) {
  const level = new Float64Array(n);
  let running = 0, seen = 0;
  for (let k = 0; k < samples; k++) {
    let beyond = false;
    for (let s = 0; s < n; s++) {
      if (k === 0) level[s] = factor * data[s];
      beyond = beyond || Math.abs(factor * data[k * n + s] - level[s]) > ONSET;
    }
    running = beyond ? running + 1 : 0;
    if (running >= CONFIRM) return { at: k, level };
    if (beyond) continue;
    seen += 1;
    for (let s = 0; s < n; s++) level[s] += (factor * data[k * n + s] - level[s]) / Math.min(seen, BASELINE);
  }
  return { at: -1, level };
}

/** Whole numbers of 16 bits, unpacked. @param {string} text */
async function inflate(text) {
  if (typeof DecompressionStream === "undefined") throw new Error("This browser is too old to unpack what the decoder learned: touches are computed, and not judged.");
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Int16Array(await new Response(stream).arrayBuffer());
}

/** A series from its cosines, the inverse of the orthonormal DCT. @param {Int16Array} from @param {number} long */
function addCosines(from, long) {
  const series = new Float64Array(long), wave = Float64Array.from({ length: 4 * long }, (_, k) => Math.cos((Math.PI * k) / (2 * long)));
  from.forEach((value, f) => {
    if (!value) return;
    const high = value * Math.sqrt((f ? 2 : 1) / long);
    for (let t = 0; t < long; t++) series[t] += high * wave[(f * (2 * t + 1)) % (4 * long)];
  });
  return series;
}

/** What each class is expected to feel like (sample, sensor), as feeler.studio.alone._pack_expected wrote it. @param {any} kept */
export async function readExpected({ shape, step, data }) {
  const [classes, n, long, rank] = shape, all = await inflate(data), cosines = all.subarray(rank * n);
  const found = Array.from({ length: classes }, () => new Float32Array(long * n));
  for (let m = 0; m < rank; m++)
    found.forEach((expected, c) => {
      const from = (m * classes + c) * long, series = addCosines(cosines.subarray(from, from + long), long);
      for (let s = 0; s < n; s++) {
        const share = (step * all[m * n + s]) / 32767;
        for (let t = 0; t < long; t++) expected[t * n + s] += share * series[t];
      }
    });
  return found;
}

export class Decoder {
  /** @param {Float32Array[]} expected Of each class. @param {number} n Sensors. @param {number} peak Greatest angle of its touches [rad]. @param {number} correlation τ, as `temper` found it. */
  constructor(expected, n, peak, correlation) {
    this.expected = expected;
    this.window = expected[0].length / n - 2 * MAX_LAG;
    this.peak = peak;
    this.factor = LOUDNESS / peak;
    this.correlation = correlation;
  }

  /** Posterior (sample, class) of a touch, and the sample at which contact was noticed, or −1. @param {Felt} felt */
  decode(felt) {
    const { n, data } = felt, samples = Math.min(felt.samples, this.window), classes = this.expected.length;
    const { at, level } = findOnset(felt, this.factor), posterior = new Float32Array(samples * classes).fill(1 / classes);
    const evidence = new Float64Array(classes * LAGS.length).fill(0), away = new Float64Array(n);
    const weight = 1 / (2 * FLOOR * FLOOR * this.correlation);
    for (let k = at; at >= 0 && k < samples; k++) {
      for (let s = 0; s < n; s++) away[s] = this.factor * data[k * n + s] - level[s];
      this.expected.forEach((expected, c) => LAGS.forEach((lag, l) => {
        const from = (k - at + lag) * n;
        let error = 0;
        for (let s = 0; s < n; s++) error += (expected[from + s] - away[s]) ** 2;
        evidence[c * LAGS.length + l] -= weight * error;
      }));
      this.weigh(evidence, posterior, k * classes);
    }
    return { posterior, noticed: at < samples ? at : -1, samples };
  }

  /** @param {Float64Array} evidence @param {Float32Array} posterior @param {number} from */
  weigh(evidence, posterior, from) {
    const top = evidence.reduce((a, b) => Math.max(a, b), -Infinity), likelihood = this.expected.map((_, c) =>
      LAGS.reduce((sum, _lag, l) => sum + Math.exp(evidence[c * LAGS.length + l] - top), 0));
    const all = likelihood.reduce((a, b) => a + b, 0);
    likelihood.forEach((one, c) => { posterior[from + c] = one / all; });
  }
}
