// Before the first paint: theme and direction as they were chosen, so that nothing flashes.
(() => {
  const root = document.documentElement;
  let kept = {};
  try {
    kept = JSON.parse(localStorage.getItem("kempelen.settings") ?? "{}");
  } catch {
    return; // storage is closed or holds something else: the defaults stand
  }
  if (kept.theme === "light" || kept.theme === "dark") root.dataset.theme = kept.theme;
  if (typeof kept.board === "string") root.dataset.board = kept.board;
  if (typeof kept.locale === "string" && /^[a-z]{2}$/.test(kept.locale)) {
    root.lang = kept.locale;
    root.dir = kept.locale === "ar" ? "rtl" : "ltr";
  }
})();
