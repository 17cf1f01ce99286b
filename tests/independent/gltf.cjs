// Validates glTF files with the validator of the Khronos group: node gltf.cjs VALIDATOR FILE…
const [validator, ...files] = process.argv.slice(2);
for (const file of files) {
  require(validator).validateBytes(new Uint8Array(require("fs").readFileSync(file))).then(({ issues }) => {
    console.log(`gltf-validator: ${file}: ${issues.numErrors} errors, ${issues.numWarnings} warnings`);
    issues.messages.filter((message) => message.severity < 2).forEach((message) => console.log(message));
    if (issues.numErrors + issues.numWarnings > 0) process.exitCode = 1;
  });
}
