"use strict";
(() => {
  const all = (selector) => document.querySelectorAll(selector);
  const tip = document.getElementById("tip");

  // Tooltip with the label of a point, above or below it and inside the window. It follows the point while scrolling.
  let shown = null;
  const place = () => {
    const box = shown.getBoundingClientRect();
    const left = box.left + box.width / 2 - tip.offsetWidth / 2;
    const above = box.top - tip.offsetHeight - 8;
    tip.style.left = Math.max(12, Math.min(left, document.documentElement.clientWidth - tip.offsetWidth - 12)) + "px";
    tip.style.top = (above > 4 ? above : box.bottom + 8) + "px";
  };
  const show = (point) => {
    shown = point;
    tip.textContent = point.getAttribute("aria-label");
    tip.hidden = false;
    place();
  };
  const hide = () => { shown = null; tip.hidden = true; };
  all(".point").forEach((point) => {
    point.addEventListener("pointerenter", () => show(point));
    point.addEventListener("pointerleave", hide);
    point.addEventListener("focus", () => show(point));
    point.addEventListener("blur", hide);
  });
  addEventListener("scroll", () => { if (shown) place(); }, { passive: true });
  addEventListener("keydown", (event) => { if (event.key === "Escape") hide(); });

  const toggle = (box) => {
    const name = CSS.escape(box.dataset.toggle);
    all(`[data-series="${name}"]`).forEach((part) => {
      // SVG elements have no `hidden` property, so the attribute is set and the style sheet hides them.
      part.toggleAttribute("hidden", !box.checked);
    });
  };
  all("[data-toggle]").forEach((box) => {
    box.addEventListener("change", () => toggle(box));
    toggle(box);
  });

  const logarithm = document.getElementById("logarithm");
  const axes = () => document.body.classList.toggle("linear-axes", !logarithm.checked);
  logarithm.addEventListener("change", axes);
  axes();

  const scene = document.getElementById("scene");
  const choose = () => all("section.scene").forEach((part) => {
    part.hidden = scene.value !== "" && part.id !== scene.value;
  });
  if (scene) {
    scene.addEventListener("change", choose);
    choose();
  }
})();
