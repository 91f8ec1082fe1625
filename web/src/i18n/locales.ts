export const LOCALES = { en: "English", cs: "Čeština", de: "Deutsch", ar: "العربية" } as const;
export type Locale = keyof typeof LOCALES;

export function isLocale(text: string): text is Locale {
  return text in LOCALES;
}

export function direction(locale: Locale): "ltr" | "rtl" {
  return locale === "ar" ? "rtl" : "ltr";
}

/** For Intl. Arabic with the digits that the board's coordinates have, so that one page has one kind. */
export function intlTag(locale: Locale): string {
  return locale === "ar" ? "ar-u-nu-latn" : locale;
}
