// @ts-check
import { Contacts } from "./contact.js";
/**
 * feeler's default engine, chain-consistent, for one antenna: the sweeps and the step of feeler.physics.chain, without its lanes. It
 * differs from them by roundings alone (no fused multiply-add).
 */

const ROWS = ["length", "mass", "inertia", "stiffness", "damping", "rest", "radius", "invweight", "start", "portion", "most",
  "width", "slow", "widest", "k", "b"]; // as in feeler.physics.chain.fields
const STATE = ["angle", "rate", "heading", "omega", "ex", "ey", "torque", "fx", "fy", "ux", "uy", "share", "u", "alpha", "ax", "ay",
  "px", "py", "vx", "vy", "k00", "k01", "k02", "k11", "k12", "k22", "b0", "b1", "b2"];

/** Rows of numbers by name, each with one entry per segment. @param {string[]} names @param {number} n @param {Float64Array} [from] */
function makeRows(names, n, from) {
  return Object.fromEntries(names.map((name, k) => [name, from ? from.slice(k * n, (k + 1) * n) : new Float64Array(n)]));
}

/** Half planes that hold an object, as it lies: outward normal and distance, one after the other. @param {any} o @returns {number[]} */
function turnPlanes({ shape, forward: [x, y] }) {
  return shape.planes.flatMap((/** @type {number[]} */ [nx, ny, distance]) => [x * nx - y * ny, y * nx + x * ny, distance]);
}

/** An antenna and objects, stepped. Places in mm, times in ms, as everywhere in feeler. */
export class Chain {
  /**
   * @param {Float64Array} constants Those of each segment, row after row.
   * @param {any[]} objects Each {shape, x, y, forward: [x, y], velocity: [x, y], friction}.
   * @param {any} contact d_min, midpoint, power, crossing and lingering. @param {number} timestep
   */
  constructor(constants, objects, contact, timestep) {
    this.n = constants.length / ROWS.length;
    /** @type {Object<string, Float64Array>} */
    this.c = makeRows(ROWS, this.n, constants);
    /** @type {Object<string, Float64Array>} */
    this.w = makeRows(STATE, this.n);
    this.timestep = timestep;
    this.base = { x: 0, y: 0, heading: 0, vx: 0, vy: 0, turn: 0, ax: 0, ay: 0, alpha: 0 };
    this.drive = { vx: 0, vy: 0, turn: 0 };
    this.objects = objects.map((o) => ({ ...o, forward: [...o.forward], velocity: [...o.velocity], first: this.n, last: -1, fx: 0, fy: 0,
      planes: turnPlanes(o) })); // objects do not turn
    this.loaded = new Uint8Array(this.n);
    this.contacts = new Contacts(this, contact);
    this.w.angle.set(this.c.rest);
    this.move(0);
  }

  /** From the next step on the base moves like this. @param {number} vx @param {number} vy @param {number} turn */
  moveBase(vx, vy, turn) { this.drive = { vx, vy, turn }; }

  /** From the next step on an object moves like this. @param {number} o @param {number} vx @param {number} vy */
  moveObject(o, vx, vy) { this.objects[o].velocity = [vx, vy]; }

  /** Whether all numbers are finite. */
  get sound() { return Number.isFinite(this.w.heading[this.n - 1] + this.w.omega[this.n - 1]); }

  /** @param {number} count */
  step(count) {
    const { base, drive, timestep, contacts } = this;
    for (let k = 0; k < count; k++) {
      base.ax = (drive.vx - base.vx) / timestep;
      base.ay = (drive.vy - base.vy) / timestep;
      base.alpha = (drive.turn - base.turn) / timestep;
      const touched = this.find();
      if (touched) contacts.push(); // leaves the hinges as fold does
      else this.fold();
      this.carry();
      this.move(timestep);
    }
  }

  /** Move the base, and the objects as seen from it. */
  carry() {
    const { base, drive, timestep } = this;
    base.vx = drive.vx;
    base.vy = drive.vy;
    base.turn = drive.turn;
    base.x += timestep * drive.vx;
    base.y += timestep * drive.vy;
    base.heading += timestep * drive.turn;
    for (const o of this.objects) {
      o.x += timestep * (o.velocity[0] - drive.vx);
      o.y += timestep * (o.velocity[1] - drive.vy);
    }
  }

  /** The contacts of this moment; whether there are any. */
  find() {
    let last = -1;
    for (const o of this.objects) {
      this.seek(o);
      if (o.first <= o.last) last = Math.max(last, o.last);
      o.fx = o.fy = 0;
    }
    this.contacts.keep();
    if (last < 0) return false;
    this.locate(last);
    for (let k = 0; k < this.objects.length; k++) if (this.objects[k].first <= this.objects[k].last) this.contacts.gather(this.objects[k], k);
    return this.contacts.count > 0;
  }

  /** The outward sweep and one Euler step of every hinge, and all that follows from where it then is. @param {number} h */
  move(h) {
    const { n, base } = this, { length, mass, stiffness, damping, rest } = this.c;
    const { angle, rate, heading, omega, ex, ey, torque, fx, fy, ux, uy, share, u } = this.w;
    let head = base.heading, turning = base.turn, alpha = base.alpha, pushX = base.ax, pushY = base.ay, ax = 0, ay = 0;
    for (let i = 0; i < n; i++) {
      const before = alpha;
      alpha = -uy[i] * pushY + (-ux[i] * pushX + (share[i] * alpha + u[i]));
      pushX = alpha * ey[i] + pushX;
      pushY = -alpha * ex[i] + pushY;
      const v = h * (alpha - before) + rate[i], q = h * v + angle[i];
      head += q;
      turning += v;
      rate[i] = v;
      angle[i] = q;
      heading[i] = head;
      omega[i] = turning;
      const x = length[i] * Math.sin(head), y = length[i] * Math.cos(head);
      ex[i] = x;
      ey[i] = y;
      torque[i] = stiffness[i] * (rest[i] - q) - damping[i] * v;
      const square = turning * turning, turnX = square * x, turnY = square * y;
      fx[i] = mass[i] * (turnX * 0.5 - ax);
      fy[i] = mass[i] * (turnY * 0.5 - ay);
      ax -= turnX;
      ay -= turnY;
    }
  }

  /** Note the first and the last segment that none of an object's half planes keeps clear of it. @param {any} o */
  seek(o) {
    const { n } = this, { radius } = this.c, { ex, ey } = this.w, [px, py, p, qx, qy, q, rx, ry, r, sx, sy, s] = o.planes;
    let a = -(px * o.x + py * o.y) - p, b = -(qx * o.x + qy * o.y) - q, c = -(rx * o.x + ry * o.y) - r, d = -(sx * o.x + sy * o.y) - s;
    o.first = n;
    o.last = -1;
    for (let i = 0; i < n; i++) {
      const x = ex[i], y = ey[i], least = radius[i], a0 = a, b0 = b, c0 = c, d0 = d;
      a += px * x + py * y;
      b += qx * x + qy * y;
      c += rx * x + ry * y;
      d += sx * x + sy * y;
      if ((a0 <= least || a <= least) && (b0 <= least || b <= least) && (c0 <= least || c <= least) && (d0 <= least || d <= least)) {
        if (o.last < 0) o.first = i;
        o.last = i;
      }
    }
  }

  /** Hinge positions and velocities of segments 0 … `last`, seen from the base. @param {number} last */
  locate(last) {
    const { ex, ey, omega, px, py, vx, vy } = this.w;
    let x = 0, y = 0, moveX = 0, moveY = 0;
    for (let i = 0; i <= last; i++) {
      px[i] = x;
      py[i] = y;
      vx[i] = moveX;
      vy[i] = moveY;
      x += ex[i];
      y += ey[i];
      moveX = omega[i] * ey[i] + moveX;
      moveY = -omega[i] * ex[i] + moveY;
    }
  }

  /** The inward sweep: what is left for each hinge, with the implicit damping in it. */
  fold() {
    const { n, loaded, timestep: h } = this, { mass, inertia, damping } = this.c;
    const { ex, ey, torque, fx, fy, ux, uy, share, u, k00, k01, k02, k11, k12, k22, b0, b1, b2 } = this.w;
    let d = 0, vx = 0, vy = 0, a = 0, b = 0, c = 0, bias = 0, biasX = 0, biasY = 0;
    for (let i = n - 1; i >= 0; i--) {
      const x = ex[i], y = ey[i], m = mass[i], half = 0.5 * m, drag = h * damping[i];
      const wx = a * y + (-b * x + vx), wy = b * y + (-c * x + vy);
      const far = c * (x * x) + (vx * (y + y)) - (b * ((x + x) * y) + vy * (x + x));
      let near = a * (y * y) + (inertia[i] + d), damped = a * (y * y) + (inertia[i] + drag + d);
      let gx = half * y + wx, gy = -half * x + wy;
      let rest = y * (-0.5 * fx[i] + biasX) + (-x * (-0.5 * fy[i] + biasY) + bias);
      a += m;
      c += m;
      biasX -= fx[i];
      biasY -= fy[i];
      if (loaded[i]) {
        near += k00[i];
        damped += k00[i];
        gx += k01[i];
        gy += k02[i];
        a += k11[i];
        b += k12[i];
        c += k22[i];
        rest += b0[i];
        biasX += b1[i];
        biasY += b2[i];
      }
      d = near + far;
      const inverse = 1 / (damped + far), left = (torque[i] - rest) * inverse;
      ux[i] = gx * inverse;
      uy[i] = gy * inverse;
      share[i] = drag * inverse;
      u[i] = left;
      bias = d * left + rest;
      biasX = gx * left + biasX;
      biasY = gy * left + biasY;
      a = -(gx * gx) * inverse + a;
      b = -(gx * gy) * inverse + b;
      c = -(gy * gy) * inverse + c;
      d = d * drag * inverse;
      vx = gx * drag * inverse;
      vy = gy * drag * inverse;
    }
  }

  /** The outward sweep as far as `last`: the segments that are loaded are told their accelerations. @param {number} last */
  unfold(last) {
    const { base, loaded } = this, { ex, ey, ux, uy, share, u, alpha, ax, ay } = this.w;
    let turn = base.alpha, x = base.ax, y = base.ay;
    for (let i = 0; i <= last; i++) {
      turn = -uy[i] * y + (-ux[i] * x + (share[i] * turn + u[i]));
      if (loaded[i]) {
        alpha[i] = turn;
        ax[i] = x;
        ay[i] = y;
      }
      x = turn * ey[i] + x;
      y = -turn * ex[i] + y;
    }
  }
}
