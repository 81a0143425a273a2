// The page of the papers in headless Chromium, from disk: `node papers_page.mjs DIR [SHOTS]`, DIR as `sphereboard compare --profile papers
// --out` left it. Screenshots go to the folder SHOTS. Exits 1 when something is wrong, 3 when there is no Chromium.
import { readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { LOOKS, end, expect, expectQuiet, expectSound, given, keep, launch, open } from "./browser.mjs";

const [folder, shots] = given("papers_page.mjs DIR [SHOTS]");
const browser = await launch();
const data = JSON.parse(readFileSync(join(folder, "papers.json"), "utf8"));
const address = pathToFileURL(join(resolve(folder), "papers.html")).href;

for (const name of ["desktop", "dark", "phone"]) {
  const { page, heard } = await open(browser, address, LOOKS[name]);
  await expectSound(page, name);
  const sections = await page.locator("main > section").count();
  expect(sections === data.exhibits.length + 1, `${name}: ${sections} sections`);
  expectQuiet(heard, name);
  await keep(page, shots, `papers-${name}`, name === "desktop" && "papers");
}
await end(browser);
