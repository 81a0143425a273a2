// Pictures: two methods held against each other, and all of them on a sheet.

const TRUTH_PICTURES = "truth";
const shownMethods = [[TRUTH_PICTURES, "truth"], ...compared.map((run) => [run.method, run.method])];

const mode = () => document.querySelector('input[name="mode"]:checked').value;

/** What is chosen, and where its pictures are. */
function chosen() {
  const [elevationDeg, heightPx, sun] = ["pick-elevation", "pick-height", "pick-sun"].map((id) => Number(byId(id).value));
  const picture = pictureAt(elevationDeg, heightPx, sun);
  const [a, b] = ["pick-a", "pick-b"].map((id) => byId(id).value);
  const path = (method) => `${folderOf(method)}/${picture?.file ?? "none.png"}`;
  return { a, b, elevationDeg, heightPx, sun, paths: [path(a), path(b)] };
}

/** Loads both pictures; what is not there is said. */
function showPictures() {
  const { a, b, elevationDeg, heightPx, paths } = chosen();
  const missing = new Set();
  const told = () => {
    byId("viewer-missing").hidden = missing.size === 0;
    byId("viewer-missing").textContent = missing.size === 0 ? "" : `Not on disk: ${listed([...missing])}. The rest of the page does not need it.`;
  };
  told();
  [["a", a], ["b", b]].forEach(([side, method], i) => {
    const image = byId(`image-${side}`);
    byId(`frame-${side}`).classList.remove("missing");
    byId(`caption-${side}`).textContent = `${side.toUpperCase()}: ${method}`;
    image.alt = `${method} from ${elevationDeg}°, ${whole(heightPx)} px high`;
    image.onload = showDifference;
    image.onerror = () => {
      byId(`frame-${side}`).classList.add("missing");
      byId(`caption-${side}`).textContent = `${side.toUpperCase()}: ${method} is missing`;
      missing.add(paths[i]);
      told();
      showDifference();
    };
    image.src = paths[i];
  });
  showFigures();
}

/** The difference of both over the chosen background. Pixels are never read back, which a page from disk may not. */
function showDifference() {
  const [a, b] = [byId("image-a"), byId("image-b")];
  const canvas = byId("difference");
  if (![a, b].every((image) => image.complete && image.naturalWidth > 0)) {
    canvas.width = canvas.width; // empties it
    return;
  }
  [canvas.width, canvas.height] = [a.naturalWidth, a.naturalHeight];
  const over = (image) => {
    const made = element("canvas", { width: canvas.width, height: canvas.height });
    const context = made.getContext("2d");
    context.fillStyle = `rgb(${data.backgrounds[byId("dark-ground").checked ? 1 : 0].join()})`;
    context.fillRect(0, 0, made.width, made.height);
    context.drawImage(image, 0, 0, made.width, made.height);
    return made;
  };
  const context = canvas.getContext("2d");
  context.globalCompositeOperation = "copy";
  context.drawImage(over(a), 0, 0);
  context.globalCompositeOperation = "difference";
  context.drawImage(over(b), 0, 0);
}

/** Errors of both from there. */
function showFigures() {
  const { a, b, elevationDeg, heightPx } = chosen();
  // The pictures of the lowest elevation are those of a photograph's own view, where there is one.
  const own = (list) => list.some((entry) => entry.elevation_deg === elevationDeg);
  const of = (method) => (own(photographed) ? photographed : elevations).find((entry) => entry.method === method && !entry.level && entry.height_px === heightPx && entry.elevation_deg === elevationDeg);
  const found = [...new Set([a, b])].map((method) => ({ method, error: of(method)?.error })).filter((row) => row.error);
  const caption = own(photographed) ? "Errors against the photograph, from where it was taken" : `Errors from ${elevationDeg}°, mean over azimuths and suns`;
  byId("viewer-figures").replaceChildren(found.length === 0 ? "" : plainTable(caption, errorColumns, found));
}

function showMode() {
  const stage = byId("stage");
  stage.dataset.mode = mode();
  stage.dataset.shown ??= "a";
  byId("swipe-row").hidden = mode() !== "swipe";
  byId("flip-row").hidden = mode() !== "flip";
  sayShown();
}

function sayShown() {
  const { a, b } = chosen();
  byId("flip-shown").textContent = `Shown: ${byId("stage").dataset.shown === "a" ? `A, ${a}` : `B, ${b}`}`;
}

/** Shows the other one, whatever was shown before. */
function flip() {
  document.querySelector('input[name="mode"][value="flip"]').checked = true;
  byId("stage").dataset.shown = byId("stage").dataset.shown === "b" ? "a" : "b";
  showMode();
}

function startViewer() {
  const rival = compared.some((run) => run.method === data.ours) ? data.ours : compared.find((run) => run.method !== data.truth)?.method;
  choices(byId("pick-a"), shownMethods, TRUTH_PICTURES);
  choices(byId("pick-b"), shownMethods, rival ?? TRUTH_PICTURES);
  choices(byId("pick-elevation"), elevationsDeg.map((deg) => [deg, `${deg}°`]));
  choices(byId("pick-height"), heightChoices);
  choices(byId("pick-sun"), sunChoices);
  byId("viewer-choice").addEventListener("change", () => { showPictures(); sayShown(); });
  document.querySelectorAll('input[name="mode"]').forEach((input) => input.addEventListener("change", showMode));
  byId("dark-ground").addEventListener("change", () => { byId("stage").classList.toggle("dark", byId("dark-ground").checked); showDifference(); });
  byId("swipe").addEventListener("input", () => byId("stage").style.setProperty("--swipe", `${byId("swipe").value}%`));
  byId("flip").addEventListener("click", flip);
  document.addEventListener("keydown", (event) => {
    const typing = ["SELECT", "TEXTAREA"].includes(event.target.tagName) || event.target.type === "text";
    if (event.key.toLowerCase() === "f" && !typing && !event.ctrlKey && !event.metaKey && !event.altKey) flip();
  });
  showMode();
  showPictures();
}

/** Methods down, elevations across; pictures load as they come into sight. */
function showSheet() {
  const [heightPx, sun] = [Number(byId("sheet-height").value), Number(byId("sheet-sun").value)];
  const cell = (method, elevationDeg) => {
    const picture = pictureAt(elevationDeg, heightPx, sun);
    const image = element("img", { loading: "lazy", alt: `${method} from ${elevationDeg}°`, width: 144, height: 144 });
    image.onerror = () => image.replaceWith(element("span", { class: "missing" }, "not on disk"));
    image.src = `${folderOf(method)}/${picture?.file ?? "none.png"}`;
    return element("td", {}, image);
  };
  const head = element("tr", {}, element("th", { scope: "col" }, "Method"), ...elevationsDeg.map((deg) => element("th", { scope: "col", style: "text-align:center" }, `${deg}°`)));
  const line = ([method, name]) => element("tr", {}, element("th", { scope: "row" }, name), ...elevationsDeg.map((deg) => cell(method, deg)));
  const caption = `Methods by elevation, the tree ${distanceName(heightPx)}`;
  const made = element("table", { "aria-label": caption }, element("thead", {}, head), element("tbody", {}, ...shownMethods.map(line)));
  byId("sheet-table").replaceChildren(scrolling(caption, made));
}

function startSheet() {
  choices(byId("sheet-height"), heightChoices);
  choices(byId("sheet-sun"), sunChoices);
  ["sheet-height", "sheet-sun"].forEach((id) => byId(id).addEventListener("change", showSheet));
  showSheet();
}
