// The ticked campaigns, or runs, beside each other: an address with all of them.
const button = document.getElementById("beside");
if (button) button.addEventListener("click", () => {
  const ticked = [...document.querySelectorAll("#choose input:checked")].map((one) => [one.name, one.value]);
  if (!ticked.length) { Desk.say("Tick one first.", true); return; }
  location.href = `/results?${new URLSearchParams(ticked)}`;
});
