// Methods side by side: columns of method k are c.mK_t, c.mK_feed ... (comparison_page.py).
(async () => {
  const rows = about.rows, POINTS_OF_PATH = 8000;
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
    line.append(name, make("td", fixed(row.cycle_time_s, 4)), make("td", fixed(row.ratio_to_best, 4)));
    for (const quantity of quantities) {
      const ratio = row.worst[quantity]?.ratio, free = row.not_limited.includes(quantity), text = free ? digits(ratio, 4) : fixed(ratio, 4);
      line.append(make("td", free ? `(${text})` : text, !free && ratio > 1 + 1e-6 ? "bad" : ""));
    }
    line.append(make("td", row.contour_error_mm === null ? "–" : digits(1000 * row.contour_error_mm, 4)), make("td", fixed(row.planning_time_s, 2)));
    line.append(make("td", row.outcome, row.outcome === "passed" ? "" : "bad"));
    if (row.shown) line.onclick = () => {
      if (!hidden.delete(k)) hidden.add(k);
      line.classList.toggle("off", hidden.has(k));
      draw();
    };
    element("methods").append(line);
    if (row.outcome !== "passed") element("notes").append(make("li", `${row.method}: ${row.sentence}`));
    if (row.not_limited.length) element("notes").append(make("li", `${row.method} does not limit ${row.not_limited.join(", ")} (in brackets)`));
  });

  const shown = rows.map((_, k) => k).filter((k) => rows[k].shown);
  const visible = (trace, k) => ({ ...trace, visible: !hidden.has(k) });
  function paths() {
    return shown.map((k) => {
      const n = c[`m${k}_t`].length, step = Math.max(1, Math.ceil(n / POINTS_OF_PATH)), keep = (name) => c[`m${k}_${name}`].filter((_, i) => i % step === 0 || i === n - 1);
      const place = (name) => keep(name).map((value) => value / about.units.mm);
      return visible({ type: "scatter3d", mode: "lines", x: place("x"), y: place("y"), z: place("z"), name: rows[k].method,
        line: { width: 3, color: about.colours[k] }, customdata: keep("line"), hovertemplate: `${rows[k].method}, line %{customdata}<extra></extra>` }, k);
    });
  }
  // On paper, where WebGL leaves nothing: the paths along their thinnest direction.
  function flat(traces, size = 900) {
    const ends = ["x", "y", "z"].map((axis) => {
      let low = Infinity, high = -Infinity;
      for (const trace of traces) for (const value of trace[axis]) [low, high] = [Math.min(low, value), Math.max(high, value)];
      return { axis, low, high, wide: high - low };
    });
    const thin = ends.reduce((a, b) => (b.wide <= a.wide ? b : a)), [u, v] = ends.filter((one) => one !== thin);
    const scale = size / Math.max(u.wide, v.wide, 1e-9), at = (value) => (value * scale + 4).toFixed(1);
    const lines = traces.filter((trace) => trace.visible).map((trace) =>
      `<polyline stroke="${trace.line.color}" points="${Array.from(trace[u.axis], (x, k) => `${at(x - u.low)},${at(v.high - trace[v.axis][k])}`).join(" ")}"/>`);
    return `<svg viewBox="0 0 ${at(u.wide + 4 / scale)} ${at(v.wide + 4 / scale)}" fill="none" stroke-width="1.2">${lines.join("")}</svg>`;
  }
  const space = shown.length ? pathLayout(about.view, element("path")) : null;
  async function draw() {
    const traces = paths();
    element("first").innerHTML = flat(traces);
    await Plotly.react("path", traces, space, bare);
    const [data, layout] = panels(about.profile, against);
    await Plotly.react("profile", data.map((trace, n) => visible(trace, shown[n % shown.length])), { ...layout, showlegend: false, uirevision: against }, bare);
  }
  choice("against", "against", (name) => { against = name; draw(); });
  if (shown.length) await draw();
  window.comparison = { state: () => ({ shown: shown.length, hidden: [...hidden], against }) };
  document.body.dataset.ready = "yes";
})();
