// What was typed into a form outlives a reload of the page.

// What must not lie in the browser's storage: passwords, and the token of a one-time link.
const SECRET = ["password", "hidden"];

export function keepDraft(form) {
  const place = `draft:${form.id}`;
  for (const [name, value] of Object.entries(JSON.parse(sessionStorage.getItem(place) ?? "{}"))) {
    const input = form.elements.namedItem(name);
    const offered = input?.options && Array.from(input.options, (option) => option.value);
    if (input && (!offered || offered.includes(value))) input.value = value;
  }
  form.addEventListener("input", () => {
    const typed = Array.from(new FormData(form)).filter(([name, value]) => {
      return typeof value === "string" && !SECRET.includes(form.elements.namedItem(name).type);
    });
    sessionStorage.setItem(place, JSON.stringify(Object.fromEntries(typed)));
  });
  return () => sessionStorage.removeItem(place);
}
