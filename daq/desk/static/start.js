// A campaign is started: the plan as it lies on the disk, the checklist, the specimen's id.
"use strict";

{
  const campaign = Desk.byId("work").dataset.campaign, form = Desk.byId("starting");

  (async () => {
    const place = Desk.byId("plan");
    try {
      if (form) place.innerHTML = (await Desk.ask("/start/plan", { campaign })).html;
    } catch (error) {
      Desk.say(error.message, true);
      place.textContent = "";
    } finally {
      place.removeAttribute("aria-busy");
    }
  })();

  // A scanner ends with Enter: that takes the id and goes on to the button, which a person pushes.
  Desk.byId("specimen")?.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    Desk.byId("start").focus();
  });

  const filled = () => ({
    campaign,
    out: Desk.byId("out").value,
    operator: Desk.byId("operator").value,
    specimen: Desk.byId("specimen").value,
    ticked: [...form.querySelectorAll("[name=tick]:checked")].map((one) => one.value),
    simulate: Desk.byId("simulate")?.checked ?? false,
    speed: Desk.byId("speed")?.value ?? "1",
  });
  /** What the button and the command below say is what would be done: a rehearsal moves nothing real. */
  let waiting = 0;
  async function follow() {
    const content = filled(), asked = JSON.stringify(content);
    Desk.byId("start").textContent = content.simulate ? "Start the rehearsal: no real stand moves" : "Start: this moves the stand";
    try {
      const { command } = await Desk.ask("/start/command", content);
      if (asked === JSON.stringify(filled())) document.querySelector(".command code").textContent = command;
    } catch { /* it is said at the start */ }
  }
  form?.addEventListener("input", () => {
    clearTimeout(waiting);
    waiting = setTimeout(follow, 250);
  });

  form?.addEventListener("submit", (event) => {
    event.preventDefault();
    Desk.during(Desk.byId("start"), async () => {
      Desk.say("It is being started…");
      const said = await Desk.ask("/start", filled());
      location.assign(`/campaign?folder=${encodeURIComponent(said.folder)}&live`);
    });
  });
}
