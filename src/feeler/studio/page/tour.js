// @ts-check
import { make, makeChoice, show } from "./dom.js";
import { TOUCH } from "./state.js";
/** @typedef {import("./studio.js").App} App */
/** A tour of five steps in which a visitor finds the paper's results alone. Each begins with a question. */

const SLOW = { ...TOUCH, kind: "ball", size: 1.5, location: 0.6, speed: 0.06 };
/** `asks`: the control that the words ask for, put beside them. @type {{title: string, words: string, state: any, look: string, asks?: string}[]} */
export const STEPS = [
  {
    title: "Where does it bend?",
    words: "A ball sweeps past an antenna that is a hundred thousand times stiffer at its base than at its tip. Drag the ball " +
      "along the antenna. Watch the bright band of the tensor: does it move with the ball?",
    state: { A: { preset: "exponential" }, B: null, touch: SLOW },
    look: ".stage-panel",
  },
  {
    title: "Make it uniform",
    words: "Now every hinge is uniform, with the same compliance in all. Drag the ball again. The greatest bend stays at the " +
      "base, wherever the ball is: this antenna feels that something touches, and hardly where.",
    state: { A: { preset: "matched" }, B: null, touch: SLOW },
    look: ".antenna-panel",
  },
  {
    title: "Side by side",
    words: "A has the gradient, B is uniform. Click pairs in the set: thirty touches, and how alike they feel. The lower the mean " +
      "of the closest matches, the further the touches spread. Which antenna keeps them apart?",
    state: { A: { preset: "exponential" }, B: { preset: "matched" }, touch: SLOW },
    look: ".set-panel",
  },
  {
    title: "Slow down, if you know how slow",
    words: "Slow touches of a graded antenna differ most, so a decoder that knows the speed names a slow touch surely. This one knows it " +
      "to 10 % only. Try 0.06 m/s: it hesitates, for a slower ball feels like another place. Then let it know the speed to 2 %.",
    state: { A: { preset: "exponential" }, B: null, touch: { ...SLOW, kind: "box", speed: 0.6 }, unsure: 0.1 },
    look: ".verdict-panel", asks: "speed",
  },
  {
    title: "Touch it yourself",
    words: "In By hand the simulation runs while you hold the object, or the base: active touch. Can you find the movement that " +
      "bends the tip most? Save gives you a Python script of what your hand did.",
    state: { mode: "hand", A: { preset: "exponential" }, B: null, touch: { ...SLOW, size: 3 } },
    look: ".stage-panel",
  },
];

/** @param {App} app */
export function makeTour(app) {
  const { steps } = app.plan;
  let step = -1;
  const title = make("h2"), words = make("p"), count = make("span", { class: "count" });
  const back = make("button", { type: "button", class: "plain", text: "Back", onclick: () => go(step - 1) });
  const next = make("button", { type: "button", class: "plain strong", text: "Next", onclick: () => go(step + 1) });
  const speed = makeChoice("Speed", [["0.6", "0.6 m/s"], ["0.06", "0.06 m/s"]], () => String(app.store.state.touch.speed),
    (value) => app.store.change((/** @type {any} */ s) => { s.touch.speed = Number(value); }));
  const offered = !app.plan.alone; // a standalone page says what it is above
  const element = make("section", { class: "tour", "aria-label": "Guided tour" }, title, words,
    make("div", { class: "row" }, speed.element, count, make("button", { type: "button", class: "plain", text: "Close", onclick: () => go(-1) }), back, next));
  if (offered) {
    title.textContent = "An insect's antenna, computed while you touch it";
    words.textContent = "Drag the ball along the antenna, or change its stiffness on the left. Below, the tensor shows what its sensors measure: base at the bottom, " +
      "tip at the top, time to the right. Verdict says what a decoder infers from it.";
    next.textContent = "Take the tour: five steps";
  }
  show(back, !offered);
  show(speed.element, false);
  show(element, offered);

  /** @param {number} to */
  function go(to) {
    app.root.querySelectorAll(".lit").forEach((/** @type {Element} */ panel) => panel.classList.remove("lit"));
    step = to < 0 || to >= steps.length ? -1 : to;
    show(element, step >= 0);
    app.root.classList.toggle("on-tour", step >= 0);
    if (step < 0) return;
    const now = steps[step];
    title.textContent = now.title;
    words.textContent = now.words;
    count.textContent = `${step + 1} of ${steps.length}`;
    show(back, true);
    back.disabled = step === 0;
    next.textContent = step === steps.length - 1 ? "Done" : "Next";
    app.store.change((/** @type {any} */ s) => Object.assign(s, structuredClone({ mode: "touch", unsure: 0.02, ...now.state })));
    const panel = app.root.querySelector(now.look);
    show(speed.element, now.asks === "speed");
    if (panel) {
      panel.classList.add("lit");
      requestAnimationFrame(() => panel.scrollIntoView({ block: "nearest" }));
    }
    app.play(app.store.state.mode !== "hand");
  }
  return { element, start: () => go(step < 0 ? 0 : -1), update: () => speed.update() };
}
