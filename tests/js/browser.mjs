// What every page's test needs of headless Chromium: finding it, opening a page from disk and hearing what it complains of or asks for,
// the looks a page is seen in, and what holds for every page.
import { existsSync, mkdirSync } from "node:fs";
import { join } from "node:path";
import { chromium } from "playwright-core";

/** The arguments of a test; ends the program with 2 where the first is missing. */
export function given(usage) {
  const all = process.argv.slice(2);
  if (!all[0]) {
    console.error(`an argument is missing; usage: node ${usage}`);
    process.exit(2);
  }
  return all;
}

/** Headless Chromium; ends the program with 3 where there is none. */
export async function launch(args = []) {
  const candidates = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
  const executablePath = candidates.find((path) => path && existsSync(path));
  if (!executablePath) {
    console.error("SKIPPED: there is no Chromium; install Debian's package chromium, or name another with CHROMIUM=path");
    process.exit(3);
  }
  return chromium.launch({ executablePath, args: ["--no-sandbox", ...args] });
}

let faults = 0;

/** Says whether it holds, and remembers if not. */
export function expect(holds, what) {
  console.log(`${holds ? "ok" : "WRONG"}: ${what}`);
  if (!holds) faults += 1;
}

/** Ends the program: 1 when anything did not hold. */
export async function end(browser) {
  await browser.close();
  process.exit(faults > 0 ? 1 : 0);
}

const wide = { viewport: { width: 1280, height: 900 } };

/** How a page is looked at, by name. */
export const LOOKS = {
  desktop: wide,
  dark: { ...wide, colorScheme: "dark" },
  phone: { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true },
  scriptless: { ...wide, javaScriptEnabled: false },
};

/** Opens a page, and hears everything that it complains of or asks for. */
export async function open(browser, address, options = LOOKS.desktop) {
  const page = await (await browser.newContext(options)).newPage();
  const heard = { complaints: [], foreign: [] };
  page.on("pageerror", (error) => heard.complaints.push(error.message));
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && heard.complaints.push(message.text()));
  page.on("request", (request) => /^(file|data):/.test(request.url()) || heard.foreign.push(request.url()));
  await page.goto(address);
  await page.waitForLoadState("load");
  return { page, heard };
}

/** Nothing was complained of, nothing fetched. */
export function expectQuiet({ complaints, foreign }, name) {
  expect(complaints.length === 0 && foreign.length === 0, `${name}: no complaint, nothing fetched ${[...complaints, ...foreign].join(" ")}`);
}

/** Every picture is there and has words, nothing is wider than the screen, every link of the contents leads somewhere. */
export async function expectSound(page, name) {
  await page.evaluate(() => document.querySelectorAll("img").forEach((image) => (image.loading = "eager")));
  await page.waitForLoadState("networkidle");
  const found = await page.evaluate(() => ({
    missing: [...document.images].filter((image) => !image.naturalWidth).map((image) => image.src),
    unnamed: [...document.images].filter((image) => !image.alt).length,
    wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    dead: [...document.querySelectorAll("nav a")].filter((link) => !document.querySelector(link.getAttribute("href"))).length,
  }));
  expect(found.missing.length === 0 && found.unnamed === 0, `${name}: every picture is there and has words ${found.missing.join(" ")}`);
  expect(found.wide <= 0 && found.dead === 0, `${name}: nothing wider than the screen (${found.wide} px), every link leads somewhere`);
}

/** Keeps the whole page as a picture, and as it is printed, in a folder if there is one. */
export async function keep(page, folder, name, print) {
  if (!folder) return;
  mkdirSync(folder, { recursive: true });
  await page.evaluate(() => window.scrollTo(0, 0));
  await page.screenshot({ path: join(folder, `${name}.png`), fullPage: true });
  if (print) await page.pdf({ path: join(folder, `${print}.pdf`), format: "A4" });
}
