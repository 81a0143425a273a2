// The page of the papers in headless Chromium, from disk: `node papers_page.mjs DIR [SHOTS]`, DIR as `sphereboard compare --profile papers
// --out` left it. Screenshots go to the folder SHOTS. Exits 1 when something is wrong, 3 when there is no Chromium.
import { existsSync, mkdirSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [folder, shots] = process.argv.slice(2);
if (!folder) {
  console.error("expected a comparison's folder, but none was given; usage: node papers_page.mjs DIR [SHOTS]");
  process.exit(2);
}
const candidates = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
const executablePath = candidates.find((path) => path && existsSync(path));
if (!executablePath) {
  console.error("SKIPPED: there is no Chromium; install Debian's package chromium, or name another with CHROMIUM=path");
  process.exit(3);
}
const data = JSON.parse(readFileSync(join(folder, "papers.json"), "utf8"));
const address = pathToFileURL(join(resolve(folder), "papers.html")).href;

let faults = 0;
function expect(holds, what) {
  console.log(`${holds ? "ok" : "WRONG"}: ${what}`);
  if (!holds) faults += 1;
}

const looks = [
  ["desktop", { viewport: { width: 1280, height: 900 } }],
  ["dark", { viewport: { width: 1280, height: 900 }, colorScheme: "dark" }],
  ["phone", { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true }],
];
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
for (const [name, options] of looks) {
  const page = await (await browser.newContext({ ...options, javaScriptEnabled: true })).newPage();
  const complaints = [];
  const foreign = [];
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && complaints.push(message.text()));
  page.on("request", (request) => /^(file|data):/.test(request.url()) || foreign.push(request.url()));
  await page.goto(address);
  await page.evaluate(() => document.querySelectorAll("img").forEach((image) => (image.loading = "eager")));
  await page.waitForLoadState("networkidle");
  const found = await page.evaluate(() => ({
    sections: document.querySelectorAll("main > section").length,
    missing: [...document.images].filter((image) => !image.naturalWidth).map((image) => image.src),
    unnamed: [...document.images].filter((image) => !image.alt).length,
    wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    dead: [...document.querySelectorAll("nav a")].filter((link) => !document.querySelector(link.getAttribute("href"))).length,
  }));
  expect(complaints.length === 0 && foreign.length === 0, `${name}: no complaint, nothing fetched ${[...complaints, ...foreign].join(" ")}`);
  expect(found.sections === data.exhibits.length + 1, `${name}: ${found.sections} sections`);
  expect(found.missing.length === 0 && found.unnamed === 0, `${name}: every picture is there and has words ${found.missing.join(" ")}`);
  expect(found.wide <= 0 && found.dead === 0, `${name}: nothing wider than the screen (${found.wide} px), every link leads somewhere`);
  if (shots) {
    mkdirSync(shots, { recursive: true });
    await page.screenshot({ path: join(shots, `papers-${name}.png`), fullPage: true });
    if (name === "desktop") await page.pdf({ path: join(shots, "papers.pdf"), format: "A4" });
  }
}
await browser.close();
process.exit(faults ? 1 : 0);
