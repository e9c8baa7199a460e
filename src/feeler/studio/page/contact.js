// @ts-check
import { touchParts } from "./narrow.js";
/** Contact as feeler.physics.chain.contact solves it: MuJoCo's convex problem in the accelerations, one sweep per Newton iterate. */

const MAX_NEWTON = 50, MAX_SEARCH = 60, MIN_IMPEDANCE = 1e-4, MAX_IMPEDANCE = 0.9999, MIN_VALUE = 1e-15;
const SIDES = 3; // rows of a contact: −μ, 0, +μ along the tangent
const NAMES = ["segment", "object", "w0", "w1", "w2", "weight", "aim", "x", "force", "newX", "newForce", "active"];

/** Width at which an object of some speed is met, in slow and in any motion [mm]. @param {any} contact @param {any[]} objects */
export function widen(contact, objects) {
  const speed = Math.max(0, ...objects.map((o) => Math.hypot(o.velocity[0], o.velocity[1])));
  return [contact.lingering * speed, contact.crossing * speed];
}

export class Contacts {
  /** @param {any} chain @param {any} contact */
  constructor(chain, contact) {
    this.chain = chain;
    this.contact = contact;
    const [slow, fast] = widen(contact, chain.objects);
    this.slow = slow;
    this.fast = fast;
    this.count = 0;
    this.press = 0; // normal force of all contacts, and their places weighted by it
    this.place = 0;
    this.last = -1;
    this.room = 0;
    /** Contacts, of which the first `count` hold. @type {{o: any, number: number, i: number, x: number, y: number, nx: number, ny: number, distance: number, along: number}[]} */
    this.table = [];
    /** @type {Object<string, Float64Array>} */
    this.rows = {};
    this.reserve(64);
    /** What each contact of the step before came to. */
    this.memory = { count: 0, object: new Float64Array(64), segment: new Float64Array(64), x: new Float64Array(SIDES * 64) };
    this.from = { o: /** @type {any} */ (null), number: 0, i: 0, cx: 0, cy: 0 };
    this.put = this.note.bind(this);
  }

  /** @param {number} n Room for so many contacts. */
  reserve(n) {
    for (const name of NAMES) {
      const grown = new Float64Array(SIDES * n);
      if (this.rows[name]) grown.set(this.rows[name]);
      this.rows[name] = grown;
    }
    this.room = n;
  }

  /** Note J q̈ of the contacts of the step before, and begin anew. */
  keep() {
    const { memory, count } = this, { x, object, segment } = this.rows;
    if (memory.object.length < count)
      Object.assign(memory, { object: new Float64Array(this.room), segment: new Float64Array(this.room), x: new Float64Array(SIDES * this.room) });
    memory.count = count;
    for (let k = 0; k < count; k++) {
      memory.object[k] = object[SIDES * k];
      memory.segment[k] = segment[SIDES * k];
    }
    memory.x.set(x.subarray(0, SIDES * count));
    this.count = 0;
    this.press = this.place = 0;
  }

  /** Contacts with one object, base to tip. @param {any} o @param {number} number */
  gather(o, number) {
    const { ex, ey, px, py } = this.chain.w, { radius } = this.chain.c, { from } = this, [cx, cy] = o.forward;
    from.o = o;
    from.number = number;
    from.cx = cx;
    from.cy = cy;
    for (let i = o.first; i <= o.last; i++) {
      const dx = px[i] - o.x, dy = py[i] - o.y;
      from.i = i;
      touchParts(o.shape, cx * dx + cy * dy, cx * dy - cy * dx, cx * ex[i] + cy * ey[i], cx * ey[i] - cy * ex[i], radius[i], this.put);
    }
  }

  /** Take a contact as it is seen from its object. @param {number} x @param {number} y @param {number} nx @param {number} ny @param {number} distance */
  note(x, y, nx, ny, distance) {
    const { o, number, i, cx, cy } = this.from;
    if (this.count === this.room) this.reserve(2 * this.room);
    this.table[this.count] ||= { o, number, i, x, y, nx, ny, distance, along: 0 };
    const one = this.table[this.count];
    one.o = o;
    one.number = number;
    one.i = i;
    one.x = o.x + cx * x - cy * y;
    one.y = o.y + cy * x + cx * y;
    one.nx = cx * nx - cy * ny;
    one.ny = cy * nx + cx * ny;
    one.distance = distance;
    this.count += 1;
  }

  /** Solve the contacts; the hinges are left as the last sweep has them. */
  push() {
    const { chain } = this;
    this.last = -1;
    for (let k = 0; k < this.count; k++) {
      this.write(this.table[k], k);
      this.last = Math.max(this.last, this.table[k].i);
    }
    this.recall();
    for (let sweep = 0; sweep < MAX_NEWTON; sweep++) {
      this.load();
      chain.fold();
      chain.unfold(this.last);
      if (this.improve(sweep === 0)) break;
    }
    chain.loaded.fill(0);
    this.clear();
    this.sum();
  }

  /** MuJoCo's d(r). @param {number} distance @param {number} high @param {number} width */
  weaken(distance, high, width) {
    const { least: low, midpoint: middle, power } = this.contact, x = Math.abs(distance) / width;
    const bound = (/** @type {number} */ d) => Math.min(Math.max(d, MIN_IMPEDANCE), MAX_IMPEDANCE);
    if (x >= 1) return bound(high);
    let y = x;
    if (power === 2) y = x <= middle ? (x * x) / middle : 1 - ((1 - x) * (1 - x)) / (1 - middle);
    else if (power !== 1) y = x <= middle ? x ** power / middle ** (power - 1) : 1 - (1 - x) ** power / (1 - middle) ** (power - 1);
    return bound(low + y * (high - low));
  }

  /** The three rows of contact number `k`. @param {any} one @param {number} k */
  write(one, k) {
    const { w, c, base } = this.chain, { rows } = this, { o, i, nx, ny, distance } = one;
    const rx = one.x - w.px[i], ry = one.y - w.py[i], ex = w.ex[i], ey = w.ey[i];
    one.along = (rx * ex + ry * ey) / (ex * ex + ey * ey);
    const vx = o.velocity[0] - base.vx, vy = o.velocity[1] - base.vy; // seen from the base
    const wide = Math.max(c.width[i], Math.min(this.slow, c.slow[i]), Math.min(this.fast, c.widest[i]));
    const impedance = this.weaken(distance, c.most[i], wide), mu = o.friction, ease = (c.invweight[i] * (1 - impedance)) / impedance;
    const edge = mu === 0 ? 0 : 1 / Math.max(2 * mu * mu * (1 + mu * mu) * ease, MIN_VALUE);
    const normal = mu === 0 ? 1 / Math.max(ease, MIN_VALUE) : 2 * edge, pull = -c.k[i] * impedance * distance;
    const omega = w.omega[i], wx = w.vx[i] - vx, wy = w.vy[i] - vy;
    for (let side = 0; side < SIDES; side++) {
      const slide = (side - 1) * mu, dx = nx - slide * ny, dy = ny + slide * nx, lever = ry * dx - rx * dy, r = SIDES * k + side;
      rows.object[r] = one.number;
      rows.segment[r] = i;
      rows.w0[r] = lever;
      rows.w1[r] = dx;
      rows.w2[r] = dy;
      rows.weight[r] = side === 1 ? normal : edge;
      rows.aim[r] = pull - c.b[i] * (lever * omega + dx * wx + dy * wy);
    }
  }

  /** The first guess: a row is active if the J q̈ of the step before falls short of what this step aims at, or is not known. */
  recall() {
    const { aim, active } = this.rows, { memory } = this;
    let at = 0;
    for (let k = 0; k < this.count; k++) {
      const { number, i } = this.table[k];
      while (at < memory.count && (memory.object[at] < number || (memory.object[at] === number && memory.segment[at] < i))) at += 1;
      const known = at < memory.count && memory.object[at] === number && memory.segment[at] === i;
      for (let side = 0; side < SIDES; side++) {
        const r = SIDES * k + side;
        active[r] = !known || memory.x[SIDES * at + side] < aim[r] ? 1 : 0;
      }
      if (known) at += 1;
    }
  }

  /** Empty the contact rows of the touched segments. */
  clear() {
    const { w } = this.chain;
    for (let k = 0; k < this.count; k++) {
      const { i } = this.table[k];
      w.k00[i] = w.k01[i] = w.k02[i] = w.k11[i] = w.k12[i] = w.k22[i] = 0;
      w.b0[i] = w.b1[i] = w.b2[i] = 0;
    }
  }

  /** Put Σ D w wᵀ and −Σ D a_ref w of the active rows into their segments' rows. */
  load() {
    const { w, loaded } = this.chain, { segment, w0, w1, w2, weight, aim, active } = this.rows;
    this.clear();
    for (let r = 0; r < SIDES * this.count; r++) {
      const i = segment[r], d = weight[r], pull = d * aim[r];
      loaded[i] = 1;
      if (!active[r]) continue;
      w.k00[i] += d * w0[r] * w0[r];
      w.k01[i] += d * w0[r] * w1[r];
      w.k02[i] += d * w0[r] * w2[r];
      w.k11[i] += d * w1[r] * w1[r];
      w.k12[i] += d * w1[r] * w2[r];
      w.k22[i] += d * w2[r] * w2[r];
      w.b0[i] -= pull * w0[r];
      w.b1[i] -= pull * w1[r];
      w.b2[i] -= pull * w2[r];
    }
  }

  /** Move the iterate along the Newton step; whether it is the minimum. @param {boolean} first */
  improve(first) {
    const { x, force, newX, newForce, aim, active } = this.rows, n = SIDES * this.count;
    const same = this.evaluate(n), step = first || same ? 1 : this.search(n);
    for (let r = 0; r < n; r++) {
      x[r] = step === 1 ? newX[r] : x[r] + step * (newX[r] - x[r]);
      force[r] = step === 1 ? newForce[r] : force[r] + step * (newForce[r] - force[r]);
      active[r] = x[r] < aim[r] ? 1 : 0;
    }
    return same;
  }

  /** J q̈ and λ of the full Newton step; whether its active rows are those it was computed with. @param {number} n */
  evaluate(n) {
    const { segment, w0, w1, w2, weight, aim, newX, newForce, active } = this.rows, { alpha, ax, ay } = this.chain.w;
    let same = true;
    for (let r = 0; r < n; r++) {
      const i = segment[r], x = w0[r] * alpha[i] + w1[r] * ax[i] + w2[r] * ay[i], short = aim[r] - x;
      newX[r] = x;
      newForce[r] = active[r] ? weight[r] * short : 0;
      same = same && Boolean(active[r]) === short > 0;
    }
    return same;
  }

  /** Exact minimiser along the Newton direction: root of a rising, piecewise linear slope. @param {number} n */
  search(n) {
    const { x, force, newX, newForce, weight, aim } = this.rows;
    let low = 0, high = Infinity, t = 1;
    for (let k = 0; k < MAX_SEARCH; k++) {
      let slope = 0, bend = 0;
      for (let r = 0; r < n; r++) {
        const change = newX[r] - x[r], more = newForce[r] - force[r], over = x[r] + t * change - aim[r];
        slope += change * (force[r] + t * more);
        bend += change * more;
        if (over < 0) {
          slope += weight[r] * over * change;
          bend += weight[r] * change * change;
        }
      }
      if (slope < 0) low = t;
      else high = t;
      if (bend <= 0 || slope === 0) break;
      let next = t - slope / bend;
      if (!(low < next && next < high)) next = high < Infinity ? 0.5 * (low + high) : 2 * t;
      if (Math.abs(next - t) <= 1e-15 * Math.abs(t)) break;
      t = next;
    }
    return t;
  }

  /** Each object's force, and where along the antenna all press. */
  sum() {
    const { c } = this.chain, { force, w1, w2 } = this.rows;
    for (let r = 0; r < SIDES * this.count; r++) {
      if (!(force[r] > 0)) continue;
      const one = this.table[Math.floor(r / SIDES)], { i, o } = one;
      o.fx += force[r] * w1[r];
      o.fy += force[r] * w2[r];
      this.press += force[r];
      this.place += force[r] * (c.start[i] + Math.min(Math.max(one.along, 0), 1) * c.portion[i]);
    }
  }
}
