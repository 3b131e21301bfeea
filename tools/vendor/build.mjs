// Bundle the page's libraries: one minified ES module each, in visualhfsm/_editor/static/vendor/.
// Run by `make vendor`. The same lock file gives the same bytes.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { copyFile, mkdir, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const shipped = join(here, "../../visualhfsm/_editor/static/vendor");

// Not styleMap: it writes the attribute `style`, which the page's content security policy forbids.
const litDirectives = {
  "async-directive": ["AsyncDirective"],
  "directive": ["Directive", "PartType", "directive"],
  "directives/cache": ["cache"],
  "directives/class-map": ["classMap"],
  "directives/guard": ["guard"],
  "directives/if-defined": ["ifDefined"],
  "directives/keyed": ["keyed"],
  "directives/live": ["live"],
  "directives/ref": ["createRef", "ref"],
  "directives/repeat": ["repeat"],
  "directives/until": ["until"],
  "directives/when": ["when"],
};

// What each bundle exports; the page imports it by the key, through the import map.
const bundles = {
  lit: [
    "export * from 'lit';",
    ...Object.entries(litDirectives).map(([path, names]) => `export { ${names} } from 'lit/${path}.js';`),
  ],
  codemirror: [
    "export { basicSetup, minimalSetup } from 'codemirror';",
    ...["autocomplete", "commands", "language", "lint", "search", "state", "theme-one-dark", "view"].map(
      (name) => `export * from '@codemirror/${name}';`),
    "export { python, pythonLanguage, globalCompletion, localCompletionSource } from '@codemirror/lang-python';",
    "export { tags } from '@lezer/highlight';",
  ],
  uplot: ["export { default } from 'uplot';"],
  dagre: ["export * from '@dagrejs/dagre';"],
  three: [
    "export * from 'three';",
    "export { OrbitControls } from 'three/addons/controls/OrbitControls.js';",
  ],
};

/** The directory of the package that a bundled file belongs to, below node_modules/. */
function packageOf(input) {
  const parts = input.slice(input.lastIndexOf("node_modules/") + "node_modules/".length).split("/");
  return parts.slice(0, parts[0].startsWith("@") ? 2 : 1).join("/");
}

/** The text of a package's licence. */
async function licenceOf(name) {
  const directory = join(here, "node_modules", name);
  const file = (await readdir(directory)).find((entry) => /^licen[cs]e(\.|$)/i.test(entry));
  if (!file) throw new Error(`${name} has no licence file`);
  return (await readFile(join(directory, file), "utf8")).replaceAll("\r\n", "\n").trim();
}

const locked = JSON.parse(await readFile(join(here, "package-lock.json"), "utf8")).packages;
const report = { bundles: {}, packages: {} };

/** Enter a file of the folder into the report, with what is in it. */
async function enter(file, names) {
  const sha256 = createHash("sha256").update(await readFile(join(shipped, file))).digest("hex");
  report.bundles[file] = { sha256, packages: [...names].sort() };
  for (const name of names) {
    const { version, license, integrity } = locked[`node_modules/${name}`];
    report.packages[name] = { version, license, integrity };
  }
}

await rm(shipped, { recursive: true, force: true });
await mkdir(shipped, { recursive: true });
for (const [name, exports] of Object.entries(bundles)) {
  const { metafile } = await build({
    stdin: { contents: exports.join("\n"), resolveDir: here, sourcefile: `${name}.js` },
    outfile: join(shipped, `${name}.js`),
    absWorkingDir: here,
    bundle: true,
    charset: "utf8",
    format: "esm",
    legalComments: "none", // they stand whole in LICENSES.txt
    metafile: true,
    minify: true,
    target: "es2022",
    banner: { js: `/* ${name}: made by tools/vendor/build.mjs; licences in LICENSES.txt */` },
  });
  const inputs = Object.keys(metafile.inputs).filter((input) => input.includes("node_modules/"));
  await enter(`${name}.js`, new Set(inputs.map(packageOf)));
}
await copyFile(join(here, "node_modules/uplot/dist/uPlot.min.css"), join(shipped, "uplot.css"));
await enter("uplot.css", ["uplot"]);

report.packages = Object.fromEntries(Object.entries(report.packages).sort());
await writeFile(join(shipped, "packages.json"), JSON.stringify(report, null, 2) + "\n");
const licences = await Promise.all(Object.entries(report.packages).map(
  async ([name, { version, license }]) => `${name} ${version} (${license})\n\n${await licenceOf(name)}\n`));
await writeFile(join(shipped, "LICENSES.txt"),
  "The bundles in this folder hold these packages (made by tools/vendor/build.mjs).\n\n" +
  licences.join(`\n${"-".repeat(100)}\n\n`));
