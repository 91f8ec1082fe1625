import { afterEach, describe, expect, it } from "vitest";
import { formatNumber, setLocale, t } from "./i18n.svelte";
import { LOCALES, type Locale } from "./locales";

type Texts = Record<string, string>;
const files = import.meta.glob<Texts>("./*/*.json", { eager: true, import: "default" });
const rooms = Object.keys(files).filter((path) => path.startsWith("./en/")).map((path) => path.slice("./en/".length));
const others = (Object.keys(LOCALES) as Locale[]).filter((locale) => locale !== "en");
const FORM = /_(zero|one|two|few|many|other)$/;

const base = (keys: string[]) => new Set(keys.map((key) => key.replace(FORM, "")));
const holes = (text: string) => [...text.matchAll(/\{(\w+)\}/g)].map((match) => match[1]!).filter((name) => name !== "count").sort();
const texts = (locale: string, room: string): Texts => files[`./${locale}/${room}`] ?? {};

afterEach(() => setLocale("en"));

describe.each(others)("%s", (locale) => {
  it.each(rooms)("has the keys of English in %s", (room) => {
    expect(base(Object.keys(texts(locale, room)))).toEqual(base(Object.keys(texts("en", room))));
  });

  it.each(rooms)("has the same holes to fill in %s, and no empty text", (room) => {
    const english = texts("en", room);
    for (const [key, text] of Object.entries(texts(locale, room))) {
      const model = english[key] ?? english[`${key.replace(FORM, "")}_other`] ?? "";
      expect([key, holes(text)]).toEqual([key, holes(model)]);
      expect(text.trim()).not.toBe("");
    }
  });

  it.each(rooms)("has all forms of its plural in %s", (room) => {
    const keys = Object.keys(texts(locale, room));
    const counted = base(keys.filter((key) => FORM.test(key) && key.replace(FORM, "") + "_other" in texts(locale, room)));
    const forms = new Intl.PluralRules(locale).resolvedOptions().pluralCategories;
    for (const key of counted) for (const form of forms) expect(keys).toContain(`${key}_${form}`);
  });

  it("is not English", () => {
    const same = rooms.flatMap((room) => {
      const english = texts("en", room);
      return Object.entries(texts(locale, room)).filter(([key, text]) => text === english[key] && /[a-z]{5,}/i.test(text.replaceAll(/\{\w+\}/g, "")));
    });
    const all = rooms.flatMap((room) => Object.keys(texts(locale, room)));
    expect(same.length / all.length, same.map(([key]) => key).join(", ")).toBeLessThan(0.06);
  });
});

it("puts values into texts, numbers as the language writes them", async () => {
  await setLocale("de");
  expect(t("game.left", { seconds: formatNumber(2.1, 1) })).toBe("noch 2,1 s");
});

it("chooses the form of the plural", async () => {
  await setLocale("cs");
  expect([1, 3, 5].map((count) => t("game.move_count", { count }))).toEqual(["1 tah", "3 tahy", "5 tahů"]);
});

it("turns the page for Arabic, and back", async () => {
  await setLocale("ar");
  expect(document.documentElement.dir).toBe("rtl");
  expect(document.documentElement.lang).toBe("ar");
  await setLocale("en");
  expect(document.documentElement.dir).toBe("ltr");
});
