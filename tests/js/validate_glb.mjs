// The Khronos glTF validator over GLB files: `node validate_glb.mjs FILE.glb...`
// Prints every message; exits 1 when any file has an error, a warning or an information, 2 when nothing was given.
import { readFileSync } from "node:fs";
import { basename } from "node:path";
import validator from "gltf-validator";

const paths = process.argv.slice(2);
if (paths.length === 0) {
  console.error("expected GLB files, but none were given; usage: node validate_glb.mjs FILE.glb...");
  process.exit(2);
}

// What the validator says of sound files: textures of other sizes than powers of two, which have repeated and had smaller sizes
// everywhere since WebGL 2; and that it knows nothing of the extensions that we use, so that what only these point at seems unused. Those
// accessors are checked by src/grove/export_tests.rs.
const extensions = ["'MSFT_lod'", "'EXT_mesh_gpu_instancing'"];
const isKnown = ({ code, message, pointer }) =>
  code === "IMAGE_NPOT_DIMENSIONS" ||
  (code === "UNSUPPORTED_EXTENSION" && extensions.some((name) => message.includes(name))) ||
  (code === "UNUSED_OBJECT" && pointer.startsWith("/accessors/"));

let faults = 0;
for (const path of paths) {
  try {
    const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(path)), { uri: basename(path), maxIssues: 0 });
    const messages = issues.messages.filter((message) => !isKnown(message));
    const count = (severity) => messages.filter((message) => message.severity === severity).length;
    console.log(`${path}: ${count(0)} errors, ${count(1)} warnings, ${count(2)} infos, ${count(3)} hints`);
    for (const { code, message, pointer } of messages.slice(0, 20)) console.log(`  ${code} ${pointer ?? ""}: ${message}`);
    faults += count(0) + count(1) + count(2);
  } catch (error) {
    console.log(`${path}: ${error.message ?? error}`);
    faults += 1;
  }
}
process.exit(faults > 0 ? 1 : 0);
