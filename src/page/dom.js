// What the scripts of all pages share: the data, elements, numbers as words. Nothing here fetches anything.
const data = JSON.parse(document.getElementById("data").textContent);

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

/** A list of words as people write it. */
function listed(words) {
  return words.length < 2 ? words.join("") : `${words.slice(0, -1).join(", ")} and ${words.at(-1)}`;
}

/** Fills a select with [value, text] pairs. */
function choices(select, pairs, chosen) {
  select.replaceChildren(...pairs.map(([value, text]) => element("option", { value }, text)));
  if (chosen !== undefined) select.value = chosen;
}

/** What scrolls sideways must be reached by keyboard. */
const scrolling = (name, child) => element("div", {},
  element("p", { class: "small caption" }, name), element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": name }, child));
