// Bundles three.js, uPlot and gifenc into the package's data: one script, one style sheet, one licence text.
import { build } from "esbuild";
import { readFile, writeFile } from "node:fs/promises";

const target = new URL("../src/flyball/view/static/", import.meta.url);
const libraries = ["three", "uplot", "gifenc"];
const licence = async (name) =>
  readFile(`node_modules/${name}/LICENSE`, "utf8").catch(() => readFile(`node_modules/${name}/LICENSE.md`, "utf8"));

await build({
  entryPoints: ["libraries.mjs"],
  bundle: true,
  minify: true,
  format: "iife",
  globalName: "LIB",
  target: "es2022",
  legalComments: "inline",
  outfile: new URL("libraries.min.js", target).pathname,
});

await writeFile(new URL("uplot.min.css", target), await readFile("node_modules/uplot/dist/uPlot.min.css"));

const licences = await Promise.all(
  libraries.map(async (name) => {
    const { version } = JSON.parse(await readFile(`node_modules/${name}/package.json`, "utf8"));
    return `${name} ${version}\n\n${await licence(name)}`.trim();
  }),
);
await writeFile(new URL("licences.txt", target), licences.join("\n\n----\n\n") + "\n");
