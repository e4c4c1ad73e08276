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
  const model = Desk.byId("model");
  let wanted = model.checked;
  model.addEventListener("change", () => { wanted = model.checked; });
  form.addEventListener("change", () => {
    const stroke = Desk.byId("max-stroke").value.trim().replace(",", ".");
    const alike = Desk.byId("kind").value === "buffer" && Desk.byId("elastic-system").value === "elastomer" && (!stroke || Number(stroke) === 105);
    model.disabled = !alike;
    model.checked = alike && wanted;
    Desk.byId("model-help").hidden = alike;
  });
  // What is not asked of a stand that is recorded only, or not known of a controller that is polled.
  const asked = () => {
    const kind = Desk.byId("controller").value;
    for (const one of form.querySelectorAll("[data-not]")) one.hidden = one.dataset.not.split(" ").includes(kind);
    for (const one of form.querySelectorAll(".reading")) one.textContent = kind === "none" ? "V" : "count";
  };
  form.addEventListener("change", asked);
  asked();
  let typed = false;  // what was typed is not thrown away without a question
  let waiting = 0;
  form.addEventListener("input", () => {
    typed = true;
    clearTimeout(waiting);
    waiting = setTimeout(follow, 250);
  });
  const said = () => Object.fromEntries([...form.elements].filter((one) => one.name && !one.closest("[hidden]")).map((one) => [one.name, one.type === "checkbox" ? one.checked : one.value]));
  /** The command below is that of what the form says. */
  async function follow() {
    if (Desk.byId("make").disabled) return;
    const asked = JSON.stringify(said());
    try {
      const { command } = await Desk.ask("/new/command", said());
      if (asked === JSON.stringify(said())) document.querySelector(".command code").textContent = command;
    } catch { /* it is said when the files are to be written */ }
  }
  addEventListener("beforeunload", (event) => { if (typed) event.preventDefault(); });

  /** Say at its field what is wrong there. */
  function mark(id, text) {
    const field = Desk.byId(id), name = document.querySelector(`label[for="${id}"]`).textContent;
    const message = Object.assign(document.createElement("p"), { className: "problem", id: `${id}-wrong`, textContent: text });
    field.setAttribute("aria-invalid", "true");
    field.setAttribute("aria-errormessage", message.id);
    field.after(message);
    field.focus();
    return `${name}: ${text}`;
  }
  function unmark() {
    for (const one of form.querySelectorAll("p.problem")) one.remove();
    for (const one of form.querySelectorAll("[aria-invalid]")) {
      one.removeAttribute("aria-invalid");
      one.removeAttribute("aria-errormessage");
    }
  }

  form.addEventListener("submit", (event) => {
    event.preventDefault();
    Desk.during(Desk.byId("make"), async () => {
      const content = said();
      unmark();
      Desk.say("The files are being written…");
      form.inert = true;  // what is typed now would not be in them
      let made;
      try {
        made = await Desk.ask("/new", content);
      } catch (error) {
        if (!error.field || !Desk.byId(error.field)) throw error;
        form.inert = false;  // or it takes no focus
        return Desk.say(mark(error.field, error.message), true);
      } finally {
        form.inert = false;
      }
      typed = false;
      Desk.sayNext("The files are written: look at them, and change what is yours.");
      location.assign(made.campaign ? `/prepare?campaign=${encodeURIComponent(made.campaign)}` : `/check?stand=${encodeURIComponent(made.stand)}`);
    });
  });
}
