// A campaign: how far it is, its live page, stop, resume, note.
"use strict";

{
  const folder = Desk.byId("work").dataset.folder, LOOK_MS = 2000;
  const status = () => document.querySelector("[data-status]").dataset.status;
  const pieces = { state: "", record: "" };

  function arrange() {
    const now = status(), stopped = !["running", "complete"].includes(now);
    for (const one of document.querySelectorAll(".when-running")) one.hidden = now !== "running";
    for (const one of document.querySelectorAll(".when-stopped")) one.hidden = !stopped;
  }

  async function look() {
    const answer = await fetch(`/campaign/state?folder=${encodeURIComponent(folder)}`).catch(() => null);
    if (!answer?.ok) return Desk.say("The desk does not answer: has it been ended? The campaign goes on without it.", true);
    const said = await answer.json();
    const before = status();
    for (const name of Object.keys(pieces)) {
      if (said[name] === pieces[name]) continue;
      const place = Desk.byId(name), open = place.querySelector("details")?.open;
      place.innerHTML = pieces[name] = said[name];
      const log = place.querySelector("details");
      if (log && open) log.open = true;
    }
    if (before !== said.status)
      Desk.say(said.status === "complete" ? "The campaign is complete." : `It is ${said.status === "running" ? "running" : "not running any more"}.`);
    arrange();
  }

  const on = (id, what) => Desk.byId(id)?.addEventListener("click", (event) => Desk.during(event.currentTarget, what));

  async function live() {
    const page = new URL((await Desk.ask("/campaign/live", { folder })).link);
    page.searchParams.set("desk", `${location.origin}/campaign?folder=${encodeURIComponent(folder)}`);
    location.assign(page.href);
  }
  on("live", live);
  // From the start one comes to the live page, past the stops of this one while that is being opened.
  const asked = new URLSearchParams(location.search);
  if (asked.has("live")) {
    asked.delete("live");
    history.replaceState(null, "", `/campaign?${asked}`);
    Desk.say("The live page is being opened…");
    Desk.during(Desk.byId("live"), live);
  }
  for (const button of document.querySelectorAll("[data-after]"))
    button.addEventListener("click", () => Desk.during(button, async () => {
      Desk.say((await Desk.ask("/campaign/stop", { folder, after: button.dataset.after })).said);
    }));
  Desk.byId("noting").addEventListener("submit", (event) => {
    event.preventDefault();
    Desk.during(Desk.byId("write"), async () => {
      const said = await Desk.ask("/campaign/note", { folder, text: Desk.byId("note").value, who: Desk.byId("who").value });
      Desk.byId("note").value = "";
      Desk.say(said.said);
      await look();
    });
  });
  Desk.byId("specimen")?.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    Desk.byId("resume").focus();
  });
  Desk.byId("resuming")?.addEventListener("submit", (event) => {
    event.preventDefault();
    Desk.during(Desk.byId("resume"), async () => {
      Desk.say("It is being resumed…");
      await Desk.ask("/campaign/resume", {
        folder,
        specimen: Desk.byId("specimen").value,
        edits: Desk.byId("edits").value,
        operator: Desk.byId("operator").value,
        ticked: [...document.querySelectorAll("#resuming [name=tick]:checked")].map((one) => one.value),
      });
      // What was looked at is looked at anew before the next motion.
      for (const one of document.querySelectorAll("#resuming [name=tick]")) one.checked = false;
      Desk.say("It goes on.");
      await look();
    });
  });

  arrange();
  setInterval(look, LOOK_MS);
}
