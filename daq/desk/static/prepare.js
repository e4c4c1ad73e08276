// A campaign is prepared: the text is what counts, the form changes it at single places, the plan follows.
"use strict";

{
  // A plan is a process of its own: while one edits faster than plans are made, none is begun.
  const PLAN_AFTER_MS = 500, LONGEST_MS = 3000;
  const work = Desk.byId("work"), text = Desk.byId("text"), form = Desk.byId("form"), state = Desk.byId("state");
  const page = String(Math.random()).slice(2);
  let saved = text.value, asked = 0, timer = 0, took = 0, planned = null, chain = Promise.resolve();

  const named = (more) => ({ name: work.dataset.name, text: text.value, ...more });

  /** One change after the other: each starts from the text that the one before has left. */
  const inTurn = (what) => (chain = chain.then(what).catch((error) => Desk.say(error.message, true)));

  function changed() {
    const differs = text.value !== saved;
    state.textContent = differs ? "changed, not saved" : "as in the file";
    for (const name of ["to-check", "to-start"])
      Desk.byId(name).title = differs ? "What is not saved is not taken there" : "";
    Desk.byId("plan").setAttribute("aria-busy", "true"); // what it shows is of the text before
    clearTimeout(timer);
    timer = setTimeout(plan, Math.min(LONGEST_MS, Math.max(PLAN_AFTER_MS, took)));
  }

  async function plan() {
    const place = Desk.byId("plan"), of = text.value;
    if (of === planned) return place.removeAttribute("aria-busy"); // what is shown is of this very text
    const mine = ++asked, began = performance.now();
    const goneOn = () => mine !== asked || text.value !== of; // then a newer plan is on its way
    planned = null;
    place.setAttribute("aria-busy", "true");
    try {
      const said = await Desk.ask("/prepare/plan", named({ page }));
      took = performance.now() - began;
      if (goneOn()) return;
      unmark();
      if (said.plan) place.innerHTML = said.plan;
      else wrong(said);
      if (said.plan) planned = of;
    } catch (error) {
      if (goneOn()) return;
      Desk.say(error.message, true);
      noPlan(error.message); // what is shown there is of another text, or nothing yet
    } finally {
      if (!goneOn()) place.removeAttribute("aria-busy");
    }
  }

  function noPlan(why) {
    const none = document.createElement("p");
    none.className = "problem";
    none.textContent = `No plan: ${why}`;
    Desk.byId("plan").replaceChildren(none);
  }

  /** Say what is wrong above the text, at its line, and at its field of the form. */
  function wrong(said) {
    Desk.byId("wrong").textContent = said.wrong;
    noPlan(said.wrong);
    text.setAttribute("aria-invalid", "true");
    if (said.line && document.activeElement !== text) {
      const height = parseFloat(getComputedStyle(text).lineHeight);
      text.scrollTop = Math.max(0, (said.line - 4) * height);
    }
    const field = (said.field && Desk.byId(said.field)) || null;
    const group = said.group && Desk.byId(said.group);
    if (group) mark(field, group, said.wrong);
  }

  function mark(field, group, message) {
    group.open = true;
    const note = document.createElement("p");
    note.className = "problem at-place";
    note.textContent = message;
    if (field) {
      field.setAttribute("aria-invalid", "true");
      field.closest("details.more")?.setAttribute("open", "");
      field.closest(".field").append(note);
    } else group.querySelector("summary").after(note);
  }

  function unmark() {
    Desk.byId("wrong").textContent = "";
    text.removeAttribute("aria-invalid");
    for (const note of document.querySelectorAll(".at-place")) note.remove();
    for (const field of form.querySelectorAll("[aria-invalid]")) field.removeAttribute("aria-invalid");
  }

  function newForm(html) {
    const open = new Map([...form.querySelectorAll("details[id]")].map((one) => [one.id, one.open]));
    form.innerHTML = html;
    for (const [id, was] of open) {
      const group = Desk.byId(id);
      if (group) group.open = was;
    }
  }

  form.addEventListener("change", (event) => {
    const field = event.target;
    if (!field.dataset.path) return;
    inTurn(async () => {
      try {
        const said = await Desk.ask("/prepare/edit", named({ what: "set", path: JSON.parse(field.dataset.path), value: field.value }));
        text.value = said.text;
        field.removeAttribute("aria-invalid"); // it is a value now; what a plan says of it comes with the plan
        field.closest(".field").querySelector(".at-place")?.remove();
        changed();
      } catch (error) {
        unmark();
        mark(field, field.closest("details.group"), error.message);
      }
    });
  });

  form.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    if (button.dataset.move) return move(Number(button.dataset.index), Number(button.dataset.move));
    const what = button.id === "add" ? { what: "add", kind: Desk.byId("kind").value } : { what: "remove", index: Number(button.dataset.remove) };
    inTurn(async () => {
      const said = await Desk.ask("/prepare/edit", named(what));
      text.value = said.text;
      newForm(said.form);
      const steps = form.querySelectorAll("details[id^=g-step-]");
      const next = steps[button.id === "add" ? steps.length - 1 : Math.min(what.index, steps.length - 1)];
      if (next) {
        next.open = true;
        next.querySelector("summary").focus();
      }
      changed();
    });
  });

  /** A step changes places with its neighbour; the keyboard stays on the button that was pushed. */
  function move(index, by) {
    const other = index + by, was = [index, other].map((one) => Desk.byId(`g-step-${one}`).open);
    inTurn(async () => {
      const said = await Desk.ask("/prepare/edit", named({ what: "move", index, by }));
      text.value = said.text;
      newForm(said.form);
      Desk.byId(`g-step-${other}`).open = was[0];
      Desk.byId(`g-step-${index}`).open = was[1];
      const buttons = [...Desk.byId(`g-step-${other}`).querySelectorAll("[data-move]")].filter((one) => !one.disabled);
      (buttons.find((one) => Number(one.dataset.move) === by) || buttons[0]).focus();
      Desk.say(`Step ${index + 1} is now step ${other + 1}.`);
      changed();
    });
  }

  text.addEventListener("input", () => {
    changed();
    clearTimeout(text.waiting);
    text.waiting = setTimeout(() => inTurn(async () => newForm((await Desk.ask("/prepare/edit", named({ what: "form" }))).form)), PLAN_AFTER_MS);
  });

  // A scanner types the id and ends it with Enter.
  Desk.byId("scan").addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    const id = event.target.value.trim(), choice = Desk.byId("f-campaign-specimen");
    const found = choice && [...choice.options].find((one) => one.textContent.startsWith(`${id} (`));
    if (!id || !found) {
      Desk.say(`No specimen file in this folder has the id “${id}”: write one, or make it under New.`, true);
      return;
    }
    choice.value = found.value;
    choice.dispatchEvent(new Event("change", { bubbles: true }));
    event.target.value = "";
    Desk.say(`The specimen is ${id}.`);
  });

  function save(as) {
    return Desk.during(Desk.byId(as ? "save-as" : "save"), async () => {
      await chain;
      const said = await Desk.ask("/prepare/save", named({ base: work.dataset.base, as }));
      saved = text.value;
      Desk.say(said.said);
      if (as) location.assign(`/prepare?campaign=${encodeURIComponent(said.name)}`);
      work.dataset.base = said.base;
      state.textContent = "as in the file";
    });
  }

  Desk.byId("save").addEventListener("click", () => save(""));
  Desk.byId("save-as").addEventListener("click", () => {
    const name = Desk.byId("new-name");
    if (name.hidden) {
      for (const one of document.querySelectorAll(".bar .hide")) one.hidden = false;
      name.focus();
    } else if (name.value.trim()) save(name.value.trim());
  });
  Desk.byId("new-name").addEventListener("keydown", (event) => {
    if (event.key === "Enter") Desk.byId("save-as").click();
  });
  addEventListener("beforeunload", (event) => {
    if (text.value !== saved) event.preventDefault();
  });

  if (!Desk.byId("save").disabled) plan();
}
