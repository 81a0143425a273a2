// The data, and what all parts of the page share. Nothing here fetches anything.
const data = JSON.parse(document.getElementById("data").textContent);
const { columns, pictures } = data;
/** What was held against a photograph stands for itself. */
const elevations = data.elevations.filter((entry) => !entry.photographed);
const photographed = data.elevations.filter((entry) => entry.photographed);
const { views, suns } = data.identity.plan;
const heights = [...new Set(data.identity.plan.heights_px)].sort((a, b) => b - a);
const elevationsDeg = [...new Set(views.map((view) => view.elevation_deg))].sort((a, b) => a - b);
const compared = data.methods.filter((run) => run.rows.length > 0);
const rows = compared.flatMap((run) => run.rows);

const byId = (id) => document.getElementById(id);

/** An element with attributes (`on…` are listeners) and children. */
function element(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

/** The same of SVG, in the name space that the page's own parser knows. */
function drawn(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(byId("svg-space").namespaceURI, tag), attributes, children);
}

function fill(made, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value !== null && value !== undefined && value !== false) made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

const number = (value) => typeof value === "number" && Number.isFinite(value);

/** Three digits that matter. */
function digits(value) {
  if (!number(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 100) return Math.round(value).toLocaleString("en");
  return size < 0.001 ? value.toExponential(1) : String(Number(value.toPrecision(3)));
}

/** Errors all have as many places, so that columns of them can be read downwards. */
const fixed = (places) => (value) => (number(value) ? value.toFixed(places) : "–");
const whole = (value) => (number(value) ? Math.round(value).toLocaleString("en") : "–");

function bytes(value) {
  if (!number(value)) return "–";
  const step = value >= 1e6 ? [1e6, "MB"] : value >= 1e3 ? [1e3, "kB"] : [1, "B"];
  return `${digits(value / step[0])} ${step[1]}`;
}

const costs = {
  ms: { name: "Milliseconds for one tree", short: "milliseconds", of: (cost) => cost.ms, show: (value) => `${digits(value)} ms` },
  bytes: { name: "Bytes of textures and geometry", short: "bytes", of: (cost) => cost.texture_bytes + cost.geometry_bytes, show: bytes },
  triangles: { name: "Triangles", short: "triangles", of: (cost) => cost.triangles, show: (value) => `${whole(value)} triangles` },
};

const errorOf = (error, id) => (number(error?.[id]) ? Math.abs(error[id]) : NaN);
const columnOf = (id) => columns.find((column) => column.id === id);
const titleOf = (column) => (column.unit ? `${column.name} (${column.unit})` : column.name);
const errorPlaces = (id) => (["hausdorff_px", "delta_e", "depth_pct"].includes(id) ? fixed(1) : fixed(3));

const treeHeights = (heightPx) => data.focal_px / heightPx;
const away = (distance) => `${Number(distance.toPrecision(2))}`;
const distanceName = (heightPx) => `${whole(heightPx)} px high, ${away(treeHeights(heightPx))} tree heights away`;
const sunName = (sun) => `${suns[sun].elevation_deg}° high, azimuth ${suns[sun].azimuth_deg}°`;
const methodName = (method, level) => (level ? `${method}, level ${level}` : method === data.truth ? `${method} (the tree itself)` : method);

/** A list of words as people write it. */
function listed(words) {
  return words.length < 2 ? words.join("") : `${words.slice(0, -1).join(", ")} and ${words.at(-1)}`;
}

/** Fills a select with [value, text] pairs. */
function choices(select, pairs, chosen) {
  select.replaceChildren(...pairs.map(([value, text]) => element("option", { value }, text)));
  if (chosen !== undefined) select.value = chosen;
}

const heightChoices = heights.map((heightPx) => [heightPx, distanceName(heightPx)]);
const sunChoices = suns.map((_, sun) => [sun, sunName(sun)]);
const errorChoices = columns.map((column) => [column.id, titleOf(column)]);

const folderOf = (method) => `pictures/${encodeURIComponent(method)}`;
const pictureAt = (elevationDeg, heightPx, sun) =>
  pictures.find((picture) => picture.elevation_deg === elevationDeg && picture.height_px === heightPx && picture.sun === sun);

/** What scrolls sideways must be reached by keyboard. */
const scrolling = (name, child) => element("div", {},
  element("p", { class: "small caption" }, name), element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": name }, child));
