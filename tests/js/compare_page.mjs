// The report page of a comparison in headless Chromium, from disk: `node compare_page.mjs DIR [SHOTS]`, DIR as `sphereboard compare --out`
// left it, with two methods at least. Screenshots go to the folder SHOTS. DIR is as before when this ends.
// Exits 1 when something is wrong, 3 when there is no Chromium.
import { readFileSync, renameSync, rmSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { LOOKS, end, expect, expectQuiet, expectSound, given, keep, launch, open } from "./browser.mjs";

const [folder, shots] = given("compare_page.mjs DIR [SHOTS]");
const browser = await launch();
const data = JSON.parse(readFileSync(join(folder, "report.json"), "utf8"));
const address = pathToFileURL(join(resolve(folder), "report.html")).href;

async function whole() {
  const { page, heard } = await open(browser, address);
  const compared = data.methods.filter((run) => run.rows.length > 0);
  expect((await page.locator("#pareto-plots svg").count()) === 2 * data.identity.plan.heights_px.length, "plots of error against bytes and milliseconds for each distance");
  const names = await page.locator("#costs-table tbody th").allTextContents();
  expect(compared.every((run) => names.some((name) => name.startsWith(run.method))), "every method is in the table of costs");
  expect((await page.locator("#loss-lead").textContent()).length > 40, "it is said where the sphere-board loses");

  const ids = await page.locator("main > section").evaluateAll((sections) => sections.map((section) => section.id));
  expect(ids.join(" ") === "answer pareto elevation viewer sheet motion costs refused rebuild", `its parts are in order: ${ids.join(" ")}`);
  const strips = page.locator("#motion-strips .motion");
  expect((await strips.count()) === 1 + compared.length, "the truth and every method have their strips of motion");
  for (const image of await page.locator("#motion-strips img").all()) await image.evaluate((made) => (made.loading = "eager"));
  await page.waitForFunction(() => [...document.querySelectorAll("#motion-strips img")].every((image) => image.complete));
  expect((await page.locator("#motion-strips .missing").count()) === 0, "no strip is missing");
  const facts = await page.locator("#identity").textContent();
  const told = ["Seed", "Adapter, driver", "commit", "Time and memory", "Backgrounds", data.identity.adapter, String(data.identity.seed)];
  expect(told.every((word) => facts.includes(word)), "seed, adapter, driver, commit, time and memory are told");
  expect((await page.locator("#command").textContent()).startsWith("sphereboard compare"), "and how to make the page again");

  const clip = () => page.locator("#frame-b").evaluate((frame) => getComputedStyle(frame).clipPath);
  const before = await clip();
  await page.locator("#swipe").focus();
  for (let i = 0; i < 20; i += 1) await page.keyboard.press("ArrowRight");
  expect(before.includes("50%") && (await clip()).includes("70%"), "the swipe moves by keyboard");

  const shown = () => page.locator("#stage").evaluate((stage) => [stage.dataset.mode, stage.dataset.shown].join(" "));
  await page.keyboard.press("f");
  const first = await shown();
  await page.keyboard.press("f");
  expect(first === "flip b" && (await shown()) === "flip a", "the key F flips");

  await page.locator('input[value="difference"]').check();
  const [truth, other] = [compared[0].method, compared[1].method];
  await page.locator("#pick-b").selectOption(other);
  await page.waitForFunction(() => document.getElementById("difference").width > 16);
  // A page from disk may not read its pictures' pixels back, a screenshot may show them.
  const brightest = async () => {
    const picture = (await page.locator("#difference").screenshot()).toString("base64");
    return page.evaluate(async (address) => {
      const image = Object.assign(new Image(), { src: address });
      await image.decode();
      const canvas = Object.assign(document.createElement("canvas"), { width: image.width, height: image.height });
      canvas.getContext("2d").drawImage(image, 0, 0);
      // The caption lies over the lower part; at the edge there may be a line of the page.
      return canvas.getContext("2d").getImageData(2, 2, image.width - 4, image.height >> 1).data.reduce((most, value, i) => (i % 4 < 3 ? Math.max(most, value) : most), 0);
    }, `data:image/png;base64,${picture}`);
  };
  /** Pictures take their time to load. */
  const soon = async (holds) => {
    for (let i = 0; i < 40; i += 1) {
      if (holds(await brightest())) return true;
      await page.waitForTimeout(100);
    }
    return false;
  };
  const unlike = await soon((most) => most > 16);
  await page.locator("#pick-b").selectOption("truth");
  expect(unlike && (await soon((most) => most < 8)), "a method differs from the truth, the truth does not differ from itself");

  const sorted = page.locator("#costs-table th", { hasText: "triangles" });
  const column = () => page.locator("#costs-table tbody tr").evaluateAll((lines) => lines.map((line) => Number(line.children[3].textContent.replaceAll(",", ""))));
  const ordered = (values, sign) => values.every((value, i) => i === 0 || sign * (value - values[i - 1]) >= 0);
  await sorted.locator("button").click();
  expect(ordered(await column(), 1) && (await sorted.getAttribute("aria-sort")) === "ascending", "a click sorts");
  await sorted.locator("button").focus();
  await page.keyboard.press("Enter");
  expect(ordered(await column(), -1) && (await sorted.getAttribute("aria-sort")) === "descending", "a key turns the order round");

  const chip = page.locator(`#chips button[data-method="${truth}"]`);
  const pressed = await chip.getAttribute("aria-pressed");
  await chip.click();
  expect((await chip.getAttribute("aria-pressed")) !== pressed, "a method takes a colour or loses it");
  expectQuiet(heard, "the whole page");
}

async function withoutPicture() {
  const { method } = data.methods.find((run) => run.rows.length > 0 && run.method !== data.truth);
  const [gone, kept] = ["", ".away"].map((end) => join(folder, "pictures", method, data.pictures[0].file + end));
  renameSync(gone, kept);
  try {
    const { page, heard } = await open(browser, address);
    const { elevation_deg, height_px, sun } = data.pictures[0];
    await page.locator("#pick-elevation").selectOption(String(elevation_deg));
    await page.locator("#pick-height").selectOption(String(height_px));
    await page.locator("#pick-sun").selectOption(String(sun));
    await page.locator("#pick-b").selectOption(method);
    await page.waitForSelector("#viewer-missing:not([hidden])", { timeout: 5000 });
    expect((await page.locator("#viewer-missing").textContent()).includes(data.pictures[0].file), "a picture that is missing is named");
    await page.locator("#sheet").scrollIntoViewIfNeeded();
    await page.waitForSelector("#sheet-table .missing", { timeout: 5000 });
    expect((await page.locator("#costs-table tbody tr").count()) > 1, "the rest of the page stands");
    const thrown = heard.complaints.filter((text) => !text.includes("ERR_FILE_NOT_FOUND"));
    expect(thrown.length === 0, `nothing but the missing file is complained of ${thrown.join("; ")}`);
  } finally {
    renameSync(kept, gone);
  }
}

/** A method that failed at a distance: told in its row, no point of any plot. */
async function withFailure() {
  const beside = join(resolve(folder), "report-failed.html");
  const failed = structuredClone(data);
  const run = failed.methods.find((other) => other.rows.length > 0 && other.method !== data.truth);
  const words = "3 of 12 pictures: as tests asked for";
  const [row] = run.rows;
  row.failed = words;
  const page = readFileSync(join(folder, "report.html"), "utf8");
  const [begin, rest] = page.split('<script type="application/json" id="data">');
  const mark = "</script>";
  const text = JSON.stringify(failed).replaceAll("<", "\\u003c");
  writeFileSync(beside, `${begin}<script type="application/json" id="data">${text}${rest.slice(rest.indexOf(mark))}`);
  try {
    const { page: shown, heard } = await open(browser, pathToFileURL(beside).href);
    await shown.locator("#costs-height").selectOption(String(row.height_px));
    for (const table of ["costs-table", "errors-table"]) {
      const line = shown.locator(`#${table} tbody tr`, { hasText: words });
      expect((await line.count()) === 1 && (await line.locator("th").textContent()).startsWith(run.method), `${table}: a failure is told in its row`);
      expect((await shown.locator(`#${table} tbody tr`).last().textContent()).includes(words), `${table}: and comes last`);
    }
    expect((await shown.locator("#refused-list").textContent()).includes(words), "a failure is listed");
    expectQuiet(heard, "a failure");
  } finally {
    rmSync(beside);
  }
}

/** Nothing is wider than the screen, in any dress; screenshots are to be looked at. */
async function dresses() {
  for (const name of ["desktop", "dark", "phone"]) {
    const { page } = await open(browser, address, LOOKS[name]);
    await expectSound(page, name);
    await keep(page, shots, name, name === "desktop" && "print");
  }
}

await whole();
await withoutPicture();
await withFailure();
await dresses();
await end(browser);
