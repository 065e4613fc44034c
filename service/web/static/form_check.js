// Says under a field what is wrong with it, as it is filled in.

export function checkFields(form) {
  form.addEventListener("input", (event) => showValidity(event.target));
  form.addEventListener("change", (event) => showValidity(event.target));
}

function showValidity(input) {
  if (!input.willValidate || !input.closest(".field")) return;
  tellField(input, input.validity.valid ? "" : input.validationMessage, "bad");
}

export function tellField(input, sentence, tone) {
  const field = input.closest(".field");
  let note = field.querySelector(".field-note");
  if (!note) {
    note = document.createElement("small");
    note.id = `${input.id}-note`;
    note.setAttribute("role", "status");
    field.append(note);
    const described = input.getAttribute("aria-describedby");
    input.setAttribute("aria-describedby", described ? `${described} ${note.id}` : note.id);
  }
  note.className = `field-note ${tone}`;
  note.textContent = sentence;
}
