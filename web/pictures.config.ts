import config from "./playwright.config";

// Takes the screenshots of README.md.
export default { ...config, projects: [{ testMatch: "readme.ts" }] };
