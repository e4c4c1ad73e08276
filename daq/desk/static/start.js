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

  form?.addEventListener("submit", (event) => {
    event.preventDefault();
    Desk.during(Desk.byId("start"), async () => {
      Desk.say("It is being started…");
      const said = await Desk.ask("/start", {
        campaign,
        out: Desk.byId("out").value,
        operator: Desk.byId("operator").value,
        specimen: Desk.byId("specimen").value,
        ticked: [...form.querySelectorAll("[name=tick]:checked")].map((one) => one.value),
        simulate: Desk.byId("simulate")?.checked ?? false,
        speed: Desk.byId("speed")?.value ?? "1",
      });
      location.assign(`/campaign?folder=${encodeURIComponent(said.folder)}&live`);
    });
  });
}
