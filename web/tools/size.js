// How much JavaScript a browser loads before the 3D view, gzipped: fails above the limit.
import { readdirSync, readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

const LIMIT_KB = 250;
const assets = new URL("../../src/kempelen/server/page/assets/", import.meta.url);
const scripts = readdirSync(assets).filter((name) => name.endsWith(".js") && !/^(three|SceneView)-/.test(name));
const sizes = scripts.map((name) => [name, gzipSync(readFileSync(new URL(name, assets))).length]);
const total = sizes.reduce((sum, [, size]) => sum + size, 0) / 1000;
const largest = sizes.sort((a, b) => b[1] - a[1]).slice(0, 3);
console.log(`JavaScript without the 3D view: ${total.toFixed(1)} kB gzip of at most ${LIMIT_KB} kB`);
for (const [name, size] of largest) console.log(`  ${name}: ${(size / 1000).toFixed(1)} kB`);
if (total > LIMIT_KB) process.exit(1);
