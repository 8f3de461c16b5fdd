// Everything of the page works on columns of numbers (see page.py): c.t, c.feed, c.x ... of the samples, c.line_... of the NC lines.
(async () => {
  const summary = about.summary;
  const POINTS_OF_PATH = 20000;
  const mark = (name) => performance.mark(name);

  // Header, verdict, prices, notes
  {
    const passed = summary.verdict && summary.verdict.passed;
    element("subtitle").textContent = `${summary.method} on machine ${summary.machine}` +
      (summary.tolerance_mm === null ? "" : `, tolerance ${digits(summary.tolerance_mm / about.units.mm)} ${about.units.length}`) + `; ${summary.blocks.toLocaleString()} blocks`;
    element("verdict").textContent = passed ? "passed" : "failed";
    element("verdict").className = passed ? "passed" : "failed";
    // Words and figures are those of the terminal: summary.told. The header has some of them, the table "In words" all.
    const told = summary.told || [], header = ["cycle time", "saved", "beside the motion", "total", "contour error", "corners missed by"];
    for (const [name, value] of told) {
      const line = make("tr");
      line.append(make("th", name), make("td", value));
      element("told").append(line);
    }
    for (const [name, value] of told.filter(([label]) => header.includes(label))) {
      const pair = make("div");
      pair.append(make("dt", name), make("dd", value.split(":")[0]));
      element("figures").append(pair);
    }
    const rows = [["limit", "largest ratio"], ...Object.entries(summary.verdict.limits).filter(([, ratio]) => ratio > 0).map(([name, ratio]) => [name, digits(ratio, 6), ratio])];
    rows.forEach(([name, value, ratio], k) => {
      const row = make("tr");
      row.append(make(k ? "td" : "th", name), make(k ? "td" : "th", value, ratio > 1 + 1e-6 ? "bad" : ""));
      element("judged").append(row);
    });
    for (const fault of summary.verdict.faults) {
      const row = make("tr"), said = make("td", fault, "bad");
      said.colSpan = 2;
      row.append(said);
      element("judged").append(row);
    }
    for (const text of summary.assumptions || []) element("assumed").append(make("li", `assumed: ${text}`));
    const others = summary.notes.filter((note) => !(summary.assumptions || []).includes(note));
    for (const note of others.length || element("assumed").children.length ? others : ["nothing was assumed or given up"]) element("notes").append(make("li", note));
    element("notes-box").hidden = !element("notes").children.length;
    const prices = summary.prices, saved = prices && prices.saved_s ? Object.entries(prices.saved_s) : [];
    if (saved.length) {
      const head = make("tr");
      head.append(make("th", "more of"), make("th", "saves [s]"));
      element("prices").append(head);
      for (const [name, seconds] of saved.sort((a, b) => b[1] - a[1]).slice(0, 8)) {
        if (!(seconds >= 5e-4 * summary.cycle_time_s)) continue; // as in the terminal
        const row = make("tr"), more = name === "tolerance" ? `${1000 * prices.more_tolerance_mm} µm` : `${100 * prices.more_limit} %`;
        const [least, most] = (prices.hints || []).includes(name) ? prices.saved_range_s[name] : [seconds, seconds];
        const text = least === most ? digits(seconds, 3) : `${digits(name === "tolerance" ? least : Math.max(least, 0), 2)} to ${digits(most, 2)}`;
        row.append(make("td", `${name}, ${more}`), make("td", text));
        element("prices").append(row);
      }
    }
    const every = about.step > 1 ? `Every ${about.step}th of ${about.samples.toLocaleString()} samples, and the fastest between them. ` : "";
    element("foot").textContent = every + `Made by planner ${summary.versions.planner}; this page needs no network.`;
  }

  // The first picture is painted with the header; what takes longer follows (a page in the background paints nothing, and goes on).
  await Promise.race([new Promise((painted) => requestAnimationFrame(() => setTimeout(painted, 0))), new Promise((late) => setTimeout(late, 500))]);
  element("axes").textContent = about.axes.replaceAll(` [${about.units.length}]`, "") + ` in ${about.units.length}${about.beyond}`;
  mark("first picture");
  const script = make("script", element("plotly").textContent);
  element("plotly").remove();
  document.head.append(script);
  mark("plotly");
  await Promise.all(Object.entries(about.columns).map(([name, type]) => unpack(name, type)));
  mark("columns");
  const N = c.t.length, linear = about.linear, { mm, per_feed: perFeed, feed: feedUnit } = about.units;
  const escaped = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
  const word = { none: "nothing", rest: "dwells" }, limitNames = about.limits.map((name) => word[name] || name), limits = limitNames.map(escaped);
  const text = new TextDecoder().decode(c.program);
  const programLines = text.length ? text.split(/\r\n|\n|\r/) : [];

  // The path
  const colourings = about.colourings;
  for (const button of [...element("colours").children]) if (!colourings[button.dataset.colour]) button.remove();
  let colouring = "feed", range = [0, N - 1], against = "t", now = 0, top = about.layers.length;
  // Samples that are drawn: all that are in sight, or every so many where these are too many; farther away a tenth as many.
  let sight = () => true;
  const below = (k) => !c.layer || c.layer[k] <= top;
  function pathRows() {
    const [first, last] = range, seen = [];
    for (let k = first; k <= last; k++) if (below(k) && sight(k)) seen.push(k);
    const step = Math.max(1, Math.ceil(seen.length / POINTS_OF_PATH)), far = Math.max(1, Math.ceil(10 * (last - first + 1) / POINTS_OF_PATH));
    const rows = [];
    let inSight = 0;
    for (let k = first; k <= last; k++) {
      if (!below(k)) continue;
      const drawn = sight(k) ? inSight++ % step === 0 : k % far === 0;
      if (drawn || k === first || k === last) rows.push(k);
    }
    return rows;
  }
  const calls = (k) => (c.frame && about.calls[c.frame[k]]) || ""; // that led to the line, in an expanded program
  const place = (k) => [0, 1, 2].map((a) => (a < linear.length ? c[linear[a]][k] / mm : 0));
  function pathTrace() {
    const rows = pathRows(), how = colourings[colouring], line = { ...how[dark ? "dark" : "light"], color: rows.map((k) => (how.rapid && c.rapid[k] ? how.rapid : how.scale * c[how.column][k])) };
    const at = [0, 1, 2].map((a) => (a < linear.length ? rows.map((k) => c[linear[a]][k] / mm) : rows.map(() => 0)));
    return {
      type: "scatter3d", mode: "lines", x: at[0], y: at[1], z: at[2], line, name: "motion", rows,
      customdata: rows.map((k) => [calls(k) ? c.line[k] + calls(k) : c.line[k], perFeed * c.feed[k], limits[c.limit[k]], c.t[k], 1000 * c.deviation[k], c.price ? colourings.price.scale * c.price[k] : 0]),
      hovertemplate: "line %{customdata[0]}<br>feed %{customdata[1]:.4g} " + feedUnit + "<br>held by %{customdata[2]}<br>" +
        "t %{customdata[3]:.4f} s<br>deviation %{customdata[4]:.2g} µm" +
        (c.price ? "<br>saved per µm %{customdata[5]:.3g} µs" : "") + "<extra></extra>",
    };
  }
  const programmed = { x: [], y: [], z: [] };
  for (let k = 0; k + 2 < c.path.length; k += 3) {
    programmed.x.push(c.path[k] / mm);
    programmed.y.push(c.path[k + 1] / mm);
    programmed.z.push(c.path[k + 2] / mm);
  }
  const marker = () => {
    const [x, y, z] = place(now);
    return { x: [[x]], y: [[y]], z: [[z]] };
  };
  const pathPlot = element("path"), profilePlot = element("profile");
  element("first").className = "printed";
  pathPlot.hidden = false;
  const { colorscale, cmax } = colourings.feed.light, stripe = make("i"), shown = colorscale.filter(([at]) => at > colorscale[1][0] || at === 1);
  stripe.style.background = `linear-gradient(90deg, ${shown.map(([, colour]) => colour).join()})`;
  element("scale").append("feed 0", stripe, `${digits(cmax)} ${feedUnit}; rapids grey`);
  const view = pathLayout(about.view, pathPlot), fitted = view.scene.aspectratio.x;
  await Plotly.newPlot(pathPlot, [
    { ...about.programmed, ...programmed },
    pathTrace(),
    { type: "scatter3d", mode: "markers", x: [place(0)[0]], y: [place(0)[1]], z: [place(0)[2]], hoverinfo: "skip",
      marker: { size: 7, color: dark ? "#ffffff" : "#000000" }, name: "here" },
    ...(about.travel ? [{ ...about.programmed, ...about.travel.box, name: "travel", visible: false }] : []),
  ], view, bare);
  mark("path");
  // Zoomed in, the part in sight is drawn finer: the samples near the axis of sight. The scene's own lengths are those of its aspect ratio.
  let waiting = null;
  pathPlot.on("plotly_relayout", (change) => {
    if (!Object.keys(change).some((key) => key.startsWith("scene.camera") || key.startsWith("scene.aspectratio"))) return;
    clearTimeout(waiting);
    waiting = setTimeout(() => {
      const full = pathPlot._fullLayout.scene, { eye, center } = full.camera, at = { x: 0, y: 0, z: 0, ...center };
      if (full.aspectratio.x < 1.3 * fitted) { sight = () => true; redrawPath(); return; }
      const way = ["x", "y", "z"].map((a) => eye[a] - at[a]), far = Math.hypot(...way), reach = Math.hypot(1, pathPlot.clientWidth / pathPlot.clientHeight);
      const unit = way.map((w) => w / far), scale = ["x", "y", "z"].map((a) => {
        const [low, high] = full[a + "axis"].range;
        return [(low + high) / 2, full.aspectratio[a] / (high - low)];
      });
      sight = (k) => {
        const off = place(k).map((v, a) => (v - scale[a][0]) * scale[a][1] - at["xyz"[a]]);
        const along = off[0] * unit[0] + off[1] * unit[1] + off[2] * unit[2];
        return off.reduce((sum, v) => sum + v * v, 0) - along * along < reach * reach;
      };
      redrawPath();
    }, 250);
  });
  function redrawPath() {
    const trace = pathTrace();
    return Plotly.react(pathPlot, [pathPlot.data[0], trace, ...pathPlot.data.slice(2)], pathPlot.layout, bare);
  }
  choice("colours", "colour", (name) => { colouring = name; redrawPath(); });
  if (about.travel) element("travel").onclick = () => {
    const on = element("travel").classList.toggle("on"), seen = pathLayout(on ? about.travel.view : about.view, pathPlot);
    const drawn = [...pathPlot.data.slice(0, 3), { ...pathPlot.data[3], visible: on }];
    Plotly.react(pathPlot, drawn, { ...seen, uirevision: on ? "travel" : "keep" }, bare);
  };
  else element("travel").remove();
  if (about.layers.length) {
    const slider = element("layer"), told = element("top");
    slider.max = slider.value = top = about.layers.length - 1;
    told.textContent = about.layers[top];
    slider.oninput = () => { top = Number(slider.value); told.textContent = about.layers[top]; redrawPath(); };
  } else element("layers").remove();

  // The profiles
  function drawProfile() {
    const [data, layout] = panels(about.profile, against, range), base = c[against];
    layout.xaxis.range = range.map((k) => base[k]);
    for (const name of ["yaxis", "yaxis2", "yaxis3"]) layout[name] = { ...layout[name], fixedrange: true };
    layout.shapes = [{ type: "line", xref: "x", yref: "paper", x0: base[now], x1: base[now], y0: 0, y1: 1, line: { color: "#D55E00", width: 1.5 } }, ...layout.shapes];
    return Plotly.react(profilePlot, data, { ...layout, hovermode: "closest", legend: { orientation: "h", y: 1.06 } }, bare);
  }
  await drawProfile();
  choice("against", "against", (name) => { against = name; drawProfile(); });
  const find = (column, value) => {
    let low = 0, high = N - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (column[middle] < value) low = middle + 1; else high = middle;
    }
    return low;
  };
  profilePlot.on("plotly_relayout", (change) => {
    if (change["xaxis.autorange"]) range = [0, N - 1];
    else if (change["xaxis.range[0]"] !== undefined) {
      const first = find(c[against], change["xaxis.range[0]"]), last = find(c[against], change["xaxis.range[1]"]);
      range = [Math.max(0, Math.min(first, N - 2) - 1), Math.max(last, 1)];
    } else return;
    drawProfile();
    redrawPath();
  });

  // Lists of any length: only the rows in sight are in the page.
  function list(id, count, row, onClick) {
    const box = element(id), height = 20, spacer = make("div"), drawn = new Map();
    let marked = -1;
    spacer.style.height = count * height + "px";
    box.style.height = Math.min(box.clientHeight, Math.max(count, 3) * height + 16) + "px";
    box.append(spacer);
    const draw = () => {
      const first = Math.max(0, Math.floor(box.scrollTop / height) - 5), last = Math.min(count, first + Math.ceil(box.clientHeight / height) + 10);
      for (const [k, made] of drawn) if (k < first || k >= last) { made.remove(); drawn.delete(k); }
      for (let k = first; k < last; k++) {
        if (drawn.has(k)) continue;
        const made = row(k);
        made.classList.add("row");
        made.style.top = k * height + "px";
        made.classList.toggle("on", k === marked);
        made.onclick = () => onClick(k);
        box.append(made);
        drawn.set(k, made);
      }
    };
    box.onscroll = draw;
    new ResizeObserver(draw).observe(box);
    draw();
    return {
      clear() { for (const made of drawn.values()) made.remove(); drawn.clear(); draw(); },
      mark(k, scroll) {
        if (k !== marked) { drawn.get(marked)?.classList.remove("on"); marked = k; drawn.get(k)?.classList.add("on"); }
        if (scroll && k >= 0 && (k * height < box.scrollTop || (k + 1) * height > box.scrollTop + box.clientHeight)) {
          box.scrollTop = Math.max(0, k * height - box.clientHeight / 2);
          draw();
        }
      },
    };
  }
  const firstSample = new Map();
  for (let k = N - 1; k >= 0; k--) firstSample.set(c.line[k], k);
  const goToLine = (line) => { if (firstSample.has(line)) show(firstSample.get(line), true); };
  const programList = list("program", programLines.length, (k) => {
    const made = make("div");
    made.append(make("span", String(k + 1), "number"), document.createTextNode(programLines[k]));
    return made;
  }, (k) => goToLine(k + 1));
  if (!programLines.length) element("program").append(make("p", "The text of the program is not at hand.", "hint"));

  function table(id, headings, columns, lineOf, wide) {
    const order = Array.from(lineOf, (_, k) => k), head = make("div", undefined, wide);
    let sorted = -1, way = 1, shown;
    headings.forEach((heading, k) => {
      const button = make("button", heading.name, heading.text ? "text" : "");
      button.onclick = () => {
        way = sorted === k ? -way : heading.text || k === 0 ? 1 : -1;
        sorted = k;
        const value = columns[k], safe = (v) => (typeof v === "number" && !Number.isFinite(v) ? -Infinity : v ?? -Infinity);
        order.sort((a, b) => { const u = safe(value(a)), v = safe(value(b)); return way * (u < v ? -1 : u > v ? 1 : 0) || a - b; });
        for (const other of head.children) other.classList.toggle("sorted", other === button);
        shown.clear();
      };
      head.append(button);
    });
    element(id + "-head").append(head);
    shown = list(id, order.length, (k) => {
      const made = make("div", undefined, wide);
      headings.forEach((heading, n) => {
        const value = columns[n](order[k]);
        const shown = typeof value === "number" ? (heading.whole ? String(value) : short(value)) : value ?? "–";
        made.append(make("span", shown, heading.text ? "text" : ""));
        made.lastChild.title = shown;
      });
      return made;
    }, (k) => goToLine(lineOf[order[k]]));
  }
  table("lines", [
    { name: "line", whole: true }, { name: "text", text: true }, { name: "planned [s]" }, { name: "at F [s]" }, { name: "planned / at F" },
    { name: `highest feed [${feedUnit}]` }, { name: "held by", text: true }, { name: "deviation [µm]" },
    ...(c.line_more ? [{ name: "10 % more F saves [ms]" }, { name: "10 % more of all limits saves [ms]" }] : []),
  ], [
    (k) => c.line_line[k], (k) => (programLines[c.line_line[k] - 1] || "").trim(), (k) => c.line_planned[k], (k) => c.line_programmed[k],
    (k) => c.line_planned[k] / c.line_programmed[k], (k) => perFeed * c.line_highest[k], (k) => limitNames[c.line_limit[k]], (k) => 1000 * c.line_deviation[k],
    ...(c.line_more ? [c.line_more_feed, c.line_more].map((saved) => (k) => Math.round(1e6 * saved[k]) / 1e3) : []),
  ], c.line_line, c.line_more ? "cells ten" : "cells");
  const corner = about.corners;
  if (corner.line && corner.line.length) {
    table("corners", [
      { name: "line", whole: true }, { name: "angle [deg]" }, { name: `feed [${feedUnit}]` }, { name: "eq. 19: feed / allowed" }, { name: "eq. 18: error / budget" },
      { name: `eq. 20 [${feedUnit}]` }, { name: "feed / eq. 20" },
    ], ["line", "angle", "feed", "eq19", "eq18", "eq20", "gain"].map((name) => (k) => (name === "feed" || name === "eq20" ? perFeed : 1) * corner[name][k]), corner.line, "cells seven");
    element("corner-count").textContent = `${corner.line.length.toLocaleString()} of ${summary.corners.count.toLocaleString()} corners`;
  } else element("corners-box").hidden = true;

  // Shares of the time
  {
    const held = Object.entries(summary.held_by || {}).filter(([, share]) => Math.floor(100 * share + 0.5) > 0).reverse();
    if (held.length) {
      await Plotly.newPlot("share", [{ type: "bar", orientation: "h", y: held.map(([name]) => escaped(word[name] || name)), x: held.map(([, share]) => 100 * share),
        marker: { color: held.map(([name]) => about.colours[name]) }, text: held.map(([, share]) => `${Math.floor(100 * share + 0.5)} %`),
        textposition: "outside", cliponaxis: false, textangle: 0, hovertemplate: "%{y}: %{text} of the time<extra></extra>" }],
      { ...look, margin: { l: 110, r: 44, t: 6, b: 40 }, xaxis: { title: { text: "share of the cycle time, each in full [%]" } }, yaxis: { automargin: true } }, { ...bare, displayModeBar: false });
    } else {
      element("share").remove();
      element("share-box").hidden = !element("prices").children.length;
    }
  }

  // One place of the motion, shown everywhere
  function show(k, scroll) {
    now = k;
    element("clock").textContent = c.t[k].toFixed(3) + " s";
    element("where").textContent = `line ${c.line[k]}${calls(k)}, ${digits(perFeed * c.feed[k])} ${feedUnit}, ${limitNames[c.limit[k]]}`;
    programList.mark(c.line[k] - 1, scroll);
    Plotly.restyle(pathPlot, marker(), [2]);
    Plotly.relayout(profilePlot, { "shapes[0].x0": c[against][k], "shapes[0].x1": c[against][k] });
  }
  const sampleOf = (event) => {
    const point = event.points.find((one) => one.data.rows);
    return point ? point.data.rows[point.pointNumber] : null;
  };
  pathPlot.on("plotly_click", (event) => { const k = sampleOf(event); if (k !== null) show(k, true); });
  pathPlot.on("plotly_hover", (event) => { const k = sampleOf(event); if (k !== null) programList.mark(c.line[k] - 1, true); });
  profilePlot.on("plotly_hover", (event) => show(find(c[against], event.points[0].x), true));

  let playing = null;
  element("play").onclick = () => {
    if (playing !== null) { cancelAnimationFrame(playing); playing = null; element("play").textContent = "play"; return; }
    element("play").textContent = "pause";
    if (now >= N - 1) show(0, true);
    let before = performance.now(), time = c.t[now], drawn = 0;
    const frame = (at) => {
      time += (at - before) / 1000 * Number(element("speed").value);
      before = at;
      if (at - drawn > 60) { drawn = at; show(find(c.t, Math.min(time, c.t[N - 1])), true); }
      if (time >= c.t[N - 1]) { show(N - 1, true); playing = null; element("play").textContent = "play"; return; }
      playing = requestAnimationFrame(frame);
    };
    playing = requestAnimationFrame(frame);
  };
  mark("ready");
  window.report = { ready: true, show, drawn: () => pathRows().length, state: () => ({ now, range, colouring, against, line: c.line[now], samples: N }) };
  document.body.dataset.ready = "yes";
})();
