// The service worker: once loaded, the page works offline. The build fills in the names of the files and a version that changes
// with any of them.
const version = "deltille-" + "VERSION";
const files = ["FILES"];

self.addEventListener("install", (event) => {
  event.waitUntil(
    caches
      .open(version)
      .then((cache) => cache.addAll(files))
      .then(() => self.skipWaiting()),
  );
});

self.addEventListener("activate", (event) => {
  const others = (names) => names.filter((name) => name.startsWith("deltille-") && name !== version);
  event.waitUntil(
    caches
      .keys()
      .then((names) => Promise.all(others(names).map((name) => caches.delete(name))))
      .then(() => self.clients.claim()),
  );
});

// Cached files are served from the cache; the page itself is fetched first, so that updates appear.
self.addEventListener("fetch", (event) => {
  const { request } = event;
  const url = new URL(request.url);
  if (request.method !== "GET" || url.origin !== self.location.origin) return;
  const keep = async () => {
    const answer = await fetch(request);
    if (answer.ok) await (await caches.open(version)).put(request, answer.clone());
    return answer;
  };
  const kept = () => caches.match(request, { ignoreSearch: true, ignoreVary: true });
  if (request.mode === "navigate") event.respondWith(keep().catch(async () => (await kept()) ?? (await caches.match("index.html")) ?? Response.error()));
  else event.respondWith(kept().then((answer) => answer ?? keep()));
});
