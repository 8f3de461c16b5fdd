// Methods side by side: columns of method k are c.mK_t, c.mK_feed ... (comparison_page.py).
(async () => {
  const rows = about.rows, BUCKETS = 1500, POINTS_OF_PATH = 8000;
  await Promise.all(Object.entries(about.columns).map(([name, type]) => unpack(name, type)));
  const hidden = new Set();
  let against = "t";

  element("subtitle").textContent = `${rows.length} methods on machine ${about.machine}; ${about.blocks.toLocaleString()} blocks`;
  const quantities = [...new Set(rows.flatMap((row) => Object.keys(row.worst)))];
  const head = make("tr");
  for (const name of ["method", "cycle time [s]", "ratio to best", ...quantities.map((q) => q.replaceAll("_", " ") + " / limit"), "contour error [µm]", "planning [s]", "verdict"])
    head.append(make("th", name));
  element("methods").append(head);
  rows.forEach((row, k) => {
    const line = make("tr", undefined, row.shown ? "choice" : ""), name = make("td", row.method);
    const key = make("span", "■ ");
    key.style.color = row.shown ? about.colours[k] : "transparent";
    name.prepend(key);
    if (row.method === about.best) name.style.fontWeight = "600";
    line.append(name, make("td", fixed(row.cycle_time, 4)), make("td", fixed(row.ratio, 4)));
    for (const quantity of quantities) {
      const ratio = row.worst[quantity], free = row.free.includes(quantity), text = free ? digits(ratio, 4) : fixed(ratio, 4);
      line.append(make("td", free ? `(${text})` : text, !free && ratio > 1 + 1e-6 ? "bad" : ""));
    }
    line.append(make("td", row.contour_error === null ? "–" : digits(1000 * row.contour_error, 4)), make("td", fixed(row.planning_time, 2)));
    line.append(make("td", row.outcome, row.outcome === "passed" ? "" : "bad"));
    if (row.shown) line.onclick = () => {
      if (!hidden.delete(k)) hidden.add(k);
      line.classList.toggle("off", hidden.has(k));
      draw();
    };
    element("methods").append(line);
    if (row.outcome !== "passed") element("notes").append(make("li", `${row.method}: ${row.sentence}`));
    if (row.free.length) element("notes").append(make("li", `${row.method} does not limit ${row.free.join(", ")} (in brackets)`));
  });

  const shown = rows.map((_, k) => k).filter((k) => rows[k].shown);
  const column = (k, name) => c[`m${k}_${name}`];
  const bare = { displaylogo: false, responsive: true };
  const look = { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: ink }, showlegend: false,
    modebar: { bgcolor: "rgba(0,0,0,0)", color: dim, activecolor: ink }, uirevision: "keep" };
  const axis3d = (title, visible = true) => ({ title: { text: title }, color: dim, gridcolor: rule, zerolinecolor: rule, showbackground: false, tickangle: 0, visible });
  function paths() {
    return shown.map((k) => {
      const n = column(k, "t").length, step = Math.max(1, Math.ceil(n / POINTS_OF_PATH)), keep = (name) => column(k, name).filter((_, i) => i % step === 0 || i === n - 1);
      return { type: "scatter3d", mode: "lines", x: keep("x"), y: keep("y"), z: keep("z"), name: rows[k].method, line: { width: 3, color: about.colours[k] },
        visible: !hidden.has(k), customdata: keep("line"), hovertemplate: `${rows[k].method}, line %{customdata}<extra></extra>` };
    });
  }
  function bucketed(base, values, scale) {
    const size = Math.max(1, Math.ceil(values.length / BUCKETS)), x = [], y = [];
    for (let from = 0; from < values.length; from += size) {
      let low = from, high = from;
      for (let k = from; k < Math.min(from + size, values.length); k++) {
        if (values[k] < values[low]) low = k;
        if (values[k] > values[high]) high = k;
      }
      for (const k of low === high ? [low] : [Math.min(low, high), Math.max(low, high)]) { x.push(base[k]); y.push(values[k] * scale); }
    }
    return { x, y };
  }
  const title = { t: "time [s]", s: "length along the path [mm]", line: "NC line" };
  function profile(name, scale) {
    return shown.map((k) => ({ type: "scatter", mode: "lines", ...bucketed(column(k, against), column(k, name), scale), name: rows[k].method,
      visible: !hidden.has(k), line: { color: about.colours[k], width: 1.4 } }));
  }
  const layout = (text) => ({ ...look, margin: { l: 62, r: 14, t: 8, b: 42 }, xaxis: { title: { text: title[against] }, gridcolor: rule },
    yaxis: { title: { text }, gridcolor: rule, zerolinecolor: rule, rangemode: "tozero" } });
  const extents = ["x", "y", "z"].map((axis) => shown.reduce(([a, b], k) => column(k, axis).reduce(([u, v], w) => [Math.min(u, w), Math.max(v, w)], [a, b]), [Infinity, -Infinity]));
  const space = { ...look, margin: { l: 0, r: 0, t: 0, b: 0 }, scene: fittedScene(extents, element("path"), axis3d, ["x", "y", "z"]) };
  async function draw() {
    await Plotly.react("path", paths(), space, bare);
    await Plotly.react("feed", profile("feed", 1), layout("feed [mm/s]"), bare);
    await Plotly.react("deviation", profile("deviation", 1000), layout("distance [µm]"), bare);
  }
  for (const button of element("against").children) button.onclick = () => {
    against = button.dataset.against;
    for (const other of element("against").children) other.classList.toggle("on", other === button);
    draw();
  };
  if (shown.length) await draw();
  window.comparison = { state: () => ({ shown: shown.length, hidden: [...hidden], against }) };
  document.body.dataset.ready = "yes";
})();
