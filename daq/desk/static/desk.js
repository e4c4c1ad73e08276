// What every page of the desk shares: the token of the link becomes a session; asking the desk for something.
"use strict";

const Desk = {
  byId: (id) => document.getElementById(id),

  /** Send JSON; return what is answered. Throws an Error with the desk's own message. */
  async ask(path, content) {
    let answer;
    try {
      answer = await fetch(path, {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify(content),
      });
    } catch {
      throw new Error("The desk does not answer: has it been ended? Start “bufferstand desk” again.");
    }
    const said = await answer.json().catch(() => ({}));
    if (!answer.ok) throw Object.assign(new Error(said.problem || `The desk refused (${answer.status}).`), { field: said.field });
    return said;
  },

  /** Say something to whoever looks, and to a screen reader. */
  say(text, bad = false) {
    const place = Desk.byId("said");
    place.textContent = text;
    place.classList.toggle("problem", bad);
    if (bad) place.scrollIntoView({ block: "nearest" });
  },

  /** Say something on the page that is opened next. */
  sayNext(text) {
    try { sessionStorage.setItem("said", text); } catch { /* a window that keeps nothing */ }
  },

  /** Show a command that was started as it goes (#job); return how it ended. */
  async watch({ job, command }) {
    const place = Desk.byId("job"), text = Desk.byId("job-text"), stop = Desk.byId("job-stop");
    place.hidden = false;
    Desk.byId("job-command").textContent = command;
    stop.hidden = false;
    stop.onclick = () => Desk.ask(`/job/${job}/stop`, {}).catch((error) => Desk.say(error.message, true));
    for (;;) {
      const answer = await fetch(`/job/${job}`);
      if (!answer.ok) throw new Error("The desk has lost sight of it: look at the stand.");
      const said = await answer.json();
      if (text.textContent !== said.text) {
        const follows = text.scrollTop + text.clientHeight > text.scrollHeight - 8;  // nobody has scrolled back
        text.textContent = said.text;
        if (follows) text.scrollTop = text.scrollHeight;
      }
      if (!said.running) {
        stop.hidden = true;
        return said;
      }
      await new Promise((resolve) => setTimeout(resolve, 400));
    }
  },

  /** Do something once at a time; what goes wrong is said. */
  async during(button, what) {
    if (button.getAttribute("aria-busy") === "true") return;
    button.setAttribute("aria-busy", "true");
    button.disabled = true;
    try {
      await what();
    } catch (error) {
      Desk.say(error.message, true);
    } finally {
      button.disabled = false;
      button.removeAttribute("aria-busy");
    }
  },
};

Desk.enter = async () => {
  const token = location.hash.slice(1);
  if (token.length > 15) {
    history.replaceState(null, "", location.pathname + location.search);
    try {
      await Desk.ask("/session", { token });
      location.reload();
    } catch (error) {
      Desk.say(error.message, true);
    }
  }
};
try {
  const said = sessionStorage.getItem("said");
  if (said) Desk.say(said);
  sessionStorage.removeItem("said");
} catch { /* as above */ }

// A link that is opened where the page is shown already changes what is behind the # alone: nothing is loaded.
addEventListener("hashchange", Desk.enter);
Desk.enter();

const door = Desk.byId("door");
if (door) {
  door.addEventListener("submit", (event) => {
    event.preventDefault();
    Desk.during(door.querySelector("button"), async () => {
      await Desk.ask("/session", { token: Desk.byId("token").value.trim().split("#").pop() });
      location.reload();
    });
  });
}
