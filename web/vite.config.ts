import { svelte } from "@sveltejs/vite-plugin-svelte";
import { svelteTesting } from "@testing-library/svelte/vite";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

const server = process.env.KEMPELEN_SERVER ?? "http://127.0.0.1:8420";

/** cm-chessboard places a dragged piece by a style attribute, which the page's CSP forbids; the CSSOM may. */
function styleAttributesToCssom(): Plugin {
  return {
    name: "style-attributes-to-cssom",
    transform(code, id) {
      if (!id.includes("cm-chessboard/src/view/VisualMoveInput.js")) return null;
      const changed = code.replaceAll(/(this\.draggablePiece)\.setAttribute\("style",/g, "setCssText($1,");
      if (changed === code) throw new Error(`${id}: no style attribute is set there any more; this plugin can go`);
      return { code: `${changed}\nfunction setCssText(element, css) { element.style.cssText = css }\n`, map: null };
    },
  };
}

export default defineConfig({
  plugins: [styleAttributesToCssom(), svelte(), svelteTesting()],
  build: {
    outDir: "../src/kempelen/server/page",
    emptyOutDir: true,
    target: "es2022",
    assetsInlineLimit: 0, // the CSP lets nothing in but files
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
    rolldownOptions: {
      output: {
        codeSplitting: { groups: [{ name: "three", test: /node_modules[\\/]three[\\/]/ }] },
      },
    },
  },
  server: {
    proxy: { "/api": { target: server, changeOrigin: true, ws: true, headers: { origin: server } } },
  },
  test: {
    environment: "jsdom",
    include: ["src/**/*.test.ts"],
    setupFiles: ["src/testing/setup.ts"],
    restoreMocks: true,
    pool: "vmThreads", // one jsdom for a worker's files, each in a world of its own
  },
});
