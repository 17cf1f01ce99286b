import config from "./playwright.config";

// Benchmarks of the page. They depend on the speed of the machine and are no part of `npm test`.
export default { ...config, testDir: "times", workers: 1, projects: [{ testMatch: "*.ts" }] };
