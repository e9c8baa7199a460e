// @ts-nocheck
/** How feeler.report's turn.js draws a touch in space, to the letter (a test holds them alike). */

const project = (view, [x, y, z]) => {
  const side = x * Math.cos(view.turn) + z * Math.sin(view.turn);
  const away = -x * Math.sin(view.turn) + z * Math.cos(view.turn);
  const up = y * Math.cos(view.rise) - away * Math.sin(view.rise);
  return [view.left + view.scale * side, view.top - view.scale * up];
};
const drawLine = (pen, view, points, colour, width) => {
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.beginPath();
  points.forEach((point, k) => (k ? pen.lineTo(...project(view, point)) : pen.moveTo(...project(view, point))));
  pen.stroke();
};
const drawAxes = (pen, view, reach) => {
  pen.font = "12px sans-serif";
  pen.fillStyle = "#555";
  const long = Math.round(reach / 4) || reach / 4;
  for (const [name, end] of [["x", [long, 0, 0]], ["y", [0, long, 0]], ["z", [0, 0, long]]]) {
    drawLine(pen, view, [[0, 0, 0], end], "#999", 1);
    pen.fillText(name, ...project(view, end.map((value) => 1.15 * value)));
  }
  pen.fillText(`axes: ${long} mm`, 12, 20);
};
export const drawScene = (pen, view, scene, now) => {
  pen.clearRect(0, 0, view.width, view.height);
  drawAxes(pen, view, scene.reach);
  const shift = scene.shift[now];
  for (const line of scene.lines) {
    drawLine(pen, view, line.map((point) => point.map((value, k) => value + shift[k])), scene.object, 0.6);
  }
  const points = scene.points[now];
  pen.lineCap = "round";
  scene.bend[now].forEach((level, k) => drawLine(pen, view, [points[k], points[k + 1]], scene.colours[level], 3));
};
