import { readFileSync } from "node:fs";
import { defineConfig, type Plugin } from "vite";

/** The page only loads the bundle, so it is copied as it is, without a hash in any name. */
const copyPage: Plugin = {
  name: "copy-page",
  generateBundle() {
    const source = readFileSync(new URL("./index.html", import.meta.url), "utf8");
    this.emitFile({ type: "asset", fileName: "index.html", source });
  },
};

/** Leave out what only lit materials of three.js use, 65 KB; the studio has shaders of its own. */
const dropLights: Plugin = {
  name: "drop-lights",
  transform(code, id) {
    if (!id.endsWith("three.module.js")) return null;
    const unused = /^var ((?:lights|shadowmap|transmission|iridescence|envmap_physical)\w*) = ".*";$/gm;
    return { code: code.replace(unused, 'var $1 = "";'), map: null };
  },
};

export default defineConfig({
  plugins: [copyPage, dropLights],
  publicDir: false,
  build: {
    outDir: "../src/eigenshape_studio/static",
    emptyOutDir: true,
    target: "es2022",
    chunkSizeWarningLimit: 900,
    modulePreload: false,
    rollupOptions: {
      input: "src/main.ts",
      preserveEntrySignatures: "strict", // a notebook imports the default export
      output: { format: "es", entryFileNames: "studio.js", codeSplitting: false },
    },
  },
});
