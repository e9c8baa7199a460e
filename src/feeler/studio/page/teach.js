// @ts-check
/** The studio's decoder (feeler.decoding.StreamDecoder, as feeler.studio.study sets it up), taught by thirty touches of one antenna. */

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

export class Decoder {
  /** @param {Felt[]} touches One of each class. @param {number} correlation τ, as `temper` found it. */
  constructor(touches, correlation) {
    this.window = touches[0].samples;
    this.correlation = correlation;
    this.peak = touches.reduce((top, { data }) => data.reduce((a, b) => Math.max(a, Math.abs(b)), top), 0);
    this.factor = LOUDNESS / this.peak;
    this.expected = touches.map((felt) => this.cut(felt));
  }

  /** A touch from MAX_LAG before its noticed contact, less its resting level; null without contact. @param {Felt} felt */
  cut(felt) {
    const { at, level } = findOnset(felt, this.factor), { n, samples, data } = felt, long = this.window + 2 * MAX_LAG;
    if (at < 0) return null;
    const found = new Float32Array(long * n);
    for (let k = 0; k < long; k++) {
      const from = Math.max(0, Math.min(at + k - MAX_LAG, samples - 1)) * n;
      for (let s = 0; s < n; s++) found[k * n + s] = this.factor * data[from + s] - level[s];
    }
    return found;
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
        if (!expected) { evidence[c * LAGS.length + l] = -Infinity; return; }
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
