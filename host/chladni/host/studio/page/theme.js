// Dark or light: as the system has it, or as chosen and remembered.

const KEY = "chladni-theme";

export function startTheme(select) {
  select.value = remembered() ?? "system";
  apply(select.value);
  select.addEventListener("change", () => {
    apply(select.value);
    remember(select.value);
  });
}

function apply(theme) {
  if (theme === "system") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme;
}

// A page from a file may not be allowed to keep anything.
function remembered() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

function remember(theme) {
  try {
    localStorage.setItem(KEY, theme);
  } catch {
    // It is chosen for now.
  }
}
