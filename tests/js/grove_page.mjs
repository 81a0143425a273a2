// The page of a grove in headless Chromium, from disk: `node grove_page.mjs DIR [SHOTS]`, DIR as `sphereboard grove --out` left it.
// Screenshots go to the folder SHOTS. Exits 1 when something is wrong, 3 when there is no Chromium.
import { existsSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { LOOKS, end, expect, expectQuiet, expectSound, given, keep, launch, open } from "./browser.mjs";

const [folder, shots] = given("grove_page.mjs DIR [SHOTS]");
const browser = await launch();
const summary = JSON.parse(readFileSync(join(folder, "summary.json"), "utf8"));
const address = pathToFileURL(join(resolve(folder), "report.html")).href;

for (const [name, options] of Object.entries(LOOKS)) {
  const { page, heard } = await open(browser, address, options);
  for (const folded = page.locator("details:not([open]) > summary"); (await folded.count()) > 0; ) await folded.first().click();
  // Without scripts nothing but scrolling makes a picture load.
  for (const image of await page.locator("img").all()) await image.scrollIntoViewIfNeeded();
  await expectSound(page, name);
  const plots = await page.locator(".plot svg").evaluateAll((all) => all.filter((svg) => svg.getBoundingClientRect().height > 100).length);
  expect(plots === 4, `${name}: ${plots} plots`);
  expectQuiet(heard, name);
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
  await keep(page, shots, `grove-${name}`, name === "desktop" && "grove");
}
await end(browser);
