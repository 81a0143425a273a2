// The Khronos validator's verdict on GLB files: node validate_glb.mjs FILE... Exit code 1 when any has an error or a warning.
import { readFile } from "node:fs/promises";
import validator from "gltf-validator";

const files = process.argv.slice(2);
let good = 0;
for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(await readFile(file)), { uri: file, maxIssues: 20 });
  const { numErrors, numWarnings, messages } = report.issues;
  if (numErrors + numWarnings === 0) good += 1;
  for (const { code, message, pointer, severity } of messages) {
    if (severity <= 1) console.error(`${file}: ${code} at ${pointer ?? "?"}: ${message}`);
  }
}
console.log(`Khronos validator: ${good} of ${files.length} files without errors and warnings`);
process.exit(good === files.length && files.length > 0 ? 0 : 1);
