"use strict";

// A replay is drawn when it comes into view, so that the page itself is there at once; its frame is
// then as tall as what it shows.
const show = (frame) => {
  if (frame.srcdoc) return;
  frame.addEventListener("load", () => {
    const shown = frame.contentDocument.querySelector("main");
    new ResizeObserver(() => { frame.style.height = `${shown.offsetHeight}px`; }).observe(shown);
  });
  frame.srcdoc = frame.dataset.document;
};
const frames = document.querySelectorAll("iframe[data-document]");
if ("IntersectionObserver" in window) {
  const watcher = new IntersectionObserver((seen) => {
    for (const one of seen) {
      if (one.isIntersecting) {
        watcher.unobserve(one.target);
        show(one.target);
      }
    }
  });
  addEventListener("load", () => frames.forEach((frame) => watcher.observe(frame)));
} else {
  frames.forEach(show);
}

for (const command of document.querySelectorAll(".command")) {
  const button = command.querySelector("button");
  const code = command.querySelector("code");
  button.hidden = false;
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(code.textContent);
      button.textContent = "copied";
    } catch {
      getSelection().selectAllChildren(code);
      button.textContent = "selected";
    }
    setTimeout(() => { button.textContent = "copy"; }, 1500);
  });
}
