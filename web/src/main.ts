import { mount } from "svelte";
import App from "./App.svelte";
import { preferredLocale, setLocale } from "./i18n/i18n.svelte";
import { router } from "./router.svelte";
import { startSocket } from "./state/orders";
import { tellOfUsedLink } from "./state/session";
import "./style.css";

const target = document.getElementById("app");
if (!target) throw new Error("index.html has no element #app");
startSocket();
router.start();
await setLocale(preferredLocale());
tellOfUsedLink();
mount(App, { target });
