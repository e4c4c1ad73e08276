// The report of what a page is about: it is made and watched, its files are listed, a PDF is verified.
"use strict";

{
  const panel = Desk.byId("report-panel"), form = Desk.byId("report"), chosen = JSON.parse(panel.dataset.chosen);

  function list(files) {
    Desk.byId("no-report").hidden = files.length > 0;
    Desk.byId("report-files").replaceChildren(...files.map((name) => {
      const line = document.createElement("li"), link = document.createElement("a");
      link.textContent = name;
      link.href = `/report/file?path=${encodeURIComponent(name)}`;
      link.target = "_blank"; link.rel = "noopener";
      line.append(link);
      if (form && name.endsWith(".pdf")) line.append(" ", verifying(name));
      return line;
    }));
  }

  function verifying(path) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "Verify it";
    button.addEventListener("click", () => Desk.during(button, async () => {
      const place = Desk.byId("verified");
      place.textContent = "Verifying …"; place.classList.remove("problem");
      try {
        const found = await Desk.ask("/report/verify", { path });
        place.textContent = `${found.said}\nThe same as a command: ${found.command}`;
        place.classList.toggle("problem", !found.good);
      } catch (error) { place.textContent = ""; throw error; }
    }));
    return button;
  }

  form?.addEventListener("submit", (event) => {
    event.preventDefault();
    const content = { ...Object.fromEntries(new FormData(form)), ...chosen };
    form.elements.password.value = ""; // it goes to the command, and stays nowhere
    Desk.during(Desk.byId("make-report"), async () => {
      Desk.say("");
      Desk.byId("verified").textContent = "";
      const ended = await Desk.watch(await Desk.ask("/report", content));
      if (ended.status !== 0) throw new Error(ended.text || "The report could not be made.");
      const query = new URLSearchParams(Object.entries(chosen).flatMap(([key, all]) => all.map((one) => [key, one])));
      const answer = await fetch(`/report/made?${query}`);
      if (!answer.ok) throw new Error("The report is made, and the desk cannot say where.");
      list((await answer.json()).files);
      Desk.say(`The report is made${content.key ? " and signed" : ""}.`);
    });
  });

  list(JSON.parse(Desk.byId("report-files").dataset.files));
}
