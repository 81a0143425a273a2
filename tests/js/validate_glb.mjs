// The Khronos glTF validator over GLB files: `node validate_glb.mjs FILE.glb...`
// Prints every message; exits 1 when any file has an error or a warning, 2 when nothing was given.
import { readFileSync } from "node:fs";
import { basename } from "node:path";
import validator from "gltf-validator";

const paths = process.argv.slice(2);
if (paths.length === 0) {
  console.error("expected GLB files, but none were given; usage: node validate_glb.mjs FILE.glb...");
  process.exit(2);
}

let faults = 0;
for (const path of paths) {
  try {
    const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(path)), { uri: basename(path), maxIssues: 20 });
    console.log(`${path}: ${issues.numErrors} errors, ${issues.numWarnings} warnings, ${issues.numInfos} infos, ${issues.numHints} hints`);
    for (const { code, message, pointer } of issues.messages) console.log(`  ${code} ${pointer ?? ""}: ${message}`);
    faults += issues.numErrors + issues.numWarnings;
  } catch (error) {
    console.log(`${path}: ${error.message ?? error}`);
    faults += 1;
  }
}
process.exit(faults > 0 ? 1 : 0);
