// Helpers of all page tests.
import type { Page } from "@playwright/test";

export const screen = (page: Page, name: string) => page.screenshot({ path: `test-results/screens/${name}.png`, fullPage: true });
export const chooseFiles = (page: Page, files: Parameters<ReturnType<Page["locator"]>["setInputFiles"]>[0]) => page.locator("input[type=file]").setInputFiles(files);

/** Errors of the page fail the test. */
export function strict({ page }: { page: Page }): void {
  page.on("console", (message) => {
    if (message.type() === "error") throw new Error(message.text());
  });
  page.on("pageerror", (error) => {
    throw error;
  });
}
