// What jsdom lacks and the components need: dialogs as the browser has them.
import "@testing-library/jest-dom/vitest";
import "@testing-library/svelte/vitest";

HTMLDialogElement.prototype.showModal ??= function (this: HTMLDialogElement) {
  this.open = true;
};
HTMLDialogElement.prototype.close ??= function (this: HTMLDialogElement) {
  this.open = false;
  this.dispatchEvent(new Event("close"));
};
