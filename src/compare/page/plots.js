// Plots as inline SVG, drawn as wide as they are shown, so that their words keep their size on a phone.

const PALETTE = 6;
/** Methods in colour, by the number of their colour; all others are grey. */
const colored = new Map();

function startColors() {
  const wanted = [data.ours, ...data.chain.links.map((link) => link.method), ...data.bands.flatMap((band) => (band.best ? [band.best[0]] : []))];
  const known = [...new Set(wanted)].filter((method) => compared.some((run) => run.method === method));
  const others = compared.map((run) => run.method).filter((method) => !known.includes(method) && method !== data.truth);
  [...known, ...others].slice(0, PALETTE).forEach((method, i) => colored.set(method, i));
  byId("chips").replaceChildren(...compared.map((run) => element("button", { type: "button", "data-method": run.method, onclick: () => press(run.method) }, element("i"), run.method)));
}

/** Gives a method a colour, or takes it away; of more than there are, the oldest goes. */
function press(method) {
  if (!colored.delete(method)) {
    if (colored.size >= PALETTE) colored.delete(colored.keys().next().value);
    const free = [...Array(PALETTE).keys()].find((i) => ![...colored.values()].includes(i));
    colored.set(method, free);
  }
  showPlots();
}

const colorOf = (method) => (colored.has(method) ? `var(--c${colored.get(method)})` : "var(--rest)");

function showPlots() {
  for (const chip of byId("chips").children) {
    chip.setAttribute("aria-pressed", String(colored.has(chip.dataset.method)));
    chip.firstChild.style.background = colorOf(chip.dataset.method);
  }
  showMeaning("pareto-error", "pareto-meaning");
  showMeaning("elevation-error", "elevation-meaning");
  byId("pareto-plots").replaceChildren(...heights.flatMap((heightPx) => ["bytes", "ms"].map((key) => pareto(heightPx, costs[key]))));
  byId("elevation-plots").replaceChildren(...heights.map(climb));
}

function showMeaning(select, target) {
  const column = columnOf(byId(select).value);
  byId(target).textContent = `${titleOf(column)}: ${column.meaning}; 0 is perfect.`;
}

/** Round steps from 0 to at least `top`. */
function ticks(top) {
  const rough = (top || 1) / 4;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((factor) => factor * power).find((candidate) => candidate >= rough);
  const count = Math.max(1, Math.ceil((top || 1) / step - 1e-9));
  return Array.from({ length: count + 1 }, (_, i) => i * step);
}

/** Powers of ten within a range, and what lies between where there are few. */
function logTicks(low, high) {
  const all = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power += 1) all.push(10 ** power);
  const within = all.filter((value) => value >= low * 0.999 && value <= high * 1.001);
  if (within.length > 1) return within;
  return all.flatMap((value) => [value, 2 * value, 5 * value]).filter((value) => value >= low * 0.999 && value <= high * 1.001);
}

const pen = document.createElement("canvas").getContext("2d");

/** How wide a name in a plot is, pixels. */
function textWidth(text, bold) {
  pen.font = `${bold ? 600 : 400} 12px ${getComputedStyle(document.body).fontFamily}`;
  return pen.measureText(text).width;
}

/** The frame of a plot: its size, and both axes. `xs.room` pixels stay free on the right. */
function frame(xs, ys, showX, nameX, nameY, container) {
  const width = Math.max(300, Math.min(container.clientWidth || 480, container.clientWidth >= 984 ? (container.clientWidth - 24) / 2 : 1e9));
  const [left, right, top, bottom] = [48, width - 14, 26, 296];
  const x = (value) => left + 10 + ((value - xs.low) / (xs.high - xs.low || 1)) * (right - left - 20 - (xs.room ?? 0));
  const y = (value) => bottom - (value / ys.at(-1)) * (bottom - top);
  const svg = drawn("svg", { viewBox: `0 0 ${width} 340`, role: "img" });
  for (const value of ys) {
    svg.append(drawn("line", { class: "axis", x1: left, x2: right, y1: y(value), y2: y(value) }),
      drawn("text", { x: left - 8, y: y(value) + 4, "text-anchor": "end" }, String(Number(value.toPrecision(3)))));
  }
  for (const value of xs.ticks) {
    svg.append(drawn("line", { class: "axis", x1: x(value), x2: x(value), y1: bottom, y2: bottom + 5 }),
      drawn("text", { x: x(value), y: bottom + 19, "text-anchor": "middle" }, showX(value)));
  }
  svg.append(drawn("text", { x: (left + right) / 2, y: 336, "text-anchor": "middle" }, nameX), drawn("text", { x: 4, y: 12 }, nameY));
  return { svg, x, y, left, right, top, bottom, width };
}

function pareto(heightPx, cost) {
  const title = `${distanceName(heightPx)}: ${cost.short}`;
  const id = byId("pareto-error").value;
  const here = rows.filter((row) => row.height_px === heightPx && !row.failed && number(errorOf(row.error, id)) && cost.of(row.cost) > 0);
  if (here.length === 0) return element("figure", {}, element("figcaption", {}, title), element("p", { class: "small" }, "There are no figures at this distance."));
  const points = here.map((row) => ({ row, cost: cost.of(row.cost), error: errorOf(row.error, id) }));
  const logs = points.map((point) => Math.log10(point.cost));
  const pad = Math.max(0.15, 0.08 * (Math.max(...logs) - Math.min(...logs)));
  const [low, high] = [Math.min(...logs) - pad, Math.max(...logs) + pad];
  const xs = { low, high, ticks: logTicks(10 ** low, 10 ** high).map(Math.log10) };
  const limit = id === "flip" ? data.max_flip : 0;
  const ys = ticks(1.04 * Math.max(...points.map((point) => point.error), limit));
  const show = (value) => cost.show(10 ** value).replace(" triangles", "");
  const plot = frame(xs, ys, show, `${cost.name}, logarithmic`, titleOf(columnOf(id)), byId("pareto-plots"));
  const { svg, x, y } = plot;
  if (limit) svg.append(drawn("line", { class: "limit", x1: plot.left, x2: plot.right, y1: y(limit), y2: y(limit) }));
  const beaten = (a) => points.some((b) => b.cost <= a.cost && b.error <= a.error && (b.cost < a.cost || b.error < a.error));
  const front = points.filter((point) => !beaten(point)).sort((a, b) => a.cost - b.cost);
  const at = (point) => [x(Math.log10(point.cost)), y(point.error)];
  const steps = front.map((point, i) => (i === 0 ? `M${at(point)[0]},${plot.top}V${at(point)[1]}` : `H${at(point)[0]}V${at(point)[1]}`)).join("");
  svg.append(drawn("path", { class: "front", d: `${steps}H${plot.right}` }));
  // Rings first, then grey, so that no colour is hidden.
  const rank = ({ row }) => (row.level ? 0 : 2) + (colored.has(row.method) ? 1 : 0);
  const order = [...points].sort((a, b) => rank(a) - rank(b));
  for (const point of order) {
    const [cx, cy] = at(point);
    const color = colorOf(point.row.method);
    const told = `${methodName(point.row.method, point.row.level)}: ${fixed(3)(point.error)}, ${cost.show(point.cost)}`;
    svg.append(drawn("circle", { cx, cy, r: point.row.level ? 3.5 : 5.5, fill: point.row.level ? "var(--paper)" : color, stroke: color, "stroke-width": 1.5 }, drawn("title", {}, told)));
  }
  const named = points.filter((point) => !point.row.level).sort((a, b) => colored.has(b.row.method) - colored.has(a.row.method));
  place(plot, named.map((point) => ({ at: at(point), text: point.row.method, method: point.row.method })), points.map(at));
  svg.setAttribute("aria-label", `${titleOf(columnOf(id))} against ${cost.name} where the tree is ${distanceName(heightPx)}: ${points.map((point) => `${methodName(point.row.method, point.row.level)} ${fixed(3)(point.error)}`).join(", ")}`);
  return element("figure", {}, element("figcaption", {}, title), svg);
}

/** Writes names beside their points, each where it covers neither a name nor a point; far ones with a line. */
function place(plot, names, points) {
  const taken = points.map(([x, y]) => [x - 6, y - 6, x + 6, y + 6]);
  const clear = (box) => box[0] >= plot.left && box[2] <= plot.right + 4 && box[1] >= plot.top - 8 && box[3] <= plot.bottom &&
    !taken.some((other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3]);
  for (const { at: [x, y], text, method } of names) {
    const wide = textWidth(text, colored.has(method));
    const boxes = [9, 20, 34, 50, 70, 95].flatMap((reach) => [[1, 0], [-1, 0], [0, -1], [0, 1], [0.8, -0.8], [0.8, 0.8], [-0.8, -0.8], [-0.8, 0.8]].map(([dx, dy]) => {
      const left = dx > 0 ? x + dx * reach : dx < 0 ? x + dx * reach - wide : x - wide / 2;
      const middle = y + dy * (reach + 3);
      return { box: [left, middle - 7, left + wide, middle + 7], reach };
    }));
    const found = boxes.find(({ box }) => clear(box)) ?? boxes[0];
    const [left, top, right, bottom] = found.box;
    taken.push(found.box);
    if (found.reach > 9) {
      const end = [Math.min(Math.max(x, left), right), Math.min(Math.max(y, top), bottom)];
      plot.svg.append(drawn("line", { class: "lead-line", x1: x, y1: y, x2: end[0], y2: end[1] }));
    }
    const style = colored.has(method) ? `fill:${colorOf(method)};font-weight:600` : null;
    plot.svg.append(drawn("text", { class: colored.has(method) ? "name" : "name rest", x: left, y: bottom - 3, style }, text));
  }
}

function climb(heightPx) {
  const id = byId("elevation-error").value;
  const lines = compared.map((run) => ({
    method: run.method,
    points: elevations
      .filter((entry) => entry.method === run.method && !entry.level && entry.height_px === heightPx && number(errorOf(entry.error, id)))
      .map((entry) => [entry.elevation_deg, errorOf(entry.error, id)])
      .sort((a, b) => a[0] - b[0]),
  })).filter((line) => line.points.length > 0);
  const top = Math.max(...lines.flatMap((line) => line.points.map((point) => point[1])), 0);
  const [low, high] = [elevationsDeg[0], elevationsDeg.at(-1)];
  const room = Math.max(0, ...lines.map((line) => textWidth(line.method, true))) + 12;
  const xs = { low, high, room, ticks: elevationsDeg };
  const plot = frame(xs, ticks(1.04 * top), (value) => `${value}°`, "Elevation of the viewer", titleOf(columnOf(id)), byId("elevation-plots"));
  const at = ([x, y]) => [plot.x(x), plot.y(y)];
  lines.sort((a, b) => colored.has(a.method) - colored.has(b.method));
  for (const { method, points } of lines) {
    const told = `${method}: ${points.map(([deg, error]) => `${deg}° ${fixed(3)(error)}`).join(", ")}`;
    const color = colorOf(method);
    const width = colored.has(method) ? 2.5 : 1.25;
    plot.svg.append(drawn("g", {}, drawn("title", {}, told),
      drawn("polyline", { points: points.map((point) => at(point).join()).join(" "), fill: "none", stroke: color, "stroke-width": width, "stroke-linejoin": "round" }),
      ...points.map((point) => drawn("circle", { cx: at(point)[0], cy: at(point)[1], r: width + 1, fill: color }))));
  }
  // Names stand at the lines' right ends, moved apart; grey ones only where there is room.
  const ends = lines.map(({ method, points }) => ({ method, end: at(points.at(-1)), y: at(points.at(-1))[1] }));
  const placed = [];
  const free = (y) => placed.every((other) => Math.abs(other - y) >= 14) && y > plot.top - 8 && y < plot.bottom + 4;
  for (const { method, end } of ends.reverse()) {
    const shifts = Array.from({ length: 30 }, (_, i) => (i % 2 ? -1 : 1) * 4 * Math.ceil(i / 2));
    const shift = shifts.find((candidate) => free(end[1] + candidate));
    if (shift === undefined) continue;
    const y = end[1] + shift;
    placed.push(y);
    const style = colored.has(method) ? `fill:${colorOf(method)};font-weight:600` : null;
    plot.svg.append(drawn("line", { class: "lead-line", x1: end[0] + 4, y1: end[1], x2: end[0] + 12, y2: y }),
      drawn("text", { class: colored.has(method) ? "name" : "name rest", x: end[0] + 15, y: y + 4, style }, method));
  }
  plot.svg.setAttribute("aria-label", `${titleOf(columnOf(id))} by elevation where the tree is ${distanceName(heightPx)}`);
  return element("figure", {}, element("figcaption", {}, distanceName(heightPx)), plot.svg);
}

/** Errors against the photograph itself. */
function startPhotographed() {
  byId("photographed").hidden = photographed.length === 0;
  const drawn = compared.filter((run) => photographed.some((entry) => entry.method === run.method && !entry.level));
  const error = (run, heightPx, id) => errorOf(photographed.find((entry) => entry.method === run.method && !entry.level && entry.height_px === heightPx)?.error, id);
  const shown = [["flip", "FLIP"], ["silhouette", "1 − IoU"]];
  const figures = heights.flatMap((heightPx) => shown.map(([id, name]) => ({ name: `${name}, ${whole(heightPx)} px`, value: (run) => error(run, heightPx, id), show: fixed(3), meaning: columnOf(id).meaning })));
  const named = { name: "Method", value: (run) => run.method, text: true, meaning: "the method" };
  byId("photographed-table").replaceChildren(sortable("Errors against the photograph; 0 is perfect", [named, ...figures], drawn, 1));
}

function startPlots() {
  choices(byId("pareto-error"), errorChoices);
  choices(byId("elevation-error"), errorChoices);
  ["pareto-error", "elevation-error"].forEach((id) => byId(id).addEventListener("change", showPlots));
  startColors();
  showPlots();
  let width = byId("pareto-plots").clientWidth;
  window.addEventListener("resize", () => {
    if (byId("pareto-plots").clientWidth === width) return;
    width = byId("pareto-plots").clientWidth;
    showPlots();
  });
}
