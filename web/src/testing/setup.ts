// jsdom has no layout and no dialogs: what the components need of both.
import "@testing-library/svelte/vitest";
