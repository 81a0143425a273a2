// A moment of the path: a mark in every plot and its figures beside them. Chosen by the slider, or by pointing at a plot.
const times = data.columns[0].values;
const shows = { s: (value) => `${fixed(1)(value)} s`, ms: (value) => `${fixed(value < 10 ? 2 : 1)(value)} ms`, whole, bytes };
const plots = [...document.querySelectorAll(".plot")].map((plot) => {
  const pair = (name) => plot.dataset[name].split(",").map(Number);
  return { plot, mark: plot.querySelector(".mark"), inside: pair("inside"), along: pair("along") };
});

function showMoment(at) {
  byId("moment").value = at;
  byId("moment-time").textContent = shows.s(times[at]);
  byId("moment").setAttribute("aria-valuetext", shows.s(times[at]));
  for (const { mark, inside, along } of plots) {
    const share = (times[at] - along[0]) / (along[1] - along[0] || 1);
    mark.style.left = `${100 * (inside[0] + share * (inside[1] - inside[0]))}%`;
    mark.hidden = false;
  }
  const lines = data.columns.map((column) => element("tr", {}, element("th", { scope: "row" }, column.name), element("td", {}, shows[column.show](column.values[at]))));
  byId("moment-figures").replaceChildren(element("table", { "aria-label": "Figures of the moment" }, element("tbody", {}, ...lines)));
}

/** The moment that is nearest to where a plot is pointed at. */
function pointed({ plot, inside, along }, event) {
  const box = plot.getBoundingClientRect();
  const share = ((event.clientX - box.left) / box.width - inside[0]) / (inside[1] - inside[0]);
  const time = along[0] + share * (along[1] - along[0]);
  const off = (at) => Math.abs(times[at] - time);
  return times.reduce((best, _, at) => (off(at) < off(best) ? at : best), 0);
}

if (times.length > 1) {
  byId("moment").max = times.length - 1;
  byId("moment").addEventListener("input", (event) => showMoment(Number(event.target.value)));
  for (const each of plots) {
    each.plot.addEventListener("click", (event) => showMoment(pointed(each, event)));
    each.plot.addEventListener("pointermove", (event) => event.pointerType === "mouse" && showMoment(pointed(each, event)));
  }
  byId("moment-row").hidden = false;
  // The slowest frame is what people ask for first.
  const ms = data.columns[1].values;
  showMoment(ms.indexOf(Math.max(...ms)));
}
// Paper does not unfold.
window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((folded) => (folded.open = true)));
