// @ts-check
import { make, show, write } from "./dom.js";
/** @typedef {import("./studio.js").App} App */
/** Where every number comes from: source tags, shown on hover and on focus. */

/** Facts behind a preset's numbers; what stands in none is derived from them. */
const FACTS_OF = {
  exponential: ["stiffness_base", "stiffness_rate"], linear: ["linear_stiffness_base", "linear_stiffness_tip"],
  uniform: ["uniform_stiffness", "uniform_stiffness"], matched: ["level", "level"], robot: ["flexures", "flexures"],
};

/** Where a number of an antenna comes from. @param {any} one @param {"stiffness"|"length"|"sensors"} what @param {number} end */
export function findTag(one, what, end) {
  if (one[what]) return "own";
  if (one.toml) return "file";
  const preset = /** @type {"robot"} */ (one.preset || "exponential");
  if (what === "stiffness") return (FACTS_OF[preset] || FACTS_OF.exponential)[end];
  return preset === "robot" ? `robot ${what}` : { length: "length", sensors: "n_sensors" }[what];
}

const OWN_TAGS = {
  file: ["file", "as the antenna file says; the file names its sources"],
  level: ["derived", "level, with the total compliance Σ 1/k of the exponential antenna [P]"],
  flexures: ["derived", "p1 = 1.19 [P] times the stiffness of the flexure, whose thickness and length are our choice [C]"],
  "robot length": ["D", "eight hinges 7.85 mm apart, read off the poster; counted from the first hinge"],
  "robot sensors": ["P", "eight capacitive hinges"],
  own: ["yours", "set or computed here, for this antenna"],
  derived: ["derived", "follows from the antenna's own numbers"],
  size: ["C", "the paper's two half-widths are not stated: 1.5 and 3 mm are our choice; 1.53 mm in its video [D]"],
  location: ["D, C", "five from the middle to the tip [P]; the first is 0.5 [D], the others our choice"],
  speed: ["P", "0.06, 0.3 and 0.6 m/s in the paper"],
  friction: ["D", "1.0 fits the published video best"],
  duration: ["P", "380 ms is the size of the paper's slow tensors"],
};

/** @param {App} app */
export function makeTags(app) {
  const tip = make("div", { class: "tip", role: "tooltip", id: "feeler-tip" });
  show(tip, false);

  /** @param {string} name */
  function explain(name) {
    const own = OWN_TAGS[/** @type {"own"} */ (name)];
    if (own) return own;
    const fact = app.catalogue && app.catalogue.facts[name], tags = app.catalogue ? app.catalogue.tags : {};
    if (!fact) return null;
    const words = fact.tag.split("+").map((/** @type {string} */ tag) => tags[tag]).join("; ");
    return [fact.tag, `${name.replaceAll("_", " ")} ${Array.isArray(fact.value) ? "" : write(fact.value, 4)} ${fact.unit === "1" ? "" : fact.unit}: ${words}${fact.note ? `. ${fact.note}` : ""}`];
  }
  /** @param {Event} event */
  function point(event) {
    const target = event.target instanceof Element ? event.target.closest("[data-tag]") : null;
    const found = target && explain(/** @type {HTMLElement} */ (target).dataset.tag || "");
    show(tip, Boolean(found));
    if (!found || !target) return;
    tip.replaceChildren(make("b", { text: `[${found[0]}]` }), ` ${found[1]}`);
    const box = target.getBoundingClientRect(), root = app.root.getBoundingClientRect();
    tip.style.left = `${Math.max(6, Math.min(box.left - root.left, root.width - 270))}px`;
    tip.style.top = `${box.bottom - root.top + 6}px`;
  }
  app.root.addEventListener("pointerover", point);
  app.root.addEventListener("focusin", point);
  app.root.addEventListener("focusout", () => show(tip, false));
  return tip;
}
