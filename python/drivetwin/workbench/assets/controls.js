/* SPDX-License-Identifier: MIT */
/* Selects pass their value on; upload buttons send a file; buttons lead to steps; the browser's way
   back changes the view; a missing answer of the server and past messages are handled. */
"use strict";
(() => {
  const idOf = (element) => (element.id.startsWith("{") ? JSON.parse(element.id) : element.id);
  const set = (id, props) => window.dash_clientside.set_props(id, props);

  document.addEventListener("change", (event) => {
    if (event.target.matches("select.choice")) {
      set(idOf(event.target), { "data-value": event.target.value });
    }
  });

  const say = (text, fault) =>
    set("message", { children: text, className: `message ${fault ? "fault" : "good"}` });

  /* A message is about what was done last: it goes with the next thing that is done. Not when a
     field is left: all below would move up under the mouse before it lets go of a button. */
  const past = (control) => (event) => {
    if (event.target.closest(control) && document.getElementById("message")?.textContent) {
      say("", false);
    }
  };
  document.addEventListener("click", past("button"), true);
  document.addEventListener("change", past("select"), true);

  /* A button that leads to a step opens its view and puts the focus on its title. */
  document.addEventListener("click", (event) => {
    const step = event.target.closest("button[data-go]")?.dataset.go;
    if (!step) return;
    document.getElementById(`nav-${step}`)?.click();
    setTimeout(() => document.querySelector(`#view-${step} h2`)?.focus(), 50);
  });

  /* A view that is drawn again replaces its controls: the one with the focus gets it back. */
  let focused = null;
  document.addEventListener("focusin", (event) => { focused = event.target; });
  const keepFocus = () => {
    if (!focused?.id || focused.isConnected || document.activeElement !== document.body) return;
    const again = document.getElementById(focused.id), before = focused;
    if (!again) return;
    focused = again;
    again.focus();
    /* In the card form text that is being typed is newer than what the server has drawn. */
    if (again.closest(".question") && again.value !== before.value) {
      const { set: write } = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value");
      write.call(again, before.value);
      again.dispatchEvent(new Event("input", { bubbles: true }));
    }
  };
  new MutationObserver(keepFocus)
    .observe(document.documentElement, { childList: true, subtree: true });

  window.addEventListener("popstate", () => {
    const view = location.hash.slice(1) || "log";
    document.getElementById(`nav-${view}`)?.click();
  });

  /* The key of this browser comes in the fragment of the first address. The storage of the origin
     keeps it, so that no page of another port has it; a request without it is refused. */
  const KEY = "drivetwin-key";
  if (location.hash.startsWith("#key=")) {
    localStorage.setItem(KEY, location.hash.slice(5));
    history.replaceState(null, "", location.pathname);
  }

  /* All that the page asks passes here: without an answer it would stand still without a word. */
  const ask = window.fetch;
  window.fetch = async (where, options = {}) => {
    try {
      const headers = new Headers(options.headers);
      headers.set("X-Drivetwin-Key", localStorage.getItem(KEY) ?? "");
      const answer = await ask(where, { ...options, headers });
      if (answer.status === 403) {
        say("this browser has no access -> open the link from the terminal of the workbench", true);
      } else if (answer.status >= 500) {
        say("internal error of the workbench -> its terminal has the details", true);
      }
      return answer;
    } catch (fault) {
      if (fault.name !== "AbortError") {
        say("the workbench does not answer -> start it again, then load the page again", true);
      }
      throw fault;
    }
  };

  /* Uploads: bytes go as they are, counted by the server while they come in. */
  async function send(button, file) {
    const limit = Number(button.dataset.limit);
    if (file.size > limit) {
      const has = (file.size / 1e6).toFixed(0), may = (limit / 1e6).toFixed(0);
      say(`${file.name}: the file has ${has} MB, the limit is ${may} MB`, true);
      return;
    }
    button.setAttribute("aria-busy", "true");
    say(`uploading ${file.name} …`, false);
    try {
      const answer = await fetch(
        `upload/${button.dataset.upload}?name=${encodeURIComponent(file.name)}`,
        {
          method: "POST",
          body: file,
          headers: { "X-Drivetwin-Session": JSON.parse(sessionStorage.getItem("session")) },
        },
      );
      const content = await answer.json();
      if (!answer.ok) {
        say(content.error, true);
        return;
      }
      say(`uploaded ${content.name}`, false);
      set(button.dataset.target, { data: content });
    } catch (fault) {
      say(`${file.name} was not uploaded: ${fault.message}`, true);
    } finally {
      button.removeAttribute("aria-busy");
    }
  }

  document.addEventListener("click", (event) => {
    const button = event.target.closest("button[data-upload]");
    if (!button) return;
    const picker = document.createElement("input");
    picker.type = "file";
    picker.addEventListener("change", () => picker.files[0] && send(button, picker.files[0]));
    picker.click();
  });
})();
