// The first view of a path in 3-D, for both pages: along its thinnest direction if it is flat, and as large as the box allows.
// plotly's orthographic camera shows two units of its scene to the height of the box, from any distance; zooming scales the scene.
const FLAT = 0.12, MARGIN = 1.08, COLOURBAR = 120, FILLED = 0.8, DISTANCE = 2;
const crossed = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const named = ([x, y, z]) => ({ x, y, z });

// extents: [low, high] of x, y and z [mm]; box: the element; axis3d: title, shown -> how an axis looks; titles: of the axes
function fittedScene(extents, box, axis3d, titles) {
  const lengths = extents.map(([a, b]) => (b > a ? b - a : 0)), size = Math.max(...lengths, 1e-9);
  const thin = lengths.indexOf(Math.min(...lengths)), flat = lengths[thin] < FLAT * size;
  // Rows of [right, up]: seen from above, from the front, from the side. What is longer along z than along x, a turned part, lies down.
  const views = [[[0, 1, 0], [0, 0, 1]], lengths[2] > lengths[0] ? [[0, 0, 1], [1, 0, 0]] : [[1, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 1, 0]]];
  let eye, up, right;
  if (flat) {
    [right, up] = views[thin];
    eye = crossed(right, up);
  } else {
    const way = [1.2, -1.3, 0.9], far = Math.hypot(...way);
    eye = way.map((v) => v / far);
    const across = crossed([0, 0, 1], eye), wide = Math.hypot(...across);
    right = across.map((v) => v / wide);
    up = crossed(eye, right);
  }
  const ratio = lengths.map((v) => Math.max(v, FLAT / 4 * size) / size); // of a range of MARGIN times as much
  const seen = (way) => ratio.reduce((sum, v, a) => sum + v * Math.abs(way[a]), 0);
  const room = Math.max(box.clientWidth - COLOURBAR, 100), height = Math.max(box.clientHeight, 100);
  const zoom = FILLED * Math.min(2 * room / height / Math.max(seen(right), 1e-9), 2 / Math.max(seen(up), 1e-9));
  const axis = (a) => {
    const [low, high] = extents[a][1] >= extents[a][0] ? extents[a] : [0, 0], middle = 0.5 * (low + high), half = 0.5 * MARGIN * ratio[a] * size;
    return { ...axis3d(titles[a] || "", !(flat && a === thin)), range: [middle - half, middle + half] };
  };
  return { aspectmode: "manual", aspectratio: named(ratio.map((v) => v * MARGIN * zoom)), xaxis: axis(0), yaxis: axis(1), zaxis: axis(2),
    camera: { projection: { type: "orthographic" }, eye: named(eye.map((v) => v * DISTANCE)), up: named(flat ? up : [0, 0, 1]) } };
}
