// What the pages draw alike: figures in plotly's words (plotly_figure.py), whose traces name columns instead of numbers.
const BUCKETS = 1200, COLOURBAR = 120, FILLED = 0.72;
// Okabe and Ito's colours, told apart with red-green blindness too, and those of text, where the ground is dark.
const ON_DARK = { "#0072B2": "#56B4E9", "#56B4E9": "#0072B2", "#009E73": "#2fc49a", "#1d2430": ink, "#667085": dim };
const shade = (colour) => (dark && ON_DARK[colour]) || colour;
const grid = { gridcolor: rule, zerolinecolor: rule }, inSpace = { ...grid, color: dim, showbackground: false, tickangle: 0 };
const bare = { displaylogo: false, responsive: true, displayModeBar: innerWidth > 700 };
const look = {
  paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: ink }, modebar: { bgcolor: "rgba(0,0,0,0)", color: dim, activecolor: ink },
  template: { layout: { xaxis: grid, yaxis: grid, scene: { xaxis: inSpace, yaxis: inSpace, zaxis: inSpace } } },
};

// On paper pictures are as wide as it is, in the colours of a light ground.
const INKS = { [ink]: "#1d2430", [dim]: "#667085", [rule]: "#d9dee7" };
const PAPER = [[".plot svg *", INKS], ["#profile svg *", Object.fromEntries(Object.entries(ON_DARK).slice(0, 3).map(([light, onDark]) => [onDark, light]))]];
const written = (colour) => Object.assign(make("i").style, { color: colour }).color;
function recolour(back) {
  for (const [where, colours] of dark ? PAPER : []) {
    const to = Object.fromEntries(Object.entries(colours).map(([screen, paper]) => (back ? [written(paper), screen] : [written(screen), paper])));
    for (const { style } of document.querySelectorAll(where)) for (const name of ["fill", "stroke"]) if (to[style[name]]) style[name] = to[style[name]];
  }
}
addEventListener("beforeprint", () => {
  for (const svg of document.querySelectorAll(".plot .main-svg")) svg.setAttribute("viewBox", `0 0 ${svg.getAttribute("width")} ${svg.getAttribute("height")}`);
  recolour(false);
});
addEventListener("afterprint", () => recolour(true));

// A path in 3-D as large as its box allows; wide, high: what it measures on the screen, in units of the scene
function pathLayout([scene, wide, high], box) {
  const room = Math.max(box.clientWidth - COLOURBAR, 100), height = Math.max(box.clientHeight, 100);
  const zoom = 2 * FILLED * Math.min(room / height / wide, 1 / high);
  for (const axis of "xyz") {
    scene[`${axis}axis`].title.text = axis;  // a longer one is cut off at the edge
    if (box.clientWidth < 500) scene[`${axis}axis`].nticks = 4;
  }
  const aspectratio = Object.fromEntries(Object.entries(scene.aspectratio).map(([axis, ratio]) => [axis, ratio * zoom]));
  return { ...look, scene: { ...scene, aspectratio }, margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, uirevision: "keep" };
}

// Of every bucket of samples the least and the greatest value, so that no peak is lost.
function bucketed(base, column, scale, [first, last]) {
  const size = Math.max(1, Math.ceil((last - first + 1) / BUCKETS)), x = [], y = [];
  for (let from = first; from <= last; from += size) {
    let low = from, high = from;
    for (let k = from; k < Math.min(from + size, last + 1); k++) {
      if (column[k] < column[low]) low = k;
      if (column[k] > column[high]) high = k;
    }
    for (const k of low === high ? [low] : [Math.min(low, high), Math.max(low, high)]) {
      x.push(base[k]);
      y.push(column[k] * scale);
    }
  }
  return { x, y };
}

// Traces and layout of panels over a column; range: of the samples that are shown, all of them where it is not given
function panels(figure, against, range) {
  const data = figure.data.map((trace, k) => {
    const { before, y, scale } = figure.columns[k], base = c[before + against];
    return { ...trace, line: { ...trace.line, color: shade(trace.line.color) }, ...bucketed(base, c[y], scale, range || [0, base.length - 1]) };
  });
  const xaxis = { ...figure.layout.xaxis, title: { text: about.against[against] } };
  const annotations = (innerWidth > 700 ? figure.layout.annotations || [] : []).map((note) => ({ ...note, font: { ...note.font, color: dim } }));
  return [data, { ...look, ...figure.layout, annotations, xaxis, margin: { l: 62, r: 14, t: 34, b: 42 } }];
}

// Buttons of which one is on; name: of their choice in the page
function choice(id, name, chosen) {
  for (const button of element(id).children) button.onclick = () => {
    for (const other of element(id).children) other.classList.toggle("on", other === button);
    chosen(button.dataset[name]);
  };
}
