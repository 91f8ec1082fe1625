// Routes by path. Links are plain <a href>; those within the page do not load it anew.
import type { Component } from "svelte";
import type { Key } from "./i18n/i18n.svelte";
import GamePage from "./pages/GamePage.svelte";
import type { IconName } from "./ui/icons";

type Loader = () => Promise<{ default: Component }>;

export interface Route {
  readonly path: string;
  readonly title: Key;
  readonly icon: IconName;
  /** Only operators are offered the way there. */
  readonly operator: boolean;
  readonly load: Loader;
  /** Without navigation around it. */
  readonly bare?: boolean;
}

export const ROUTES: readonly Route[] = [
  { path: "/", title: "shell.nav_game", icon: "board", operator: false, load: async () => ({ default: GamePage }) },
  { path: "/new", title: "shell.nav_new", icon: "plus", operator: true, load: () => import("./pages/NewPage.svelte") },
  { path: "/history", title: "shell.nav_history", icon: "history", operator: false, load: () => import("./pages/HistoryPage.svelte") },
  { path: "/setup", title: "shell.nav_setup", icon: "plug", operator: true, load: () => import("./pages/SetupPage.svelte") },
  { path: "/calibrate", title: "shell.nav_calibrate", icon: "target", operator: true, load: () => import("./pages/CalibratePage.svelte") },
  { path: "/eyes", title: "shell.nav_eyes", icon: "eye", operator: true, load: () => import("./pages/EyesPage.svelte") },
  { path: "/spectator", title: "shell.nav_spectator", icon: "screen", operator: false, load: () => import("./pages/SpectatorPage.svelte"), bare: true },
  { path: "/logs", title: "shell.nav_logs", icon: "list", operator: true, load: () => import("./pages/LogsPage.svelte") },
  { path: "/settings", title: "shell.nav_settings", icon: "gear", operator: false, load: () => import("./pages/SettingsPage.svelte") },
  { path: "/about", title: "shell.nav_about", icon: "info", operator: false, load: () => import("./pages/AboutPage.svelte") },
];

class Router {
  path = $state(location.pathname);
  query = $state.raw(new URLSearchParams(location.search));
  route = $derived(ROUTES.find((route) => route.path === this.path));

  go(to: string, { replace = false } = {}): void {
    const url = new URL(to, location.href);
    history[replace ? "replaceState" : "pushState"](null, "", url);
    this.read();
  }

  read(): void {
    this.path = location.pathname;
    this.query = new URLSearchParams(location.search);
  }

  start(): void {
    this.read();
    addEventListener("popstate", () => this.read());
    document.addEventListener("click", (event) => this.#clicked(event));
  }

  #clicked(event: MouseEvent): void {
    if (event.defaultPrevented || event.button !== 0 || event.metaKey || event.ctrlKey || event.shiftKey) return;
    const link = event.target instanceof Element ? event.target.closest("a") : null;
    if (!link || link.target || link.hasAttribute("download") || link.origin !== location.origin) return;
    if (link.pathname.startsWith("/api/") || link.getAttribute("href")?.startsWith("#")) return;
    event.preventDefault();
    this.go(link.href);
  }
}

export const router = new Router();
