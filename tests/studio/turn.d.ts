/** What the page takes from the report's turn.js, for the check of types. */
export function drawScene(pen: CanvasRenderingContext2D, view: object, scene: object, now: number): void;
