// The templates of the repository, bundled.
const texts = import.meta.glob<string>("../../templates/*.toml", { query: "?raw", import: "default", eager: true });

export const templates = Object.entries(texts).map(([path, text]) => ({ name: path.replace(/^.*\/|\.toml$/g, ""), text }));
