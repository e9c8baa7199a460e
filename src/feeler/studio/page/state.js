// @ts-check
/** The state: what is wished for, with its past, and as a part of the address. */

export const TOUCH = { kind: "ball", size: 1.5, location: 0.7, speed: 0.06, approach: 90, side: "left", friction: 1, lead: 5, azimuth: 0,
  duration: 380, objects: /** @type {any[]} */ ([]) };
const LIMIT = 200;

/** @param {any} antenna */
export function makeState(antenna) {
  return { mode: "touch", A: { ...antenna }, B: /** @type {any} */ (null), touch: structuredClone(TOUCH), unsure: 0.02 };
}

/** Leave out of a state what an antenna in space is not shown with. @param {any} state */
export function leavePlane(state) {
  Object.assign(state, { mode: "touch", B: null });
  state.touch.objects = [];
}

export class Store {
  /** @param {any} state @param {(done: boolean) => void} changed */
  constructor(state, changed) {
    this.state = state;
    this.changed = changed;
    /** @type {string[]} */
    this.past = [];
    /** @type {string[]} */
    this.future = [];
    this.before = JSON.stringify(state);
  }

  /** Change the state; while something is dragged `done` is false, and all of that is one step back. @param {(s: any) => void} how @param {boolean} [done] */
  change(how, done = true) {
    how(this.state);
    if (done) {
      const now = JSON.stringify(this.state);
      if (now !== this.before) {
        this.past.push(this.before);
        if (this.past.length > LIMIT) this.past.shift();
        this.future = [];
        this.before = now;
      }
    }
    this.changed(done);
  }

  /** @param {string[]} from @param {string[]} to */
  go(from, to) {
    const found = from.pop();
    if (found === undefined) return;
    to.push(this.before);
    this.before = found;
    this.state = JSON.parse(found);
    this.changed(true);
  }

  undo() { this.go(this.past, this.future); }

  redo() { this.go(this.future, this.past); }
}

/** The wish for a slot's touch. @param {any} state @param {"A"|"B"} slot @param {boolean} preview */
export function makeWish(state, slot, preview) {
  return { antenna: state[slot], ...state.touch, preview };
}

/** A state as text for an address. @param {any} state */
export async function encodeState(state) {
  const stream = new Blob([JSON.stringify(state)]).stream().pipeThrough(new CompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

/** The state in an address, or null where there is none that can be used. @param {string} hash @param {any} fallback */
export async function decodeState(hash, fallback) {
  const found = /[#&]s=([\w-]{1,200000})/.exec(hash);
  if (!found) return null;
  try {
    const bytes = Uint8Array.from(atob(found[1].replace(/-/g, "+").replace(/_/g, "/")), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const state = JSON.parse(await new Response(stream).text());
    if (!state || ![state.A, state.touch].every((part) => part && typeof part === "object" && !Array.isArray(part))) return null;
    const clean = { ...fallback, ...state, touch: { ...TOUCH, ...state.touch } };
    if (!clean.B || typeof clean.B !== "object") clean.B = null;
    if (!Array.isArray(clean.touch.objects)) clean.touch.objects = [];
    if (!["touch", "hand", "board"].includes(clean.mode)) clean.mode = "touch";
    return clean;
  } catch {
    return null;
  }
}
