import config from "./playwright.config";

// Makes the pictures of README.md.
export default { ...config, projects: [{ testMatch: "readme.ts" }] };
