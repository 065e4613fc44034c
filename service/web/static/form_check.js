// Says under a field what is wrong with it, as it is filled in.

// Fields under which the browser's own sentence stands.
const faulty = new WeakSet();

export function checkFields(form) {
  form.addEventListener("input", (event) => showValidity(event.target));
  form.addEventListener("change", (event) => showValidity(event.target));
}

function showValidity(input) {
  if (!input.willValidate || !input.closest(".field")) return;
  if (!input.validity.valid) {
    tellField(input, input.validationMessage, "bad");
    faulty.add(input);
  } else if (faulty.delete(input)) {
    // Whatever else is told of a field stays: it may stand there while a button is pressed.
    tellField(input, "", "");
  }
}

export function tellField(input, sentence, tone) {
  const note = document.getElementById(`${input.id}-note`);
  note.className = `field-note ${tone}`;
  note.textContent = sentence;
}
