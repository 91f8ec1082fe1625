export const LOCALES = { en: "English", cs: "Čeština", de: "Deutsch", ar: "العربية" } as const;
export type Locale = keyof typeof LOCALES;

export function isLocale(text: string): text is Locale {
  return text in LOCALES;
}

export function direction(locale: Locale): "ltr" | "rtl" {
  return locale === "ar" ? "rtl" : "ltr";
}
