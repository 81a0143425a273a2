// The page of a grove in headless Chromium, from disk: `node grove_page.mjs DIR [SHOTS]`, DIR as `sphereboard grove --out` left it.
// Screenshots go to the folder SHOTS. Exits 1 when something is wrong, 3 when there is no Chromium.
import { existsSync, mkdirSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [folder, shots] = process.argv.slice(2);
if (!folder) {
  console.error("expected a grove's folder, but none was given; usage: node grove_page.mjs DIR [SHOTS]");
  process.exit(2);
}
const candidates = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
const executablePath = candidates.find((path) => path && existsSync(path));
if (!executablePath) {
  console.error("SKIPPED: there is no Chromium; install Debian's package chromium, or name another with CHROMIUM=path");
  process.exit(3);
}
const summary = JSON.parse(readFileSync(join(folder, "summary.json"), "utf8"));
const address = pathToFileURL(join(resolve(folder), "report.html")).href;

let faults = 0;
function expect(holds, what) {
  console.log(`${holds ? "ok" : "WRONG"}: ${what}`);
  if (!holds) faults += 1;
}

const looks = [
  ["desktop", { viewport: { width: 1280, height: 900 } }],
  ["dark", { viewport: { width: 1280, height: 900 }, colorScheme: "dark" }],
  ["phone", { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true }],
  ["scriptless", { viewport: { width: 1280, height: 900 }, javaScriptEnabled: false }],
];
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
for (const [name, options] of looks) {
  const page = await (await browser.newContext(options)).newPage();
  const complaints = [];
  const foreign = [];
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && complaints.push(message.text()));
  page.on("request", (request) => /^(file|data):/.test(request.url()) || foreign.push(request.url()));
  await page.goto(address);
  for (const folded = page.locator("details:not([open]) > summary"); (await folded.count()) > 0; ) await folded.first().click();
  for (const image of await page.locator("img").all()) await image.scrollIntoViewIfNeeded();
  await page.waitForLoadState("networkidle");
  const found = await page.evaluate(() => ({
    missing: [...document.images].filter((image) => !image.naturalWidth).map((image) => image.src),
    unnamed: [...document.images].filter((image) => !image.alt).length,
    wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    dead: [...document.querySelectorAll("nav a")].filter((link) => !document.querySelector(link.getAttribute("href"))).length,
    plots: [...document.querySelectorAll(".plot svg")].filter((svg) => svg.getBoundingClientRect().height > 100).length,
  }));
  expect(complaints.length === 0 && foreign.length === 0, `${name}: no complaint, nothing fetched ${[...complaints, ...foreign].join(" ")}`);
  expect(found.missing.length === 0 && found.unnamed === 0, `${name}: every picture is there and has words ${found.missing.join(" ")}`);
  expect(found.wide <= 0 && found.dead === 0, `${name}: nothing wider than the screen (${found.wide} px), every link leads somewhere`);
  expect(found.plots === 4, `${name}: ${found.plots} plots`);
  const files = await page.locator('a[href$=".svg"], a[href$=".csv"], a[href$=".json"]').evaluateAll((links) => links.map((link) => link.getAttribute("href")));
  expect(files.length === 6 && files.every((file) => existsSync(join(folder, file))), `${name}: files beside the page are there: ${files.join(" ")}`);
  const facts = await page.locator("#rebuild").textContent();
  const told = [summary.command, summary.adapter, summary.commit, summary.program];
  expect(told.every((word) => facts.includes(word)), `${name}: command, adapter, commit and program are told`);
  if (options.javaScriptEnabled !== false && summary.frames > 1) {
    const mark = () => page.locator(".mark").first().evaluate((line) => parseFloat(line.style.left));
    await page.locator("#moment").focus();
    await page.keyboard.press("Home");
    const first = await mark();
    await page.keyboard.press("End");
    expect(first < 20 && (await mark()) > 90, `${name}: the mark moves by keyboard`);
    expect((await page.locator("#moment-figures tr").count()) > 6, `${name}: the moment's figures are told`);
  }
  await page.evaluate(() => window.scrollTo(0, 0));
  if (shots) {
    mkdirSync(shots, { recursive: true });
    await page.screenshot({ path: join(shots, `grove-${name}.png`), fullPage: true });
    if (name === "desktop") await page.pdf({ path: join(shots, "grove.pdf"), format: "A4" });
  }
}
await browser.close();
process.exit(faults ? 1 : 0);
