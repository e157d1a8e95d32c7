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

export default defineConfig({
  plugins: [copyPage],
  publicDir: false,
  build: {
    outDir: "../src/eigenshape_studio/static",
    emptyOutDir: true,
    target: "es2022",
    chunkSizeWarningLimit: 700,
    modulePreload: false,
    rollupOptions: {
      input: "src/main.ts",
      preserveEntrySignatures: "strict", // a notebook imports the default export
      output: { format: "es", entryFileNames: "studio.js", codeSplitting: false },
    },
  },
});
