// @ts-check
import { drawNormal } from "./noise.js";
/** The studio's decoder (feeler.studio.study), as it was trained on touches of one antenna at random locations. */

const CONFIRM = 3, BASELINE = 300, CLOSE = 1e-9;
export const KINDS = ["ball", "box", "triangle"];

/**
 * Angles of the sensors, sample after sample, and white noise of this SD [rad] on each, if any.
 * @typedef {{n: number, samples: number, data: Float64Array, noise?: {seed: number, sd: number}}} Felt
 */

/** Where contact is noticed (−1: nowhere), and the resting level of each sensor then. @param {Felt} felt @param {number} onset [rad] */
export function findOnset({ n, samples, data }, onset) {
  const level = new Float64Array(n);
  let running = 0, seen = 0;
  for (let k = 0; k < samples; k++) {
    let beyond = false;
    for (let s = 0; s < n; s++) {
      if (k === 0) level[s] = data[s];
      beyond = beyond || Math.abs(data[k * n + s] - level[s]) > onset;
    }
    running = beyond ? running + 1 : 0;
    if (running >= CONFIRM) return { at: k, level };
    if (beyond) continue;
    seen += 1;
    for (let s = 0; s < n; s++) level[s] += (data[k * n + s] - level[s]) / Math.min(seen, BASELINE);
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

/**
 * What a decoder was trained on, as feeler.studio.export._pack_expected wrote it: patterns over the sensors (pattern, sensor), which are orthonormal,
 * and of each template how much there is of each (template, sample, pattern). @param {any} packed
 */
export async function readTemplates({ shape, step, data }) {
  const [n, sensors, long, rank] = shape, all = await inflate(data), cosines = all.subarray(rank * sensors);
  const patterns = Float64Array.from(all.subarray(0, rank * sensors), (value) => value / 32767), series = new Float32Array(n * long * rank);
  for (let m = 0; m < rank; m++)
    for (let c = 0; c < n; c++) {
      const from = (m * n + c) * long, one = addCosines(cosines.subarray(from, from + long), long);
      for (let t = 0; t < long; t++) series[(c * long + t) * rank + m] = step * one[t];
    }
  return { patterns, series };
}

/** What of a touch lies outside what a decoder was trained on, in words, as feeler.studio.study.Range.find_outside. @param {any} range @param {any} wish @returns {string[]} */
export function findOutside(range, wish) {
  const found = [], short = (/** @type {number} */ value) => String(Number(value.toPrecision(3)));
  if (!KINDS.includes(wish.kind)) found.push(`a ${wish.kind} (trained: ${KINDS.join(", ")})`);
  for (const [name, unit] of [["location", ""], ["size", " mm"], ["speed", " m/s"]]) {
    const [low, high] = range[name], value = wish[name];
    if (value >= low * (1 - CLOSE) && value <= high * (1 + CLOSE)) continue;
    found.push(`${name} ${short(value)}${unit} (trained: ${low === high ? short(low) : `${short(low)} to ${short(high)}`})`);
  }
  for (const [name, unit] of [["approach", "°"], ["friction", ""]])
    if (wish[name] !== range[name]) found.push(`${name} ${short(wish[name])}${unit} (trained: ${short(range[name])}${unit})`);
  const more = (wish.objects || []).length;
  if (more) found.push(`${1 + more} objects (trained: one)`);
  return found;
}

export class Decoder {
  /** @param {any} taught As feeler.studio.export._keep has it. @param {{patterns: Float64Array, series: Float32Array}} templates */
  constructor(taught, { patterns, series }) {
    const [n, sensors, long, rank] = taught.templates.shape;
    Object.assign(this, { n, sensors, rank, patterns, series });
    this.window = long;
    this.kinds = taught.kinds;
    this.onset = taught.onset;
    this.limit = taught.limit;
    this.range = taught.range;
    this.scores = taught.scores;
    this.noise = taught.noise;
    this.weight = 1 / (2 * taught.noise ** 2 * taught.tempering);
    this.counts = KINDS.map((_, k) => this.kinds.filter((/** @type {number} */ kind) => kind === k).length);
  }

  /**
   * Posterior (sample, answer) over the kinds and "outside" of a touch, and the sample at which contact was noticed, or −1. Noise comes after contact
   * was noticed, and such a touch is never "outside", as in feeler.studio.study's accuracy in noise. @param {Felt} felt
   */
  decode(felt) {
    const { n, samples, noise } = felt, wide = KINDS.length + 1, { at, level } = findOnset(felt, this.onset);
    const posterior = new Float32Array(samples * wide).map((_, k) => (k % wide < KINDS.length ? 1 / KINDS.length : 0));
    const distance = new Float64Array(this.n), away = new Float64Array(n), rest = n * (this.onset / 3) ** 2;
    let side = 0, size = 0, outside = false;
    for (let k = at; at >= 0 && k < samples; k++) {
      const since = k - at;
      if (since >= this.window) { posterior.copyWithin(k * wide, (k - 1) * wide, k * wide); continue; }
      for (let s = 0; s < n; s++) away[s] = felt.data[k * n + s] - level[s];
      side ||= away.reduce((best, value) => (Math.abs(value) > Math.abs(best) ? value : best), 0) < 0 ? -1 : 1; // the mirror image of a touch from the left
      if (noise) for (let s = 0; s < n; s++) away[s] += noise.sd * drawNormal(noise.seed, s, k);
      size += this.compare(away, side, since, distance);
      outside ||= !noise && distance.reduce((a, b) => Math.min(a, b), Infinity) > this.limit[since] * (size + (since + 1) * rest);
      if (outside) posterior.fill(0, k * wide, (k + 1) * wide - 1)[(k + 1) * wide - 1] = 1;
      else this.weigh(distance, posterior, k * wide);
    }
    return { posterior, noticed: at, samples };
  }

  /** Add a sample's squared distance to each template; its own squared size. @param {Float64Array} away @param {number} side @param {number} since @param {Float64Array} distance */
  compare(away, side, since, distance) {
    const { n, rank, patterns, series, window: long } = this, share = new Float64Array(rank);
    let size = 0, seen = 0;
    away.forEach((value, s) => {
      size += value * value;
      for (let m = 0; m < rank; m++) share[m] += side * value * patterns[m * away.length + s];
    });
    for (const value of share) seen += value * value;
    const missed = Math.max(0, size - seen);
    for (let c = 0; c < n; c++) {
      const from = (c * long + since) * rank;
      let error = missed;
      for (let m = 0; m < rank; m++) error += (series[from + m] - share[m]) ** 2;
      distance[c] += error;
    }
    return size;
  }

  /** Shares of the kinds. @param {Float64Array} distance @param {Float32Array} posterior @param {number} from */
  weigh(distance, posterior, from) {
    const least = distance.reduce((a, b) => Math.min(a, b), Infinity), kinds = KINDS.map(() => 0);
    distance.forEach((value, c) => { kinds[this.kinds[c]] += Math.exp(this.weight * (least - value)) / this.counts[this.kinds[c]]; });
    const all = kinds.reduce((a, b) => a + b, 0);
    kinds.forEach((one, k) => { posterior[from + k] = one / all; });
  }
}
