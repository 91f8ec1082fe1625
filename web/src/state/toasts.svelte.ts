// Short notes at the page's edge. Errors stay until they are closed; the rest goes by itself.
export interface Toast {
  readonly id: number;
  readonly kind: "info" | "done" | "error";
  readonly text: string;
  readonly hint: string;
}

const SHOWN_MS = 6000;
const MOST = 4;
let next = 1;

export const toasts: { list: readonly Toast[] } = $state({ list: [] });

export function toast(kind: Toast["kind"], text: string, hint = ""): void {
  const same = toasts.list.filter((one) => one.text !== text);
  const one = { id: next++, kind, text, hint };
  toasts.list = [...same, one].slice(-MOST);
  if (kind !== "error") setTimeout(() => closeToast(one.id), SHOWN_MS);
}

export function closeToast(id: number): void {
  toasts.list = toasts.list.filter((one) => one.id !== id);
}
