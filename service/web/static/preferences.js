// Language and colours: chosen in the head of every page, kept in cookies for the next one.

const YEAR_S = 31536000;

function keep(name, value) {
  document.cookie = `robocal_${name}=${value}; path=/; max-age=${YEAR_S}; samesite=strict`;
}

document.getElementById("language").addEventListener("change", (event) => {
  keep("language", event.target.value);
  location.reload();
});
document.getElementById("theme").addEventListener("change", (event) => {
  keep("theme", event.target.value);
  document.documentElement.dataset.theme = event.target.value;
  document.dispatchEvent(new Event("theme"));
});
