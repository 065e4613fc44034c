// What was typed into a form outlives a reload of the page.

export function keepDraft(form) {
  const place = `draft:${form.id}`;
  for (const [name, value] of Object.entries(JSON.parse(sessionStorage.getItem(place) ?? "{}"))) {
    const input = form.elements.namedItem(name);
    const offered = input?.options && Array.from(input.options, (option) => option.value);
    if (input && (!offered || offered.includes(value))) input.value = value;
  }
  form.addEventListener("input", () => {
    const typed = Array.from(new FormData(form)).filter(([, value]) => typeof value === "string");
    sessionStorage.setItem(place, JSON.stringify(Object.fromEntries(typed)));
  });
  return () => sessionStorage.removeItem(place);
}
