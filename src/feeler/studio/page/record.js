// @ts-check
import { drawNormal } from "./noise.js";
/** Records: what is known of one antenna's touch, filled while it comes in. */

/** Header and arrays of a packed message. @param {ArrayBuffer} buffer @returns {[any, Object<string, {shape: number[], data: Float32Array}>]} */
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  /** @type {Object<string, {shape: number[], data: Float32Array}>} */
  const arrays = {};
  let place = 4 + length;
  for (const [name, shape] of header.arrays) {
    const count = shape.reduce((/** @type {number} */ a, /** @type {number} */ b) => a * b, 1);
    arrays[name] = { shape, data: new Float32Array(buffer, place, count) };
    place += 4 * count;
  }
  return [header, arrays];
}

const SIZES = ["angle", "place", "force", "base", "contact", "moment", "posterior", "belief"];

export class TouchRecord {
  constructor() {
    this.id = -1;
    /** @type {any} */
    this.antenna = null;
    /** @type {number[][][][]} */
    this.rims = [];
    this.total = 0;
    this.filled = 0; // samples of this touch
    this.shown = 0; // samples that can be drawn, those of the touch before among them
    this.preview = false;
    this.ended = false;
    this.hash = "";
    this.hand = false;
    this.live = false; // a board that goes on sending: what is oldest is dropped
    this.dropped = 0;
    this.missing = this.damaged = 0;
    this.source = "";
    this.waits = false; // another touch is asked for, of which nothing has come
    this.rate = 0; // samples a second of a recording; those that are shown may be others
    this.interval = 1;
    /** White noise on each reading that is shown [rad]. @type {{seed: number, sd: number} | undefined} */
    this.noise = undefined;
    this.name = "";
    /** @type {any[]} */
    this.commands = [];
    /** @type {Object<string, Float32Array>} */
    this.data = {};
    /** @type {Object<string, number>} */
    this.wide = {};
    /** @type {any} */
    this.reading = null;
    this.peak = 0;
    this.mode = null;
    this.newPeak = 0;
    /** Of an antenna in space what its view draws, and the angles (sample, plane, segment), of which one plane is shown. @type {any} */
    this.scene = null;
    /** @type {{shape: number[], data: Float32Array} | null} */
    this.bends = null;
    this.plane = 0;
    /** @type {number[]} */
    this.index = [];
    /** @type {{id: number, at: Map<number, number[]>} | null} */
    this.tips = null;
  }

  /** A touch begins; of the same antenna what is known of the touch before stays until it is overwritten. @param {any} header */
  begin(header) {
    const sameAntenna = JSON.stringify(this.antenna) === JSON.stringify(header.antenna);
    const same = sameAntenna && this.rims.length === header.rims.length && this.total === header.total && !this.hand && !header.hand && !header.live;
    Object.assign(this, { waits: false, mode: sameAntenna ? this.mode : null, id: header.id, antenna: header.antenna, rims: header.rims, total: header.total, hash: "",
      preview: header.preview, hand: Boolean(header.hand), live: Boolean(header.live), dropped: 0, missing: 0, damaged: 0, filled: 0, ended: false, commands: [], name: header.name || "",
      interval: header.interval || 1, noise: header.noise, reading: same ? this.reading : null });
    if (this.reading) this.reading.old = true;
    if (!same) {
      this.data = {};
      this.shown = 0;
      this.peak = 0;
      this.scene = this.bends = null;
      this.plane = 0;
    }
    this.newPeak = 0;
    this.index = header.antenna.sensors.map((/** @type {number} */ n) => n - 1);
  }

  /** A piece of it. @param {number} first @param {Object<string, {shape: number[], data: Float32Array}>} arrays */
  add(first, arrays) {
    const rows = arrays.angle.shape[0], skip = Math.max(0, rows - this.total);
    this.drop(first - this.dropped + rows - this.total);
    const at = first - this.dropped + skip;
    for (const name of SIZES) {
      const piece = arrays[name];
      if (!piece) continue;
      const wide = piece.shape.slice(1).reduce((a, b) => a * b, 1);
      if (!this.data[name]) {
        this.data[name] = new Float32Array(this.total * wide);
        this.wide[name] = wide;
      }
      this.data[name].set(piece.data.subarray(skip * wide), at * wide);
    }
    this.filled = at + rows - skip;
    this.shown = Math.max(this.shown, this.filled);
    if (this.live) { this.shown = this.filled; this.newPeak = 0; }
    const angle = arrays.angle.data, wide = this.wide.angle;
    const from = this.live ? this.data.angle : angle, count = this.live ? this.filled : rows;
    for (let k = 0; k < count; k++)
      for (const n of this.index) {
        const size = Math.abs(from[k * wide + n]);
        if (size > this.newPeak) this.newPeak = size;
      }
    this.peak = this.filled === this.total || this.hand || this.live ? this.newPeak : Math.max(this.peak, this.newPeak);
  }

  /** A whole touch in space. @param {any} scene @param {{shape: number[], data: Float32Array}} bends */
  turn(scene, bends) {
    Object.assign(this, { scene, bends });
    this.choose(Math.min(this.plane, bends.shape[1] - 1));
  }

  /** Show the bending of one plane. @param {number} plane */
  choose(plane) {
    const [rows, planes, wide] = this.bends.shape, data = new Float32Array(rows * wide);
    for (let k = 0; k < rows; k++) data.set(this.bends.data.subarray((k * planes + plane) * wide, (k * planes + plane + 1) * wide), k * wide);
    Object.assign(this, { plane, newPeak: 0, best: null, top: null });
    this.add(0, { angle: { shape: [rows, wide], data } });
  }

  /** Make room for so many samples, and for a quarter more. @param {number} over */
  drop(over) {
    if (!this.live || over <= 0) return;
    const gone = Math.min(over + this.total / 4, this.filled);
    for (const [name, values] of Object.entries(this.data)) values.copyWithin(0, gone * this.wide[name]);
    this.dropped += Math.max(gone, over);
    this.filled -= gone;
    this.tips = null;
  }

  /** What a decoder said of these samples; contact was noticed with sample `contact`, or never. @param {number} contact */
  judge(contact) {
    if (!this.data.posterior) return null;
    const wide = this.wide.posterior, noticed = contact < 0 ? -1 : Math.max(0, contact - this.dropped);
    return { posterior: { shape: [this.filled, wide], data: this.data.posterior.subarray(0, this.filled * wide) }, noticed: noticed * (noticed < 0 ? 1 : this.interval), step: this.interval };
  }

  /** Samples, counted from the first, that are of this touch and not of the one before. */
  get valid() {
    if (this.waits) return 0;
    return this.ended || this.hand ? this.shown : Math.min(this.filled, this.shown);
  }

  /** Samples that a picture of it spans. */
  get span() {
    return this.hand ? Math.max(this.filled, 100) : this.total;
  }

  /** Angle of a sensor at a sample [rad]. @param {number} sensor @param {number} sample */
  angle(sensor, sample) {
    const { noise } = this, value = this.data.angle ? this.data.angle[sample * this.wide.angle + this.index[sensor]] : 0;
    return noise ? value + noise.sd * drawNormal(noise.seed, sensor, sample) : value;
  }

  /** The tip at a sample [mm], kept for trails. @param {number} sample */
  tip(sample) {
    if (!this.tips || this.tips.id !== this.id) this.tips = { id: this.id, at: new Map() };
    const found = this.tips.at.get(sample);
    if (found && sample < this.filled) return found;
    const points = this.points(sample), tip = [points[points.length - 2], points[points.length - 1]];
    if (sample < this.filled) this.tips.at.set(sample, tip);
    return tip;
  }

  /** Base, hinges and tip at a sample (point, 2) [mm]. @param {number} sample */
  points(sample) {
    const n = this.antenna.segments.length, base = this.data.base, angle = this.data.angle, from = sample * n;
    let [x, y, heading] = base ? base.subarray(3 * sample, 3 * sample + 3) : [0, 0, 0];
    const points = new Float64Array(2 * n + 2);
    points[0] = x;
    points[1] = y;
    for (let k = 0; k < n; k++) {
      heading += angle ? angle[from + k] : this.antenna.rest[k];
      x += this.antenna.segments[k] * Math.sin(heading);
      y += this.antenna.segments[k] * Math.cos(heading);
      points[2 * k + 2] = x;
      points[2 * k + 3] = y;
    }
    return points;
  }
}
