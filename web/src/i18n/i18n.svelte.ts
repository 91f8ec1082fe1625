// All words of the page: t("room.key", params). A room is a file in each language's folder; English is the
// source of the keys and stands in where a language is still being loaded.
//
// "{name}" is replaced by params.name, numbers as the language writes them. With params.count the key may
// have forms by plural: key_one, key_few … key_other, as `Intl.PluralRules` names them.
import type game from "./en/game.json";
import type operator from "./en/operator.json";
import type said from "./en/said.json";
import type scene from "./en/scene.json";
import type shell from "./en/shell.json";
import { settings } from "../state/settings.svelte";
import { direction, intlTag, isLocale, type Locale } from "./locales";

type Base<Name extends string> = Name extends `${infer Stem}_${Intl.LDMLPluralRule}` ? Stem | Name : Name;
type Room<Name extends string, Texts> = `${Name}.${Base<keyof Texts & string>}`;
export type Key =
  | Room<"shell", typeof shell>
  | Room<"game", typeof game>
  | Room<"operator", typeof operator>
  | Room<"said", typeof said>
  | Room<"scene", typeof scene>;
export type Params = Readonly<Record<string, string | number>>;
type Texts = Readonly<Record<string, string>>;

const english = import.meta.glob<Texts>("./en/*.json", { eager: true, import: "default" });
const others = import.meta.glob<Texts>(["./*/*.json", "!./en/*.json"], { import: "default" });

const EN = collect(Object.entries(english));

class I18n {
  locale = $state<Locale>("en");
  texts = $state.raw<Texts>(EN);
  rtl = $derived(direction(this.locale) === "rtl");
  #plurals = $derived(new Intl.PluralRules(this.locale));
  #numbers = $derived(new Intl.NumberFormat(intlTag(this.locale)));

  form(count: number): Intl.LDMLPluralRule {
    return this.#plurals.select(count);
  }

  number(value: number): string {
    return this.#numbers.format(value);
  }
}

export const i18n = new I18n();

export function t(key: Key, params?: Params): string {
  return fill(find(key, params), params);
}

/** For keys that are put together at run time; `undefined` where there is none. */
export function maybe(key: string, params?: Params): string | undefined {
  return key in EN || `${key}_other` in EN ? fill(find(key, params), params) : undefined;
}

export async function setLocale(locale: Locale): Promise<void> {
  const files = Object.entries(others).filter(([path]) => path.startsWith(`./${locale}/`));
  const loaded = await Promise.all(files.map(async ([path, load]) => [path, await load()] as [string, Texts]));
  i18n.texts = locale === "en" ? EN : { ...EN, ...collect(loaded) };
  i18n.locale = locale;
  document.documentElement.lang = locale;
  document.documentElement.dir = direction(locale);
}

/** What was chosen, else the first language of the browser that there is. */
export function preferredLocale(): Locale {
  if (isLocale(settings.locale)) return settings.locale;
  const wanted = navigator.languages.map((tag) => tag.slice(0, 2).toLowerCase());
  return wanted.find(isLocale) ?? "en";
}

export function formatNumber(value: number, digits = 0): string {
  const options = { minimumFractionDigits: digits, maximumFractionDigits: digits };
  return new Intl.NumberFormat(intlTag(i18n.locale), options).format(value);
}

export function formatDate(date: Date): string {
  return new Intl.DateTimeFormat(intlTag(i18n.locale), { dateStyle: "medium", timeStyle: "short" }).format(date);
}

function find(key: string, params?: Params): string {
  const count = params?.["count"];
  if (typeof count === "number") {
    const text = i18n.texts[`${key}_${i18n.form(count)}`] ?? i18n.texts[`${key}_other`];
    if (text !== undefined) return text;
  }
  return i18n.texts[key] ?? key;
}

function fill(text: string, params?: Params): string {
  if (!params) return text;
  return text.replaceAll(/\{(\w+)\}/g, (whole, name: string) => {
    const value = params[name];
    return typeof value === "number" ? i18n.number(value) : (value ?? whole);
  });
}

function collect(files: readonly (readonly [string, Texts])[]): Texts {
  const named = files.map(([path, texts]) => {
    const room = path.slice(path.lastIndexOf("/") + 1, -".json".length);
    return Object.entries(texts).map(([key, text]) => [`${room}.${key}`, text]);
  });
  return Object.fromEntries(named.flat()) as Texts;
}
