//! Images worked on at a time, as many as there are threads, and as their pixels allow.

use std::path::PathBuf;
use std::sync::{Condvar, Mutex, MutexGuard};

use rayon::ThreadPool;

use deltille::limits::Limits;
use deltille::photograph;

/// Does some work on each of the images, whose number it is told, on the threads of a pool. Images
/// that are in memory together have no more pixels than one may have.
pub fn for_each(
    pool: &ThreadPool,
    limits: &Limits,
    images: impl Iterator<Item = anyhow::Result<PathBuf>> + Send,
    work: impl Fn(usize, anyhow::Result<PathBuf>) + Sync,
) {
    let images = Mutex::new(images.enumerate());
    let memory = Memory { most: limits.max_pixels, used: Mutex::default(), freed: Condvar::new() };
    // Threads of the pool never wait for memory: one that does would hold up the images of others,
    // parts of which it works on.
    std::thread::scope(|scope| {
        for _ in 0..pool.current_num_threads() {
            scope.spawn(|| {
                loop {
                    let next = images.lock().expect("no iterator panics").next();
                    let Some((index, image)) = next else { return };
                    let pixels =
                        image.as_ref().ok().and_then(|path| photograph::pixels(path, limits));
                    let _taken = memory.take(pixels.unwrap_or(limits.max_pixels));
                    pool.install(|| work(index, image));
                }
            });
        }
    });
}

/// Pixels that may be in memory.
struct Memory {
    most: u64,
    used: Mutex<u64>,
    freed: Condvar,
}

/// Some of them, until it is dropped.
struct Taken<'a> {
    memory: &'a Memory,
    pixels: u64,
}

impl Memory {
    /// Takes so many, or all there are, as soon as they are free.
    fn take(&self, pixels: u64) -> Taken<'_> {
        let pixels = pixels.min(self.most);
        let is_short = |used: &mut u64| *used > self.most - pixels;
        let used = self.freed.wait_while(self.used(), is_short);
        *used.expect("no thread panics here") += pixels;
        Taken { memory: self, pixels }
    }

    fn used(&self) -> MutexGuard<'_, u64> {
        self.used.lock().expect("no thread panics here")
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        *self.memory.used() -= self.pixels;
        self.memory.freed.notify_all();
    }
}
