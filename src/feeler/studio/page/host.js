// @ts-check
import { Chain } from "./chain.js";
import { Decoder, findOutside, readTemplates } from "./decoder.js";
import { layOut, placeObject, scaleShape } from "./place.js";
/** What answers a page that has no server: the same messages as feeler.studio.session, from an engine in the page. */

const TIMESTEP = 0.05, PREVIEW = 0.1, INTERVAL = 1; // ms, as feeler.touch and the studio's preview; an antenna's own are as many times finer
const FIRST = 12, PIECE = 46; // samples of a piece; the first is short, so that something is seen at once
const FRAME = 1000 / 60, MAX_SPEED = 1.2, MAX_TURN = 0.03, GLIDE = 6, LONGEST = 4000, STILL = 2e-5; // of a hand, as feeler.studio.live
const ORDER = ["touch", "hand", "family"]; // what is done first
const FAMILY = { kinds: ["ball", "box", "triangle"], sizes: [1.5, 3], locations: [0.5, 0.6, 0.7, 0.8, 0.9] }; // the paper's touches

/** Numbers that Python packed. @param {string} text */
function readNumbers(text) {
  return new Float64Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
}

/** What a page is shown of a chain, sample by sample. */
class Readings {
  /** @param {Chain} chain */
  constructor(chain) {
    this.chain = chain;
    /** @type {any[]} */
    this.rows = [];
  }

  add() {
    const { base, w, objects, contacts } = this.chain;
    this.rows.push({ angle: w.angle.slice(), base: [base.x, base.y, base.heading],
      place: objects.flatMap((o) => [o.x + base.x, o.y + base.y, Math.atan2(o.forward[0], o.forward[1])]),
      force: objects.flatMap((o) => [o.fx, o.fy]), contact: [contacts.press > 0 ? contacts.place / contacts.press : NaN] });
  }

  /** All that came since the last call. */
  take() {
    /** @type {any} */
    const found = {}, rows = this.rows.splice(0);
    for (const name of ["angle", "base", "place", "force", "contact"]) {
      const wide = rows[0][name].length, data = new Float32Array(rows.length * wide);
      rows.forEach((row, k) => data.set(row[name], k * wide));
      found[name] = { shape: [rows.length, wide], data };
    }
    return found;
  }
}

/** Angles of an antenna's sensors, kept while a touch goes on. */
class Sensed {
  /** @param {any} antenna @param {number} samples @param {{seed: number, sd: number}} [noise] on each reading [rad] */
  constructor(antenna, samples, noise) {
    this.noise = noise;
    this.index = antenna.drawn.sensors.map((/** @type {number} */ hinge) => hinge - 1);
    this.n = this.index.length;
    this.samples = 0;
    this.data = new Float64Array(samples * this.n);
  }

  /** @param {Float64Array} angle */
  add(angle) {
    this.index.forEach((/** @type {number} */ hinge, /** @type {number} */ s) => { this.data[this.samples * this.n + s] = angle[hinge]; });
    this.samples += 1;
  }
}

/** An antenna's constants with stiffness ~ exp(rate · n), its total compliance and its damping over stiffness. @param {Float64Array} constants @param {number} rate */
export function grade(constants, rate) {
  const found = constants.slice(), n = constants.length / 16, K = 3 * n, C = 4 * n; // rows of stiffness and damping, see chain.js
  let compliance = 0, own = 0;
  for (let k = 0; k < n; k++) { compliance += 1 / constants[K + k]; own += Math.exp(-rate * k); }
  for (let k = 0; k < n; k++) {
    found[K + k] = (Math.exp(rate * k) * own) / compliance;
    found[C + k] = (found[K + k] * constants[C + k]) / constants[K + k];
  }
  return found;
}

export class Host {
  /** @param {any} config As feeler.studio.export makes it. @param {(header: any, arrays: any) => void} say */
  constructor(config, say) {
    this.config = config;
    this.say = say;
    /** What is being done. @type {Object<string, {about: any, steps: Iterator<void>}>} */
    this.doing = {};
    /** By antenna and speed. @type {Object<string, Promise<Decoder>>} */
    this.decoders = {};
    /** @type {Object<string, number[]>} */
    this.aims = {};
    this.ended = false;
    this.replays = Boolean(config.commands);
    this.antennas = config.antennas.map((/** @type {any} */ one) => ({ ...one, constants: readNumbers(one.constants) }));
  }

  /** One message of the page; the newest of a kind ends the one before. @param {any} message */
  take(message) {
    const { type } = message;
    if (type === "hello") this.say({ type: "catalogue", presets: {}, first: this.config.state.A, state: this.config.state, version: this.config.version }, {});
    else if (type === "touch") this.begin(message, this.touch(message));
    else if (type === "study") this.study(message);
    else if (type === "hand") { this.ended = false; this.aims = {}; this.begin(message, this.hold(message)); }
    else if (type === "family") this.begin(message, this.family(message));
    else if (type === "aim" && message.what === "end") this.ended = true;
    else if (type === "aim") this.aims[message.what] = [message.x, message.y, message.turn];
    else if (type === "stop") this.doing = {};
  }

  /** @param {any} about @param {Iterator<void>} steps */
  begin(about, steps) { this.doing[about.type] = { about, steps }; }

  /** Work for some ms; how long to wait before the next turn, −1 for ever. @param {number} ms */
  work(ms) {
    const until = performance.now() + ms;
    do {
      const name = ORDER.find((one) => this.doing[one]);
      if (!name) return -1;
      const task = this.doing[name];
      try {
        const { done, value } = task.steps.next();
        if (done && this.doing[name] === task) delete this.doing[name];
        if (name === "hand" && !done) return /** @type {any} */ (value);
      } catch (error) {
        delete this.doing[name];
        this.say({ type: "error", of: name, slot: "A", id: task.about.id, message: error instanceof Error ? error.message : String(error) }, {});
      }
    } while (performance.now() < until);
    return 0;
  }

  /** @param {any} wish */
  find(wish) {
    const text = JSON.stringify(wish), found = this.antennas.find((/** @type {any} */ one) => JSON.stringify(one.wish) === text);
    if (!found) throw new Error("This page has no such antenna.");
    return found;
  }

  /** A shape of half-width 1 mm made larger. @param {string} kind @param {number} size */
  shape(kind, size) {
    const one = this.config.shapes[kind];
    if (!one || !(size > 0)) throw new Error(`This page has no ${kind} of ${size} mm.`);
    return one.unbounded ? one : scaleShape(one, size);
  }

  /** The chain of a wish at time 0. @param {any} antenna @param {any} touch @param {number} most its timestep, but for what the antenna needs */
  makeChain(antenna, touch, most) {
    const timestep = most / (antenna.finer || 1);
    const c = new Chain(antenna.constants, [], this.config.contact, timestep).c, shape = this.shape(touch.kind, touch.size);
    antenna.rest ||= layOut(/** @type {any} */ (c));
    const others = (touch.objects || []).map((/** @type {any} */ o) => {
      const turn = (o.heading * Math.PI) / 180, forward = [Math.sin(turn), Math.cos(turn)];
      return { shape: this.shape(o.kind, o.size), x: o.x, y: o.y, forward, velocity: forward.map((f) => o.speed * f), friction: o.friction };
    });
    const first = { shape, friction: touch.friction, ...placeObject(antenna.rest, shape, touch) };
    return new Chain(antenna.constants, [first, ...others], this.config.contact, timestep);
  }

  /** @param {any} antenna @param {any} touch */
  describe(antenna, touch) {
    const all = [touch, ...(touch.objects || [])];
    return { antenna: antenna.drawn, rims: all.map((o) => this.shape(o.kind, o.size).rims), preview: Boolean(touch.preview) };
  }

  /** A touch, piece by piece. @param {any} message */
  *touch({ slot, id, wish }) {
    const about = { type: "touch", slot, id }, antenna = this.find(wish.antenna);
    if (this.replays && !wish.preview) { yield* this.replay(about, antenna, wish); return; }
    const timestep = wish.preview ? PREVIEW : TIMESTEP, chain = this.makeChain(antenna, wish, timestep), total = Math.round(wish.duration / INTERVAL);
    const noise = wish.seed && this.config.taught ? { seed: wish.seed, sd: this.config.taught.noise } : undefined;
    this.say({ ...about, part: "begin", total, noise, ...this.describe(antenna, wish) }, {});
    const readings = new Readings(chain), sensed = new Sensed(antenna, total, noise);
    let done = 0, size = FIRST;
    for (let k = 0; k < total; k++) {
      if (k) this.advance(chain);
      readings.add();
      sensed.add(chain.w.angle);
      if (readings.rows.length < size && k < total - 1) { yield; continue; }
      this.say({ ...about, part: "piece", first: done }, readings.take());
      done = k + 1;
      size = PIECE;
      yield;
    }
    this.say({ ...about, part: "end", hash: "", preview: Boolean(wish.preview) }, {});
    this.read(about, antenna, wish, sensed);
  }

  /**
   * Thirty slow touches of the first antenna with another gradient, k ~ exp(rate · n), of the same total compliance and damping over stiffness:
   * the products of their tensors (touch, touch) [rad²], and the peak of each [rad]. @param {any} message
   */
  *family({ id, k, rate }) {
    const about = { type: "family", id, k }, antenna = { ...this.antennas[0], constants: grade(this.antennas[0].constants, rate) };
    const { kinds, sizes, locations } = FAMILY, { touch } = this.config.state, total = Math.round(touch.duration / INTERVAL), all = [];
    const touches = kinds.flatMap((kind) => sizes.flatMap((size) => locations.map((location) => ({ ...touch, objects: [], kind, size, location, side: "left" }))));
    for (const one of touches) {
      const chain = this.makeChain(antenna, { ...one, speed: this.config.speeds[0].value }, PREVIEW), sensed = new Sensed(antenna, total);
      for (let t = 0; t < total; t++) {
        if (t) this.advance(chain);
        sensed.add(chain.w.angle);
        if (t % 8 === 0) yield;
      }
      all.push(sensed.data);
      this.say({ ...about, part: "doing", share: all.length / touches.length }, {});
    }
    const n = all.length, products = new Float64Array(n * n);
    for (let a = 0; a < n; a++)
      for (let b = 0; b <= a; b++) products[a * n + b] = products[b * n + a] = all[a].reduce((sum, value, j) => sum + value * all[b][j], 0);
    const peaks = Float64Array.from(all, (data) => data.reduce((most, value) => Math.max(most, Math.abs(value)), 0));
    this.say({ ...about, part: "end" }, { products: { shape: [n, n], data: products }, peaks: { shape: [n], data: peaks } });
  }

  /** One sample further. @param {Chain} chain */
  advance(chain) {
    chain.step(Math.round(INTERVAL / chain.timestep));
    if (!chain.sound) throw new Error("This touch cannot be computed: it presses too hard. Choose a slower or a smaller object.");
  }

  /** What was trained on this antenna at this speed, or at the nearest; null where nothing was. @param {any} antenna @param {number} speed */
  async decoder(antenna, speed) {
    const { taught, antennas } = this.config, a = antennas.findIndex((/** @type {any} */ one) => one.name === antenna.name);
    const off = (/** @type {any} */ { range }) => Math.abs(Math.log((2 * speed) / (range.speed[0] + range.speed[1])));
    const kept = ((taught && taught.kept[a]) || []).filter(Boolean).sort((/** @type {any} */ one, /** @type {any} */ two) => off(one) - off(two))[0];
    if (!kept) return null;
    this.decoders[`${a} ${kept.range.speed}`] ||= readTemplates(kept.templates).then((templates) => new Decoder(kept, templates));
    return this.decoders[`${a} ${kept.range.speed}`];
  }

  /** The verdict; of a touch outside what the decoder was trained on only this. @param {any} about @param {any} antenna @param {any} wish @param {Sensed} sensed */
  async read(about, antenna, wish, sensed) {
    const decoder = await this.decoder(antenna, wish.speed).catch(() => /** @type {null} */ (null)); // why not, the study says
    if (!decoder) return;
    const { posterior, noticed, samples } = decoder.decode(sensed), n = this.config.taught.answers.length, outside = findOutside(decoder.range, wish);
    if (outside.length && noticed >= 0) for (let k = noticed * n; k < samples * n; k++) posterior[k] = k % n === n - 1 ? 1 : 0;
    const code = { shape: [0, 0], data: new Float32Array(0) };
    this.say({ ...about, type: "reading", noticed, outside }, { posterior: { shape: [samples, n], data: posterior }, code });
  }

  /** What the readings of this antenna's touches are about. @param {any} message */
  async study({ slot, id, antenna, speed }) {
    const about = { type: "study", slot, id };
    try {
      const decoder = await this.decoder(this.find(antenna), speed);
      if (!decoder) throw new Error("No verdict here: some touches of this antenna cannot be computed, or are not felt, so no decoder could be trained.");
      const { answers } = this.config.taught, { range, scores, noise } = decoder;
      this.say({ ...about, part: "end", labels: [], answers, range, scores, noise, averages: {}, speed }, {});
    } catch (error) {
      this.say({ ...about, type: "error", of: "study", message: error instanceof Error ? error.message : String(error) }, {});
    }
  }

  /** Follow the hand until it lets go. @param {any} message @returns {Generator<any, void, void>} */
  *hold({ slot, id, wish, pace }) {
    const about = { type: "touch", slot, id, hand: true }, antenna = this.find(wish.antenna), chain = this.makeChain(antenna, wish, TIMESTEP);
    const readings = new Readings(chain);
    for (let o = 0; o < chain.objects.length; o++) chain.moveObject(o, 0, 0);
    this.replays = false;
    this.say({ ...about, part: "begin", total: LONGEST, ...this.describe(antenna, wish) }, {});
    readings.add();
    let done = 1, sent = 0, due = 1, before = performance.now();
    while (!this.ended && done < LONGEST) {
      const now = performance.now();
      due = Math.min(due + pace * Math.min(now - before, 4 * FRAME), done + 40);
      before = now;
      while (done < Math.min(Math.floor(due), LONGEST)) {
        const moving = this.steer(chain, Math.max(GLIDE, 1.5 * FRAME * pace));
        if (!moving && chain.w.rate.every((rate) => Math.abs(rate) < STILL)) { due = done; break; }
        this.advance(chain);
        readings.add();
        done += 1;
      }
      if (readings.rows.length) {
        this.say({ ...about, part: "piece", first: sent }, readings.take());
        sent = done;
      }
      yield Math.max(1, FRAME - (performance.now() - now));
    }
    this.say({ ...about, part: "end", hash: "", preview: false, commands: [] }, {});
  }

  /** Bring everything nearer to where the hand wants it; whether anything moves. @param {Chain} chain @param {number} glide */
  steer(chain, glide) {
    let moves = false;
    for (const [name, [x, y, turn]] of Object.entries(this.aims)) {
      const what = Number(name), { base } = chain, o = chain.objects[what];
      if (what >= 0 && !o) continue;
      let vx = (x - base.x - (o ? o.x : 0)) / glide, vy = (y - base.y - (o ? o.y : 0)) / glide;
      const fast = Math.hypot(vx, vy), share = fast > 1e-4 ? Math.min(1, MAX_SPEED / fast) : 0;
      vx *= share;
      vy *= share;
      const spin = o ? 0 : Math.max(-MAX_TURN, Math.min(MAX_TURN, (turn - base.heading) / glide)), turning = Math.abs(spin) > 1e-5 ? spin : 0;
      if (o) chain.moveObject(what, vx, vy);
      else chain.moveBase(vx, vy, turning);
      moves = moves || vx !== 0 || vy !== 0 || turning !== 0;
    }
    return moves;
  }

  /** The run by hand that this page was saved with. @param {any} about @param {any} antenna @param {any} wish @returns {Generator<any, void, void>} */
  *replay(about, antenna, wish) {
    this.replays = false;
    const chain = this.makeChain(antenna, wish, TIMESTEP), readings = new Readings(chain), { samples } = this.config;
    const commands = [...this.config.commands].sort((a, b) => a[0] - b[0]);
    this.say({ ...about, hand: true, part: "begin", total: samples, ...this.describe(antenna, wish) }, {});
    readings.add();
    let sent = 0;
    for (let k = 1; k < samples; k++) {
      while (commands.length && commands[0][0] <= k) {
        const [, what, vx, vy, turn] = commands.shift();
        if (what < 0) chain.moveBase(vx, vy, turn);
        else chain.moveObject(what, vx, vy);
      }
      this.advance(chain);
      readings.add();
      if (readings.rows.length === PIECE || k === samples - 1) {
        this.say({ ...about, hand: true, part: "piece", first: sent }, readings.take());
        sent = k + 1;
      }
      yield;
    }
    this.say({ ...about, hand: true, part: "end", hash: "", preview: false, commands: [] }, {});
  }
}

/** Answer a port, a little at a time. @param {any} port @param {any} config */
export function serveHost(port, config) {
  const host = new Host(config, (header, arrays) => port.postMessage({ header, arrays })), again = new MessageChannel();
  let timer = 0, going = false;
  const turn = () => {
    const wait = host.work(port.budget || 12);
    going = wait === 0;
    if (going) again.port2.postMessage(0); // sooner than a timer
    else if (wait > 0) timer = setTimeout(turn, wait);
  };
  again.port1.onmessage = turn;
  port.onmessage = (/** @type {MessageEvent} */ event) => {
    host.take(event.data);
    clearTimeout(timer);
    if (!going) again.port2.postMessage(0);
    going = true;
  };
}
