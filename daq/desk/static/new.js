// The first files are made.
"use strict";

{
  const form = Desk.byId("beginning");
  // A scanner ends an id with Enter: that is not the end of the form.
  form.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" || event.target.tagName !== "INPUT") return;
    event.preventDefault();
    const fields = [...form.elements].filter((one) => one.tagName !== "FIELDSET");
    fields[fields.indexOf(event.target) + 1]?.focus();
  });
  // The shipped spring is that of a buffer with elastomer and 105 mm: no other is planned with it.
  form.addEventListener("change", () => {
    const stroke = Desk.byId("max-stroke").value.trim();
    const alike = Desk.byId("kind").value === "buffer" && Desk.byId("elastic-system").value === "elastomer" && (!stroke || Number(stroke) === 105);
    Desk.byId("model").disabled = !alike;
    if (!alike) Desk.byId("model").checked = false;
  });
  // What is not asked of a stand that is recorded only, or not known of a controller that is polled.
  const asked = () => {
    const kind = Desk.byId("controller").value;
    for (const one of form.querySelectorAll("[data-not]")) one.hidden = one.dataset.not.split(" ").includes(kind);
    for (const one of form.querySelectorAll(".reading")) one.textContent = kind === "none" ? "V" : "count";
  };
  form.addEventListener("change", asked);
  asked();
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    Desk.during(Desk.byId("make"), async () => {
      const content = {};
      for (const one of form.elements) if (one.name && !one.closest("[hidden]")) content[one.name] = one.type === "checkbox" ? one.checked : one.value;
      const said = await Desk.ask("/new", content);
      location.assign(said.campaign ? `/prepare?campaign=${encodeURIComponent(said.campaign)}` : `/check?stand=${encodeURIComponent(said.stand)}`);
    });
  });
}
