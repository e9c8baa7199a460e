// @ts-check
import { makeBoardPanel } from "./board.js";
import { makeCodePanel, makeSetPanel, makeVerdictPanel } from "./charts.js";
import { makeAntennaPanel, makeTouchPanel } from "./controls.js";
import { makeSpikePanel } from "./spikes.js";
import { makeStagePanel, makeStudyPanel, makeTensorPanel } from "./stage.js";
/** @typedef {import("./studio.js").App} App */
/** Every panel of the studio, from top to bottom in its column. A new one is a module of its own and a line here. */

/**
 * A panel: its column, whether it is to be seen now, `update` for what is written, `redraw` for what moves with time.
 * @typedef {{element: HTMLElement, place: "left"|"middle"|"right", isShown: () => boolean, update: () => void, redraw?: () => void}} Panel
 */

/** @type {((app: App) => Panel)[]} */
export const PANELS = [
  makeAntennaPanel,
  makeTouchPanel,
  makeBoardPanel,
  makeStagePanel,
  makeTensorPanel,
  makeSpikePanel,
  makeStudyPanel,
  makeVerdictPanel,
  makeCodePanel,
  makeSetPanel,
];
