// The answer, what was refused, the parameters; then everything begins.

const cost = costs[data.cost];

/** What was planned and what it took, and what was left out for it. */
function budgetText() {
  const { allowed_s: allowed, planned_s: planned, taken_s: taken, peak_mb: peak, thinned } = data.budget;
  const left = thinned.length ? ` To fit, it was thinned out: ${thinned.join("; ")}.` : " Nothing was left out to fit.";
  return `Planned for ${whole(planned)} s of ${whole(allowed)} s allowed (four cores, software driver), it took ${whole(taken)} s` +
    `${number(peak) ? ` and at most ${digits(peak / 1000)} GB of memory` : ""}.${left}`;
}

/** Where the time went, as planned and as taken. */
function spentText() {
  const { planned, spent } = data.budget;
  const parts = [["truth_s", "the truth"], ["build_s", "building"], ["timing_s", "timing"], ["files_s", "files"], ["pictures_s", "pictures"], ["motion_s", "films"], ["rest_s", "getting ready and waiting"]];
  return parts.map(([id, name]) => `${name} ${digits(spent[id])} s (planned ${digits(planned[id])})`).join(", ");
}

function startAnswer() {
  const refused = data.methods.length - compared.length;
  byId("looked").textContent =
    `${compared.length} methods${refused ? ` (and ${refused} refused)` : ""} held against a tree ${digits(data.height_m)} m high, from ${views.length} views ` +
    `at ${heights.length} distances under ${suns.length} sun${suns.length > 1 ? "s" : ""}. ${budgetText()}`;
  const { chain, bands } = data;
  const place = (distance) => (distance === 0 ? "at any nearer distance" : `from ${away(distance)} tree heights on (${whole(data.focal_px / distance)} px high)`);
  const { links } = chain;
  const chainText = links.map(({ method, level, from_distance: from }) => `${methodName(method, level)}${from === 0 ? "" : ` ${place(from)}`}`);
  byId("answer-lead").textContent = links.length === 0
    ? `No method stays under a mean FLIP of ${data.max_flip} at any distance.`
    : links.length === 1
      ? `Draw ${chainText[0]}${bands.every((band) => band.good) ? " at every distance" : ""}: the cheapest in ${cost.short} under a mean FLIP of ${data.max_flip}.`
      : `Draw ${chainText[0]} first, then ${chainText.slice(1).join(", then ")}: at each distance the cheapest in ${cost.short} under a mean FLIP of ${data.max_flip}.`;
  const without = bands.filter((band) => !band.good);
  if (links.length > 0 && without.length > 0) {
    byId("answer-lead").textContent += ` Where the tree is ${listed(without.map((band) => `${whole(band.height_px)} px`))} high nothing stays under that error, ` +
      "not even the tree itself with one sample for each pixel; the chain goes on there with the cheapest that is no worse than what stands before it.";
  }
  if (without.length > 0) {
    const needed = Math.ceil(100 * Math.max(...without.map((band) => (band.best ? band.best[1] : band.flip)))) / 100;
    if (needed < 1) byId("answer-lead").textContent += ` With --max-flip ${needed} there would be an answer at every distance.`;
  }
  if (links.length === 1 && links[0].method === data.truth) byId("answer-lead").textContent += " No stand-in within that error is cheaper.";
  byId("chain").replaceChildren(...links.map(({ method, level, from_distance: from }, i) => {
    const until = links[i + 1]?.from_distance;
    const range = from === 0 ? (until ? `up to ${away(until)} tree heights` : `at every distance${without.length ? ", for want of better at some" : ""}`) : until ? `${away(from)} to ${away(until)} tree heights` : `beyond ${away(from)} tree heights`;
    const size = from === 0 ? (until ? `taller than ${whole(data.focal_px / until)} px` : "") : `${whole(data.focal_px / from)} px high${until ? ` down to ${whole(data.focal_px / until)} px` : " and less"}`;
    return element("li", {}, element("b", {}, methodName(method, level)), element("span", {}, range), element("span", {}, size));
  }));
  const bandText = ({ method, level, good }) => [...(good ? [] : [`none under ${data.max_flip}`]), ...(method ? [methodName(method, level)] : [])].join("; ");
  const bandColumns = [
    { name: "Tree on screen", value: (band) => `${whole(band.height_px)} px` },
    { name: "Cheapest good enough", text: true, value: bandText, id: "method" },
    { name: "FLIP", value: (band) => (band.method ? fixed(3)(band.flip) : "–") },
    { name: "Cost", value: (band) => (band.method ? cost.show(band.cost) : "–") },
    { name: "Least error, at any cost", text: true, value: (band) => (band.best ? `${band.best[0]}, ${fixed(3)(band.best[1])}` : "–") },
    { name: "Distance", unit: "tree heights", value: (band) => away(treeHeights(band.height_px)) },
  ];
  byId("bands").replaceChildren(plainTable("By distance", bandColumns, bands, (column, band) => (column.id === "method" ? (band.good ? "text good" : "text none") : null)));
  byId("answer-how").textContent =
    `FLIP is what a person notices who flickers between the picture and the truth, 0 to 1, here the mean over all views and suns at ${digits(data.pixels_per_degree)} pixels per degree, ` +
    `over a bright and a dark background. The tree itself counts as a method too; its own error is that of one sample for each pixel. Cost is counted by ${cost.name.toLowerCase()}; times were taken on ${data.identity.adapter}. ` +
    `Distances are in heights of the tree: at ${Math.round(data.focal_px)} heights it is 1 px high.`;
}

/** Says where the project's own method is beaten; nobody else will. */
function startLosses() {
  const own = compared.find((run) => run.method === data.ours);
  const all = elevations.filter((entry) => entry.method === data.ours && !entry.level).length;
  const lead = byId("loss-lead");
  if (!own) {
    lead.textContent = `The ${data.ours} was not compared, so that nothing can be said of it.`;
    return;
  }
  if (data.losses.length === 0) {
    lead.textContent = `From none of the ${all} combinations of distance and elevation has another method of equal or fewer bytes a lower FLIP.`;
    return;
  }
  const wins = new Map();
  data.losses.forEach((loss) => loss.by.forEach((entry) => wins.set(entry.method, (wins.get(entry.method) ?? 0) + 1)));
  const rivals = [...wins].sort((a, b) => b[1] - a[1]).map(([method, times]) => `${method} (${times})`);
  const worst = [...data.losses].sort((a, b) => b.ours.flip - b.by[0].flip - (a.ours.flip - a.by[0].flip))[0];
  lead.textContent =
    `At ${data.losses.length} of ${all} combinations of distance and elevation another method of equal or fewer bytes has a lower FLIP: ${listed(rivals)}. ` +
    `It loses most at ${whole(worst.height_px)} px from ${worst.elevation_deg}°, where ${worst.by[0].method} has ${fixed(3)(worst.by[0].flip)} with ${bytes(worst.by[0].bytes)} ` +
    `against ${fixed(3)(worst.ours.flip)} with ${bytes(worst.ours.bytes)}.`;
  const lossColumns = [
    { name: "Tree on screen", value: (loss) => `${whole(loss.height_px)} px` },
    { name: "Elevation", value: (loss) => `${loss.elevation_deg}°` },
    { name: "Its FLIP", value: (loss) => fixed(3)(loss.ours.flip) },
    { name: "Its bytes", value: (loss) => bytes(loss.ours.bytes) },
    { name: "Beaten by", text: true, value: (loss) => loss.by.map((entry) => `${entry.method} ${fixed(3)(entry.flip)} (${bytes(entry.bytes)})`).join(", ") },
  ];
  byId("losses").replaceChildren(plainTable("Where another method of equal or fewer bytes has a lower FLIP", lossColumns, data.losses));
  byId("loss-more").hidden = false;
}

function startRefused() {
  const list = (entries) => element("dl", {}, ...entries.flatMap(([name, text]) => [element("dt", {}, element("b", {}, name)), element("dd", {}, text)]));
  const refused = data.methods.filter((run) => run.refused).map((run) => [run.method, run.refused]);
  const failed = rows.filter((row) => row.failed).map((row) => [`${methodName(row.method, row.level)}, ${whole(row.height_px)} px`, row.failed]);
  const warned = data.methods.filter((run) => run.warnings.length).map((run) => [run.method, run.warnings.join("; ")]);
  const part = (head, entries, none) => [element("h3", {}, head), entries.length ? list(entries) : element("p", { class: "small" }, none)];
  byId("refused-list").replaceChildren(
    ...part("Refused", [...refused, ...failed], "No method refused this tree."), ...part("Warnings", warned, "No method warned of anything."));
}

function startRebuild() {
  const { identity } = data;
  byId("command").textContent = data.command;
  const facts = [
    ["Program", `${identity.program}, commit ${identity.commit}`], ["Source", identity.source], ["Seed", String(identity.seed)], ["Adapter, driver", identity.adapter],
    ["Changed settings", identity.settings.length ? identity.settings.join(", ") : "none: every method at its defaults"],
    ["Time and memory", budgetText()], ["Where the time went", spentText()],
    ["Levels by themselves", identity.plan.levels ? "from the first azimuth of each elevation, in the first light" : "not looked at"],
    ["Timed for", `${identity.plan.timing_ms} ms at each distance, with nothing else at work`],
    ["Good enough", `mean FLIP up to ${data.max_flip}`], ["Cheap by", cost.name.toLowerCase()],
    ["Distances", heights.map((heightPx) => `${whole(heightPx)} px (${away(treeHeights(heightPx))} heights)`).join(", ")],
    ["Elevations", elevationsDeg.map((deg) => `${deg}°`).join(", ")],
    ["Azimuths", [...new Set(views.map((view) => view.azimuth_deg))].map((deg) => `${deg}°`).join(", ")],
    ["Suns", suns.map((_, sun) => sunName(sun)).join("; ")],
    ["Pixels per degree", `${digits(data.pixels_per_degree)} (FLIP)`],
    ["Pixels of a tree", `${data.focal_px} ÷ its distance in tree heights`],
    ["Backgrounds", data.backgrounds.map((rgb) => `sRGB ${rgb.join(" ")}`).join("; ")],
  ];
  byId("identity").replaceChildren(...facts.flatMap(([name, text]) => [element("dt", {}, name), element("dd", {}, text)]));
  const parameterColumns = [{ name: "Parameter", value: ([name]) => name }, { name: "Value", text: true, value: ([, value]) => value }];
  const levels = (run) => (run.levels.length ? `Levels: ${run.levels.map(([name, distance]) => `${name} at ${digits(distance)} tree heights`).join(", ")}.` : "");
  byId("parameters").replaceChildren(...data.methods.map((run) => element("details", {}, element("summary", {}, element("b", {}, run.method), ` ${run.name}`),
    element("p", { class: "small" }, [run.citation, levels(run)].filter(Boolean).join(" ")),
    run.parameters.length ? plainTable("Effective parameters", parameterColumns, run.parameters) : element("p", { class: "small" }, "It has no parameters."))));
}

[startAnswer, startLosses, startPlots, startPhotographed, startViewer, startSheet, startMotion, startTables, startRefused, startRebuild].forEach((start) => start());
// Paper does not unfold.
window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((folded) => (folded.open = true)));
