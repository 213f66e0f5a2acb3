// The keyboard, and the window that says what it does.
import { element } from "./format.js";

const TYPING = "input:not([type=range]):not([type=checkbox]), .live input, select, textarea, summary, pre";

export class Keys {
  /** Keys for an element; `alone` says whether it has the page for itself, else it must be pointed at or focused. */
  constructor(home, dialog, alone) {
    Object.assign(this, { home, dialog, actions: new Map(), pointed: false });
    home.addEventListener("pointerenter", () => (this.pointed = true));
    home.addEventListener("pointerleave", () => (this.pointed = false));
    document.addEventListener("keydown", (event) => {
      const { target, key } = event;
      if (event.ctrlKey || event.metaKey || event.altKey || dialog.open) return;
      if (!alone && !this.pointed && !home.contains(document.activeElement)) return;
      if (target.matches?.(TYPING) || (key === " " && target.matches?.("button, input"))) return;
      const action = this.actions.get(key.length === 1 ? key.toLowerCase() : key);
      if (!action) return;
      event.preventDefault();
      action();
    });
    dialog.addEventListener("click", ({ target }) => (target === dialog || target.matches(".close")) && dialog.close());
    this.add("?", "this help", () => this.help(), "?");
  }

  /** One or more keys, separated by spaces ("Space" for the bar itself), what they do, and the doing. */
  add(keys, does, action, shown = keys) {
    for (const key of keys.split(" ")) this.actions.set(key === "Space" ? " " : key, action);
    if (!does) return;
    const caps = shown.split(" ").flatMap((key, k) => [k ? " " : "", element("kbd", { textContent: key })]);
    this.dialog
      .querySelector("dl")
      .append(element("div", {}, element("dt", {}, ...caps), element("dd", { textContent: does })));
  }

  help() {
    if (!this.dialog.open) this.dialog.showModal();
  }
}
