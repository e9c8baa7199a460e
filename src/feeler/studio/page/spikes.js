// @ts-check
import { make, makeCanvas, makeSlider, write } from "./dom.js";
/** @typedef {import("./studio.js").App} App */
/** @typedef {import("./panels.js").Panel} Panel */
/** What a nerve would say of the touch shown: sensilla as in feeler.spikes, on both sides at every sensor, and their Poisson trains. */

const NERVE_LEFT = 46, NERVE_RIGHT = 10, NERVE_BOTTOM = 6, NERVE_TOP = 4, GAIN = 33.5, NERVE_SIDES = ["#f1784b", "#4aa3d8"];
/** CAMPANIFORM of feeler.spikes. */
export const SENSILLUM = { tau: 3.8595, a: 707.6, b: 2.2615, c: 54.287, d: -41.1551, ceiling: 1000 };

/** Sensilla on both sides of so many sensors, given one sample after the other. */
export class Nerve {
  /** @param {number} count @param {number} step between samples [ms] @param {number} gain [1/rad] @param {number} [seed] */
  constructor(count, step, gain, seed = 47) {
    const units = 2 * count;
    this.count = count;
    this.step = step;
    this.gain = gain;
    this.samples = 0;
    this.coarse = false;
    this.greatest = 0;
    this.rate = new Float64Array(units);
    this.excess = new Float64Array(units);
    this.before = new Float64Array(units);
    this.state = seed;
    this.left = Float64Array.from({ length: units }, () => this.draw());
    /** @type {{unit: number, time: number}[]} */
    this.spikes = [];
  }

  /** An exponential variate of mean 1 (mulberry32). */
  draw() {
    this.state = (this.state + 0x6d2b79f5) | 0;
    let t = Math.imul(this.state ^ (this.state >>> 15), 1 | this.state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return -Math.log(1 - ((t ^ (t >>> 14)) >>> 0) / 4294967296);
  }

  /** The next sample; what is missing counts as unchanged. @param {(sensor: number) => number} read bending [rad] */
  push(read) {
    const end = this.samples * this.step;
    for (let k = 0; k < this.rate.length; k++) {
      const bend = read(k % this.count) * (k < this.count ? this.gain : -this.gain);
      const rate = this.rate[k] = this.answer(k, Number.isFinite(bend) ? Math.max(0, bend) : this.before[k]);
      this.greatest = Math.max(this.greatest, rate);
      const expected = rate * this.step * 1e-3;
      let spent = 0;
      while (spent + this.left[k] < expected) {
        spent += this.left[k];
        this.spikes.push({ unit: k, time: end - this.step * (1 - spent / expected) });
        this.left[k] = this.draw();
      }
      this.left[k] -= expected - spent;
    }
    this.samples += 1;
  }

  /** Rate [Hz] of a unit that feels this now: half of the change, the exact adaptation, the other half. @param {number} k @param {number} stimulus */
  answer(k, stimulus) {
    const { tau, a, b, c, d, ceiling } = SENSILLUM, change = stimulus - this.before[k];
    this.before[k] = stimulus;
    if (change || this.excess[k]) {
      const from = this.excess[k] + change / 2, size = Math.abs(from);
      this.excess[k] = (size && from * (1 + ((b - 1) * this.step * size ** (b - 1)) / tau) ** (-1 / (b - 1))) + change / 2;
      if (this.step * b * ((tau * Math.abs(change)) / this.step) ** ((b - 1) / b) > tau) this.coarse = true;
    }
    return Math.min(Math.max(a * this.excess[k] + c * stimulus + d, 0), ceiling);
  }
}

/** @param {App} app @returns {Panel} */
export function makeSpikePanel(app) {
  let gain = GAIN, key = "", nerve = new Nerve(0, 1, gain);
  const { canvas, redraw } = makeCanvas({ class: "raster", role: "img", "aria-label": "Spikes of every sensillum over time" }, draw);
  const slider = makeSlider({ label: "Gain", min: 5, max: 1000, log: true, unit: "/rad", marks: [GAIN], tag: "own",
    read: () => gain, take: (value) => { gain = value; app.refresh(); } });
  const words = make("p", { class: "caption" }), scale = make("span", { class: "scale" });
  const more = make("details", { ontoggle: () => app.refresh() },
    make("summary", {}, "Spikes: what a nerve would say", scale), canvas, slider.element, words);
  const element = make("section", { class: "panel spike-panel", "aria-label": "Spikes" }, more);

  /** Bring the nerve up to what is known of the touch. */
  function listen() {
    const record = app.records.A, now = [record.id, record.dropped, record.index.length, record.interval, gain].join();
    if (now !== key || nerve.samples > record.filled) {
      key = now;
      nerve = new Nerve(record.index.length, record.interval, gain);
    }
    while (nerve.samples < record.filled) {
      const sample = nerve.samples;
      nerve.push((sensor) => record.angle(sensor, sample));
    }
  }

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function draw(c, w, h) {
    listen();
    const record = app.records.A, wide = w - NERVE_LEFT - NERVE_RIGHT, high = h - NERVE_TOP - NERVE_BOTTOM, row = high / Math.max(nerve.count, 1);
    c.fillStyle = "#07060d";
    c.fillRect(NERVE_LEFT, NERVE_TOP, wide, high);
    for (const { unit, time } of nerve.spikes) {
      c.fillStyle = NERVE_SIDES[unit < nerve.count ? 0 : 1];
      const x = NERVE_LEFT + (wide * (time / nerve.step + 0.5)) / record.span, y = NERVE_TOP + high - row * ((unit % nerve.count) + 1);
      c.fillRect(x - 0.5, y, 1, Math.max(row, 1.5));
    }
    c.fillStyle = app.colours.soft;
    c.font = "11px system-ui, sans-serif";
    c.textAlign = "right";
    c.fillText("tip", NERVE_LEFT - 6, NERVE_TOP + 10);
    c.fillText("base", NERVE_LEFT - 6, NERVE_TOP + high);
    const now = NERVE_LEFT + (wide * app.time) / app.duration();
    c.fillStyle = app.colours.accent;
    c.fillRect(now - 0.75, NERVE_TOP, 1.5, high);
  }

  function update() {
    if (!more.open) { scale.textContent = ""; return; }
    listen();
    slider.update();
    scale.textContent = ` · ${nerve.spikes.length} spikes, up to ${write(nerve.greatest)} Hz`;
    words.textContent = "Two campaniform sensilla at every sensor, one for each side (in two colours), after Szczecinski et al. 2021, as Poisson trains. How strongly an antenna drives them is not known: the gain is a choice." +
      (nerve.coarse ? " These samples are too coarse for how fast sensilla adapt: the rates are rough." : "");
  }
  const isShown = () => !app.isSpatial() && app.records.A.shown > 0;
  return { element, place: "middle", isShown, update, redraw: () => { if (more.open) redraw(); } };
}
