// A stand is checked, touched off, and moved by small steps.
"use strict";

{
  const { stand, campaign } = Desk.byId("work").dataset;
  const on = (id, what) => Desk.byId(id)?.addEventListener("click", (event) => Desk.during(event.currentTarget, what));
  // A device answers one program at a time: what needs the devices waits until they are free.
  const users = document.querySelectorAll("#check, #zero-now, #tare, .jog, #record");
  const using = (button, what) => button?.addEventListener("click", () => Desk.during(button, async () => {
    const others = [...users].filter((one) => one !== button && !one.disabled);
    for (const one of others) one.disabled = true;
    try { await what(); } finally { for (const one of others) one.disabled = false; }
  }));

  using(Desk.byId("check"), async () => {
    const findings = Desk.byId("findings");
    Desk.say("The devices are being read…");
    findings.setAttribute("aria-busy", "true");
    let said;
    try { said = await Desk.ask("/check/run", { stand }); } finally { findings.removeAttribute("aria-busy"); }
    findings.innerHTML = said.html;
    Desk.say(said.faults ? `The check found ${said.faults} fault${said.faults === 1 ? "" : "s"}.` : "The check found no fault.", said.faults > 0);
  });

  async function twin(what) {
    const said = await Desk.ask("/check/twin", { stand, what, speed: Desk.byId("speed")?.value ?? "1" });
    Desk.byId("twin-state").textContent = said.running ? "It is being served." : "It is not being served by this desk.";
    Desk.say(said.running ? "The simulated stand can be asked." : said.was ? "The simulated stand has ended." : "This desk serves no simulated stand.");
  }
  on("twin-serve", () => twin("serve"));
  on("twin-end", () => twin("end"));

  const typed = () => ({
    stand,
    campaign,
    id: Desk.byId("stand-id").value,
    specimen: Desk.byId("specimen").value,
    operator: Desk.byId("operator").value,
  });

  async function watched(path, content, done, meanwhile = "") {
    Desk.say(meanwhile);
    const ended = await Desk.watch(await Desk.ask(path, content));
    if (ended.status === 0) {
      Desk.say(done);
      if (path === "/check/zero" || path === "/check/tare") Desk.byId("zero").textContent = ended.text.split("\n").at(-2) ?? ended.text;
    } else Desk.say(ended.text.split("\n").at(-1) || "It ended with a fault.", true);
  }
  using(Desk.byId("zero-now"), () => watched("/check/zero", typed(), "First contact is found, and stored as zero."));
  using(Desk.byId("tare"), () => watched("/check/tare", { stand }, "What the channels read at rest is stored as zero."));
  for (const button of document.querySelectorAll(".jog"))
    using(button, () => watched("/check/jog", { ...typed(), by: button.dataset.by }, "It has moved."));

  using(Desk.byId("record"), () => {
    const value = (id) => Desk.byId(id).value.trim();
    return watched("/check/record", { stand, specimen: value("recorded"), lasting: value("lasting"), operator: value("recorder") }, "It is recorded: see Results or Archive.", "It is being recorded. Have the stand’s own controller run the test.");
  });
  Desk.byId("recording")?.addEventListener("submit", (event) => event.preventDefault());

  // Enter, as a scanner ends with, takes the id and moves nothing.
  Desk.byId("moving")?.addEventListener("submit", (event) => event.preventDefault());
}
