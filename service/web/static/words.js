// The texts of service/web/words, as the page brings them along.

const words = JSON.parse(document.getElementById("words").textContent);

export function say(key, values = {}) {
  if (!(key in words)) throw new Error(`no words for ${key}`);
  return words[key].replace(/\{(\w+)\}/g, (_, name) => values[name]);
}
