// three.js draws GLB files in headless Chromium: `node draw_glb.mjs SHOTS.json`, which `sphereboard-tools bake-methods` and tests/grove_export.rs write.
// Each file's default scene is drawn as three.js loads it, over nothing, and saved as NAME.three.png beside the GLB.
// Exits 1 when a file cannot be drawn, 3 when there is no Chromium.
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, extname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { end, expect, given, launch } from "./browser.mjs";

const [list] = given("draw_glb.mjs SHOTS.json");
// Nothing is fetched: what the page asks of this name comes from node_modules and from the folder of the shots.
const origin = "http://shots.invalid";
const folder = dirname(resolve(list));
const three = join(dirname(fileURLToPath(import.meta.url)), "node_modules/three");
const types = { ".js": "text/javascript", ".glb": "model/gltf-binary", ".html": "text/html" };
const page_html = `<!doctype html><canvas id="canvas"></canvas>
<script type="importmap">{"imports": {"three": "${origin}/three/build/three.module.js", "three/addons/": "${origin}/three/examples/jsm/"}}</script>
<script type="module">
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
window.draw = async (url, { size_px: [width, height], target, distance_m, fov_deg, eye, hide = [] }) => {
  const renderer = new THREE.WebGLRenderer({ canvas: document.getElementById("canvas"), alpha: true, preserveDrawingBuffer: true });
  renderer.setSize(width, height, false);
  renderer.setClearColor(0, 0);
  const { scene, userData } = await new GLTFLoader().loadAsync(url);
  const sun = new THREE.DirectionalLight(0xffffff, 3);
  sun.position.set(1, 2, 3);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x606050, 2), sun);
  const camera = new THREE.PerspectiveCamera(fov_deg, width / height, distance_m / 100, distance_m * 100);
  camera.position.set(...(eye ?? [target[0], target[1], target[2] + distance_m]));
  if (eye) camera.lookAt(...target);
  for (const name of hide) scene.getObjectByName(name).visible = false;
  renderer.render(scene, camera);
  let triangles = renderer.info.render.triangles;
  return { picture: renderer.domElement.toDataURL("image/png"), triangles, method: userData.sphereboard?.method };
};
window.ready = true;
</script>`;

const browser = await launch(["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]);
for (const shot of JSON.parse(readFileSync(list, "utf8")).shots) {
  // A page of its own for each: nothing is left of the one before.
  const page = await browser.newPage();
  page.on("pageerror", (error) => console.error(`${shot.name}: ${error.message}`));
  await page.route("**/*", (route) => {
    const path = decodeURIComponent(new URL(route.request().url()).pathname);
    if (path === "/") return route.fulfill({ contentType: types[".html"], body: page_html });
    const file = path.startsWith("/three/") ? join(three, path.slice(7)) : join(folder, path.slice(1));
    if (!existsSync(file)) return route.fulfill({ status: 404 });
    return route.fulfill({ contentType: types[extname(file)] ?? "application/octet-stream", body: readFileSync(file) });
  });
  try {
    await page.goto(`${origin}/`);
    await page.waitForFunction(() => window.ready, undefined, { timeout: 60_000 });
    const { picture, triangles } = await page.evaluate(([url, shot]) => window.draw(url, shot), [`${origin}/${shot.name}.glb`, shot]);
    writeFileSync(join(folder, `${shot.name}.three.png`), Buffer.from(picture.split(",")[1], "base64"));
    console.log(`${shot.name}: ${triangles} triangles drawn by three.js`);
  } catch (error) {
    expect(false, `${shot.name}: three.js could not draw it: ${error.message ?? error}`);
  }
  await page.close();
}
await end(browser);
